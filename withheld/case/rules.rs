//! Rules that leave out a draw whose cause nobody could tell, or whose readings nobody could
//! repeat.

use super::Draw;
use super::sizing::Causes;
use crate::dirt::Item;
use crate::engine::RAPIER;
use crate::error::{Error, Result};
use crate::gap::Bench;
use crate::simulate::simulate;
use crate::world::World;

/// Largest gap that the study's time step alone may make, in noise floors; a draw with a larger gap
/// is left out.
///
/// The motion of such a draw is chaotic, or its model is too coarse. The same limit applies if
/// another engine moves the world than the study: the two engines must agree on what happens
/// without a cause.
const INTEGRATION: f64 = 0.5;
/// Largest change of the readings when the world's time step is halved: in noise floors, and as a
/// share of the excess gap.
///
/// The larger of the two limits applies. Nobody could repeat the readings of a draw beyond it.
const REPEATABLE: [f64; 2] = [0.5, 0.05];
/// Episodes in which a world is run again at half its time step.
const CHECKED: usize = 3;

/// Why a draw is left out.
pub(super) enum LeftOut {
    /// A stated rule excludes it.
    Rule(String),
    /// The generator itself failed.
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
    /// Gap that the engine, time step and integrator of the study make without a cause.
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

    /// Leaves the draw out if half the time step changes its readings too much.
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
