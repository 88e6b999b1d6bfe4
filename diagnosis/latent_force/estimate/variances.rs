//! Covariances by expectation maximisation (Shumway and Stoffer 1982).

use crate::latent_force::context::Context;
use crate::latent_force::smoother::Sums;

use super::Estimate;

/// Largest change of the logarithm of a variance in a round.
const LARGEST_CHANGE: f64 = 2.0;
/// Largest correlation of a missing force over a row.
const LARGEST_CORRELATION: f64 = 0.9999;
/// Smallest standard deviation of a reading, relative to its given or first estimated noise.
const LEAST_READING: f64 = 0.2;
/// Largest standard deviation of a reading, relative to the same noise.
const MOST_READING: f64 = 2.0;
/// Smallest standard deviation of a missing force, relative to the joint's inertial forces.
const LEAST_FORCE: f64 = 1e-5;

impl Estimate {
    pub(super) fn update_excess(&mut self, context: &Context<'_>) {
        let each = self.excess.iter_mut().zip(&self.misled);
        let each = each.zip(&self.smoothed).zip(&context.walks);
        for (((excess, misled), smoothed), walk) in each {
            if walk.segment.is_none() {
                continue;
            }
            let (mut squares, mut n) = (0.0, 0.0);
            let own = self.noise.r.iter().zip(&context.alike);
            for ([sum, count], (r, alike)) in smoothed.sums.reading.iter().zip(own) {
                squares += alike * sum / r;
                n += count;
            }
            let value: f64 = misled * squares / f64::max(n, 1.0);
            *excess = if value.is_finite() {
                value.max(1.0)
            } else {
                *excess
            };
        }
    }

    pub(super) fn update_noise(&mut self, context: &Context<'_>, sums: &Sums, length: f64) {
        let moved = |old: f64, new: f64, least: f64| {
            let change = (new / old).ln().clamp(-LARGEST_CHANGE, LARGEST_CHANGE);
            let moved = old * (length * change).exp();
            if moved.is_finite() {
                moved.max(least)
            } else {
                old
            }
        };
        if sums.steps == 0.0 {
            return;
        }
        let dt = sums.seconds / sums.steps;
        for (j, [later, earlier, product]) in sums.force.iter().enumerate() {
            let rho = (product / earlier).clamp(1e-6, LARGEST_CORRELATION);
            if !rho.is_finite() {
                continue;
            }
            // The readings determine the increment of a row well, but not how large the force
            // becomes in the long run.
            let innovation = (later - 2.0 * rho * product + rho * rho * earlier) / sums.steps;
            let before = self.noise.q[j] * (1.0 - (-2.0 * dt / self.noise.tau[j]).exp());
            let least = (LEAST_FORCE * context.inertial[j]).powi(2);
            let added = moved(before, innovation, 0.0);
            self.noise.q[j] = (added / (1.0 - rho * rho)).max(least);
            self.noise.tau[j] = -dt / rho.ln();
            self.noise.white[j] = moved(
                self.noise.white[j],
                sums.white[j] / sums.steps,
                1e-2 * least,
            )
            .max(self.least_white[j]);
        }
        for (i, [squares, n]) in sums.reading.iter().enumerate() {
            if *n > 0.0 {
                let least = LEAST_READING.powi(2) * context.reading_variance[i];
                let most = MOST_READING.powi(2) * context.reading_variance[i];
                let variance = context.alike[i] * squares / n;
                self.noise.r[i] = moved(self.noise.r[i], variance, least).min(most);
            }
        }
    }
}
