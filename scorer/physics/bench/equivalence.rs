//! Decides whether two sets of effects are the same physics.
//!
//! One set is fitted to the noise-free predictions of the other.

use asid_core::Result;

use super::named::Named;
use super::{Bench, gap};
use crate::physics::fit::Fit;
use crate::physics::model::{Point, World};

/// Root mean square difference of noise-free predictions below which two sets are the same physics,
/// in units of the noise.
///
/// A likelihood ratio could distinguish them from about 400 readings, if the noise were white and
/// the model otherwise exact. It is not.
pub(super) const SAME: f64 = 0.1;

impl Bench<'_> {
    /// Noise-free predictions of a fitted world, for the training logs and the held-out logs.
    pub(super) fn predictions(
        &mut self,
        world: &World,
        values: &[f64],
    ) -> Result<[Vec<Vec<f64>>; 2]> {
        let (starts, open) = self.starts(0);
        let layout = &self.study.plant.layout;
        let mut fit = Fit::new(layout, world, open)?.starts_only();
        let point = Point {
            values: values.to_vec(),
            starts,
        };
        let point = fit.run(&mut self.logs[0], point)?;
        let train = fit.predict(&mut self.logs[0], &point)?;
        let (point, _) = self.held_out(world, values)?;
        let test = fit.predict(&mut self.logs[1], &point)?;
        Ok([train, test])
    }

    /// Root mean square difference on the held-out logs between `targets` and a set that is
    /// refitted to them.
    ///
    /// It is in units of the noise.
    pub(super) fn distance(
        &mut self,
        named: &Named<'_>,
        targets: &[Vec<Vec<f64>>; 2],
    ) -> Result<f64> {
        let world = self
            .engine
            .world(self.study, &named.effects, &*named.parameters)?;
        let layout = &self.study.plant.layout;
        let mut values: Vec<f64> = world.unknowns.iter().map(|u| u.start).collect();
        let mut distance = f64::INFINITY;
        // First fit all unknowns to the training logs; then, at these values, the open initial
        // states of the held-out logs.
        for which in 0..2 {
            let (starts, open) = self.starts(which);
            let mut fit = Fit::new(layout, &world, open)?;
            if which == 1 {
                fit = fit.starts_only();
            }
            let mut logs = self.logs[which]
                .like(layout)?
                .with_readings(&targets[which]);
            let point = fit.run(&mut logs, Point { values, starts })?;
            let readings = fit.predict(&mut logs, &point)?;
            let residuals = logs.residuals(&readings);
            let present = logs.residuals(&targets[which]);
            let counts: Vec<bool> = present.iter().flatten().map(|r| r.is_finite()).collect();
            distance = gap(&residuals, &counts);
            values = point.values;
        }
        Ok(distance)
    }

    /// Whether every effect of a set is needed to predict `targets`.
    pub(super) fn each_is_needed(
        &mut self,
        named: &Named<'_>,
        targets: &[Vec<Vec<f64>>; 2],
    ) -> Result<bool> {
        for left_out in 0..named.effects.len() {
            let mut effects = named.effects.clone();
            effects.remove(left_out);
            let fewer = Named {
                effects,
                parameters: Box::new(|name| (named.parameters)(name)),
            };
            if self.distance(&fewer, targets)? < SAME {
                return Ok(false);
            }
        }
        Ok(true)
    }
}
