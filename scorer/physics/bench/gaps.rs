//! Gaps on the held-out logs: of the identified model, of the diagnosis' model, and the best
//! possible.

use asid_core::Result;

use super::named::{Named, verdict};
use super::{Bench, gap};
use crate::answer::Answer;
use crate::label::Label;
use crate::physics::Gaps;
use crate::physics::fit::{Fit, robust_deviation};
use crate::physics::logs::{HEAD, head_rows};
use crate::physics::model::{Point, World};

/// Residual, in robust standard deviations of the best model, above which a reading is an outlier.
///
/// An outlier counts for no model. One normal reading in five hundred million is beyond this limit.
const OUTLIER: f64 = 6.0;
/// Excess, in units of the noise, below which there is no gap to close: the contract's 1.05 of the
/// whole gap.
const NO_GAP: f64 = 0.32;

impl Bench<'_> {
    /// A point for the held-out logs: the given values, and open initial states fitted to the heads
    /// of the logs.
    ///
    /// The flag says whether initial states were fitted.
    pub(super) fn held_out(&mut self, world: &World, values: &[f64]) -> Result<(Point, bool)> {
        let (starts, open) = self.starts(1);
        let fitted = !open.is_empty();
        let layout = &self.study.plant.layout;
        let mut fit = Fit::new(layout, world, open)?.starts_only();
        let point = Point {
            values: values.to_vec(),
            starts,
        };
        let mut heads = self.logs[1].heads(layout, HEAD)?;
        Ok((fit.run(&mut heads, point)?, fitted))
    }

    /// Residuals on the held-out logs; NaN if a reading is missing or does not count.
    fn residuals(&mut self, world: &World, values: &[f64]) -> Result<Vec<Vec<f64>>> {
        let (point, fitted) = self.held_out(world, values)?;
        let mut fit = Fit::new(&self.study.plant.layout, world, Vec::new())?;
        let readings = fit.predict(&mut self.logs[1], &point)?;
        let logs = &self.logs[1];
        let n = logs.signals.whitened_len();
        let mut residuals = logs.residuals(&readings);
        if fitted {
            for (log, residuals) in logs.logs.iter().zip(&mut residuals) {
                let head = head_rows(log.episode.rows(), HEAD);
                residuals[..head * n].fill(f64::NAN);
            }
        }
        Ok(residuals)
    }

    /// Subtracts from the residuals what an answer has learned of them.
    fn without_learned(&self, residuals: &[Vec<f64>], answer: &Answer) -> Vec<Vec<f64>> {
        let mut left = residuals.to_vec();
        for (left, learned) in left.iter_mut().zip(&answer.learned) {
            let noise = self.logs[1].noise.iter().cycle();
            for ((left, learned), noise) in left.iter_mut().zip(learned).zip(noise) {
                *left -= learned / noise;
            }
        }
        left
    }

    pub(super) fn gaps(
        &mut self,
        label: &Label,
        answer: &Answer,
        (true_world, best): (&World, &[f64]),
    ) -> Result<Gaps> {
        let none = Named {
            effects: Vec::new(),
            parameters: Box::new(|name| label.parameters.get(name).copied()),
        };
        let (world, values) = self.fitted(&none)?;
        let identified = self.residuals(&world, &values)?;
        let best = self.residuals(true_world, best)?;
        let said = verdict(answer);
        let refined = if answer.verdict.kind == "effects" {
            let world = self
                .engine
                .world(self.study, &said.effects, &*said.parameters)?;
            let values: Vec<f64> = world.unknowns.iter().map(|u| u.start).collect();
            self.residuals(&world, &values)?
        } else {
            self.without_learned(&identified, answer)
        };
        let bound = OUTLIER * robust_deviation(&best).max(1.0);
        let counts: Vec<bool> = best
            .iter()
            .flatten()
            .map(|r| r.is_finite() && r.abs() <= bound)
            .collect();
        let [identified, refined, best] =
            [identified, refined, best].map(|residuals| gap(&residuals, &counts));
        let possible = identified * identified - best * best;
        let closed = identified * identified - refined * refined;
        Ok(Gaps {
            identified,
            refined,
            best,
            closed_of_possible: (possible > NO_GAP * NO_GAP).then(|| closed / possible),
        })
    }
}
