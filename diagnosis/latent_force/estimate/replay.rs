//! Replays of segments from starts that have been moved.

use asid_core::Result;

use crate::latent_force::step_map::StepMap;
use crate::latent_force::tangent::retract;

use super::Estimate;

/// What a step of a segment's start may leave of its readings, relative to what its slopes promised.
const KEPT_PROMISE: f64 = 1.1;

impl Estimate {
    /// Replays the segments from their starts, which have just been moved from those `before`: each takes the step, of those
    /// offered and none, that leaves least of its readings.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn roll(
        &mut self,
        map: &mut StepMap<'_>,
        theta: &[f64],
        before: &[Vec<f64>],
    ) -> Result<()> {
        if !map.has_segments() {
            return Ok(());
        }
        let layout = map.layout().clone();
        let width = layout.nq + layout.nv;
        let all: Vec<bool> = vec![true; self.trajectory.len()];
        let mut left = map.roll(theta, (&mut self.trajectory, &all), &self.noise.r)?;
        // Where the step left what it promised, no shorter one is tried.
        let worse: Vec<bool> = left
            .iter()
            .zip(&self.smoothed)
            .map(|(left, s)| {
                let promised = s
                    .sums
                    .reading
                    .iter()
                    .zip(&self.noise.r)
                    .map(|([sum, _], r)| sum / r);
                *left > KEPT_PROMISE * promised.sum::<f64>()
            })
            .collect();
        let offered = self
            .smoothed
            .iter()
            .map(|s| s.damped.len())
            .max()
            .unwrap_or(0);
        for i in 0..=offered {
            let mut other = before.to_vec();
            for (states, smoothed) in other.iter_mut().zip(&self.smoothed) {
                if let Some(change) = smoothed.damped.get(i) {
                    retract(&layout, &mut states[..width], change);
                }
            }
            let of_other = map.roll(theta, (&mut other, &worse), &self.noise.r)?;
            for (w, states) in other.into_iter().enumerate() {
                if worse[w] && of_other[w] < left[w] {
                    left[w] = of_other[w];
                    self.trajectory[w] = states;
                }
            }
        }
        Ok(())
    }
}
