//! Rules by which a draw is left out: nobody could tell its cause, or repeat it.

use super::Draw;
use super::sizing::Causes;
use crate::dirt::Item;
use crate::engine::RAPIER;
use crate::error::{Error, Result};
use crate::gap::Bench;
use crate::simulate::simulate;
use crate::world::World;

/// A case is left out where the study's time step alone makes a gap of more than this, in noise floors:
/// its motion is chaotic, or its model too coarse. So where the world is of another engine than the study: the two
/// do not agree on what happens without a cause.
const INTEGRATION: f64 = 0.5;
/// A case is left out where half the world's time step changes its readings by more than this, in noise floors,
/// or by more than this share of its excess gap: nobody could repeat it.
const REPEATABLE: [f64; 2] = [0.5, 0.05];
/// Episodes in which a world is run again at half its time step.
const CHECKED: usize = 3;

/// Why a draw was left out.
pub(super) enum LeftOut {
    /// By a stated rule.
    Rule(String),
    /// The generator is wrong.
    Fault(Error),
}

impl From<Error> for LeftOut {
    fn from(error: Error) -> Self {
        match error {
            Error::Diverged { .. } => Self::Rule(error.to_string()),
            other => Self::Fault(other),
        }
    }
}

impl Draw<'_> {
    /// Gap that the study's own engine, time step and integrator make, without a cause.
    pub(super) fn integration_gap(&self, bench: &Bench<'_>) -> Result<f64, LeftOut> {
        let option = self.anatomy.document.find("option", None);
        let integrator = option.and_then(|o| o.get("integrator")).unwrap_or("Euler");
        let step = self.anatomy.timestep;
        let mut study = World::new(self.anatomy, &bench.truth, step, integrator)?;
        let gap = bench.distance(&bench.run(&mut study)?, &bench.clean);
        let by = if bench.integrator == RAPIER {
            "engine"
        } else {
            "time step"
        };
        if gap > INTEGRATION {
            return Err(LeftOut::Rule(format!(
                "the study's {by} alone makes a gap of {gap:.2}"
            )));
        }
        Ok(gap)
    }

    /// Leaves out what half the time step changes.
    pub(super) fn repeatable(
        &self,
        bench: &Bench<'_>,
        truth: &[f64],
        dirt: &[Item],
        causes: &Causes,
        readings: &[f64],
        excess: f64,
    ) -> Result<(), LeftOut> {
        let mut finer = self.world(bench, truth, dirt, causes, bench.timestep / 2.0)?;
        let some = &bench.motions[..CHECKED];
        let record = simulate(self.anatomy, &mut finer, some)?;
        let changed = bench.rows(&record, &finer.steps);
        let change = bench.distance(&changed, &readings[..changed.len()]);
        if change > REPEATABLE[0].max(REPEATABLE[1] * excess) {
            return Err(LeftOut::Rule(format!(
                "half the time step changes the readings by {change:.2}"
            )));
        }
        Ok(())
    }
}
