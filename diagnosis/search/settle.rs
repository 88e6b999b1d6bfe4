//! What the simulator cannot repeat, estimated where the search has arrived.
//!
//! The scatter that a search begins with is that of the model without an effect. Where motion is
//! chaotic it is another one along every trajectory: the true effect, replayed with a time step of
//! its own, ends as far off as a wrong one, its fit goes astray, and a second effect takes up some
//! of what is left. So the scatter, and the horizon beyond which a replay tells nothing, are
//! estimated anew about the best single effect wherever it leaves a gap.

use asid_core::Result;

use super::{Found, NEAR_BEST, NEGLIGIBLE, Search, excess, trials};
use crate::bench::Bench;
use crate::fit::Effort;

/// Most often that the scatter is estimated anew on a stage.
const SETTLINGS: usize = 4;
/// Share of a gap that the scatter must bring it below to be the cause of it.
const SETTLED: f64 = 0.7;

impl Search<'_> {
    /// Estimates the scatter of a longer stage about the best single effect of the one before, where
    /// it makes a difference: beyond the horizon of its prediction a fit only goes astray.
    pub(super) fn foresee(&mut self, stage: usize, all: &[Found]) -> Result<()> {
        let best = all.iter().find(|f| f.candidates.len() == 1);
        if let (true, Some(best)) = (stage > 0, best) {
            self.rescatter(stage, best)?;
        }
        Ok(())
    }

    /// Estimates the scatter of a stage about an explanation, and keeps it where it is what makes
    /// most of the gap there; with whether it is.
    fn rescatter(&mut self, stage: usize, about: &Found) -> Result<bool> {
        let explanation = &about.explanation;
        let trials = trials(self.candidates, &about.candidates, explanation);
        let left = |bench: &Bench| -> Result<f64> {
            let cost = bench.left(stage, &trials, explanation)?;
            Ok(excess(cost / bench.readings(stage)))
        };
        let before = left(self.bench)?;
        if before < NEGLIGIBLE {
            return Ok(false);
        }
        let scatter = self
            .scatter
            .estimate_about(self.bench, stage, &trials, explanation)?;
        let known = self.bench.set_scatter(stage, scatter);
        let settled = left(self.bench)? < SETTLED * before;
        if !settled {
            self.bench.set_scatter(stage, known);
        }
        Ok(settled)
    }

    /// Where even the best leaves a gap on a stage: estimates the scatter anew about the best single
    /// effect, and fits all that may be the best with it. What the simulator cannot repeat along
    /// this trajectory is no second effect.
    pub(super) fn settle(&mut self, stage: usize, all: &mut [Found]) -> Result<()> {
        for _ in 0..SETTLINGS {
            let Some(best) = all.iter().find(|f| f.candidates.len() == 1) else {
                break;
            };
            if self.gap(stage, all) < NEGLIGIBLE {
                break;
            }
            let best = best.clone();
            if !self.rescatter(stage, &best)? {
                break;
            }
            let most = NEAR_BEST * best.explanation.fit.cost;
            self.progress.begin("fitting again", all.len() as u64);
            for found in all.iter_mut() {
                if found.explanation.fit.cost < most {
                    found.explanation = self.extend(stage, found, Effort::BRIEF)?;
                }
                self.progress.advance(1);
            }
            self.progress.end();
            self.sort(all);
        }
        Ok(())
    }
}
