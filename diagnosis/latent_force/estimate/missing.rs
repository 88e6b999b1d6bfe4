//! What the model lacks: the missing force along walks, and what segments leave.

use crate::latent_force::context::Context;

use super::Estimate;

/// Mean square of what is left of readings, beyond their noise and in units of it, that counts as nothing: a gap of 1.05.
pub const LEAST_LEFT: f64 = 0.1;
/// Root mean square of the missing force, relative to the inertial forces, up to which nothing is missing.
pub const NOTHING: f64 = 0.01;
/// Least deviation of the white part, relative to what is missing without any effect: what is finer decides
/// nothing, for no law of friction or of a drive is the machine's own to the last digit.
const LEAST_WHITE: f64 = 0.1;

/// What a model lacks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Missing {
    /// Power of the missing force where it is smoothed, beyond what is too fine to decide, in units of the inertial forces,
    /// over all degrees of freedom.
    pub force: f64,
    /// Mean square of what segments leave of their readings beyond the noise, in units of it.
    pub readings: f64,
    /// Share of the rows that are in segments.
    pub share: f64,
}

impl Missing {
    /// Relative to what another model lacks, of force and of readings by their shares of the rows.
    #[must_use]
    pub fn relative_to(self, other: Self) -> f64 {
        let force = self.force / other.force.max(f64::MIN_POSITIVE);
        let readings = self.readings / other.readings.max(LEAST_LEFT);
        (1.0 - self.share) * force + self.share * readings
    }
}

impl Estimate {
    /// Power of the missing force at a degree of freedom, beyond what is too fine to decide, in units of the inertial forces there.
    fn missing_at(&self, context: &Context<'_>, dof: usize) -> f64 {
        let noise = &self.noise;
        let beyond = noise.q[dof] + noise.white[dof] - self.least_white[dof];
        beyond.max(0.0) / context.inertial[dof].powi(2)
    }

    /// Whether a model lacks less than a `share` of the power of the force that this one lacks, at some degree of freedom where that is more than
    /// nothing. Beside a large force that is missing elsewhere it may be hardly any of all.
    #[must_use]
    pub fn is_made_up_for_by(&self, other: &Self, context: &Context<'_>, share: f64) -> bool {
        let is_smoothed = context.walks.iter().any(|w| w.segment.is_none());
        is_smoothed
            && (0..context.inertial.len()).any(|dof| {
                let [before, after] = [self, other].map(|e| e.missing_at(context, dof));
                before > NOTHING * NOTHING && after < share * before
            })
    }

    /// What the model lacks.
    #[must_use]
    pub fn missing(&self, context: &Context<'_>) -> Missing {
        let power = |j: usize| self.missing_at(context, j);
        let (mut squares, mut n, mut in_segments, mut rows) = (0.0, 0.0, 0, 0);
        for (walk, smoothed) in context.walks.iter().zip(&self.smoothed) {
            rows += walk.len();
            if walk.segment.is_some() {
                in_segments += walk.len();
                let own = self.noise.r.iter().zip(&context.alike);
                for ([sum, count], (r, alike)) in smoothed.sums.reading.iter().zip(own) {
                    squares += alike * sum / r;
                    n += count;
                }
            }
        }
        let share = in_segments as f64 / rows.max(1) as f64;
        Missing {
            force: if share < 1.0 {
                (0..context.inertial.len()).map(power).sum()
            } else {
                0.0
            },
            readings: (squares / f64::max(n, 1.0) - 1.0).max(0.0),
            share,
        }
    }

    /// From here on nothing finer than a part of the force that is missing now decides.
    pub fn set_resolution(&mut self, context: &Context<'_>) {
        let nv = context.plant().layout.nv;
        for j in 0..nv {
            let all = || self.forces(context, j);
            let n = all().count().max(1) as f64;
            let mean_square = all().map(|w| w * w).sum::<f64>() / n;
            self.least_white[j] = LEAST_WHITE * LEAST_WHITE * mean_square;
            self.noise.white[j] = self.noise.white[j].max(self.least_white[j]);
        }
    }

    /// The missing force at a degree of freedom, along all walks that are smoothed.
    fn forces<'s>(
        &'s self,
        context: &'s Context<'_>,
        dof: usize,
    ) -> impl Iterator<Item = f64> + 's {
        let nv = context.plant().layout.nv;
        let pairs = self.smoothed.iter().zip(&context.walks);
        pairs
            .filter(|(_, w)| w.segment.is_none())
            .flat_map(move |(s, _)| s.force.iter().skip(dof).step_by(nv).copied())
    }

    /// Quantile of the magnitude of the missing force at each degree of freedom.
    #[must_use]
    pub fn force_quantile(&self, context: &Context<'_>, quantile: f64) -> Vec<f64> {
        (0..context.plant().layout.nv)
            .map(|d| {
                let mut all: Vec<f64> = self.forces(context, d).map(f64::abs).collect();
                if all.is_empty() {
                    return 0.0;
                }
                let at = ((all.len() - 1) as f64 * quantile).round() as usize;
                *all.select_nth_unstable_by(at, f64::total_cmp).1
            })
            .collect()
    }
}
