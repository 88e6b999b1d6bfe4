//! What the model lacks: the missing force along walks, and the residuals of segments.

use crate::latent_force::context::Context;

use super::Estimate;

/// Mean square of residuals that counts as zero, beyond the noise and in units of it: a gap of
/// 1.05.
pub const LEAST_LEFT: f64 = 0.1;
/// Root mean square of the missing force, relative to the inertial forces, below which nothing is
/// missing.
pub const NOTHING: f64 = 0.01;
/// Smallest standard deviation of the white part, relative to the missing force without any effect.
///
/// Finer differences decide nothing: no law of friction or of a drive matches a machine to the last
/// digit.
const LEAST_WHITE: f64 = 0.1;

/// What a model lacks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Missing {
    /// Power of the missing force along smoothed walks, beyond the resolution, in units of the
    /// inertial forces, summed over all degrees of freedom.
    pub force: f64,
    /// Mean square of the segments' residuals beyond the noise, in units of it.
    pub readings: f64,
    /// Share of the rows that belong to segments.
    pub share: f64,
}

impl Missing {
    /// Returns the ratio to what another model lacks; force and readings are weighted by their
    /// shares of the rows.
    #[must_use]
    pub fn relative_to(self, other: Self) -> f64 {
        let force = self.force / other.force.max(f64::MIN_POSITIVE);
        let readings = self.readings / other.readings.max(LEAST_LEFT);
        (1.0 - self.share) * force + self.share * readings
    }
}

impl Estimate {
    /// Returns the power of the missing force at a degree of freedom, in units of the inertial
    /// forces there; 0 if no reading tells of the force.
    ///
    /// Such a force is as large as the fit began with, times every common scale of the variances
    /// since. The spin of a ball in flight of which only the place is read is an example.
    #[must_use]
    pub fn missing_power(&self, context: &Context<'_>, dof: usize) -> f64 {
        self.power_beyond(context, (dof, 0.0))
    }

    /// Returns the same power beyond the resolution.
    fn missing_at(&self, context: &Context<'_>, dof: usize) -> f64 {
        self.power_beyond(context, (dof, self.least_white[dof]))
    }

    /// Returns the power of the missing force at a degree of freedom beyond a variance `least`, in
    /// units of the inertial forces there; 0 if no reading tells of the force.
    fn power_beyond(&self, context: &Context<'_>, (dof, least): (usize, f64)) -> f64 {
        if !self.told[dof] {
            return 0.0;
        }
        let beyond = self.noise.q[dof] + self.noise.white[dof] - least;
        beyond.max(0.0) / context.inertial[dof].powi(2)
    }

    /// Whether `other` lacks less than a `share` of the power that this model lacks, at some degree
    /// of freedom where that is more than nothing.
    ///
    /// Compared with a large missing force elsewhere, that power may be a small part of the total.
    #[must_use]
    pub fn is_made_up_for_by(&self, other: &Self, context: &Context<'_>, share: f64) -> bool {
        let is_smoothed = context.walks.iter().any(|w| w.segment.is_none());
        is_smoothed
            && (0..context.inertial.len()).any(|dof| {
                let [before, after] = [self, other].map(|e| e.missing_at(context, dof));
                before > NOTHING * NOTHING && after < share * before
            })
    }

    /// Returns what the model lacks.
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

    /// Sets the resolution: from here on, nothing finer than a part of the present missing force
    /// decides.
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

    /// Returns the missing force at a degree of freedom, along all smoothed walks.
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

    /// Returns a quantile of the magnitude of the missing force at each degree of freedom.
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
