//! Running mean and standard deviation of observations.
//!
//! Observations mix metres, radians and nats; a network with tanh units learns best from entries of
//! order one. Rewards are never scaled this way: a changing scale would break objectives whose
//! per-step rewards telescope.

use serde::{Deserialize, Serialize};

/// Scales each entry of an observation by its statistics so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Normaliser {
    /// Number of observations seen; 0 for the identity.
    count: f64,
    mean: Vec<f64>,
    /// Mean squared deviation from the mean.
    variance: Vec<f64>,
}

/// Normalised entries are clipped to plus and minus this many standard deviations.
pub const CLIP: f64 = 10.0;

/// Lower bound of a variance: prevents division by zero for an entry that never changes.
const SMALLEST_VARIANCE: f64 = 1e-8;

impl Normaliser {
    /// The identity over observations of `len` entries, until [`Self::update`] is called.
    #[must_use]
    pub fn identity(len: usize) -> Self {
        Self {
            count: 0.0,
            mean: vec![0.0; len],
            variance: vec![1.0; len],
        }
    }

    /// Number of entries of an observation.
    #[must_use]
    pub fn observation_len(&self) -> usize {
        self.mean.len()
    }

    /// Adds a batch of observations, `n x observation_len`, to the statistics.
    ///
    /// The moments of the batch are merged with those so far (Chan et al. 1979), so that the result
    /// does not depend on the batching.
    pub fn update(&mut self, observations: &[f64]) {
        let len = self.mean.len();
        if len == 0 || observations.len() < len {
            return;
        }
        let n = (observations.len() / len) as f64;
        let total = self.count + n;
        for entry in 0..len {
            let column = || observations[entry..].iter().step_by(len);
            let mean = column().sum::<f64>() / n;
            let squares = column().map(|x| (x - mean).powi(2)).sum::<f64>();
            let delta = mean - self.mean[entry];
            let sum = self.variance[entry] * self.count
                + squares
                + delta.powi(2) * self.count * n / total;
            self.mean[entry] += delta * n / total;
            self.variance[entry] = sum / total;
        }
        self.count = total;
    }

    /// Writes the normalised observations, `n x observation_len`, in the networks' precision.
    pub fn normalise(&self, observations: &[f64], normalised: &mut [f32]) {
        if self.count == 0.0 {
            for (out, &x) in normalised.iter_mut().zip(observations) {
                *out = x as f32;
            }
            return;
        }
        let moments = self.mean.iter().zip(&self.variance).cycle();
        let entries = observations.iter().zip(normalised);
        for ((x, out), (mean, variance)) in entries.zip(moments) {
            let scaled = (x - mean) / (variance + SMALLEST_VARIANCE).sqrt();
            *out = scaled.clamp(-CLIP, CLIP) as f32;
        }
    }

    /// The statistics as stored in a file: number of observations, mean and variance.
    #[must_use]
    pub fn moments(&self) -> (f64, &[f64], &[f64]) {
        (self.count, &self.mean, &self.variance)
    }

    /// Normaliser from the statistics of a file.
    #[must_use]
    pub fn from_moments(count: f64, mean: Vec<f64>, variance: Vec<f64>) -> Self {
        Self {
            count,
            mean,
            variance,
        }
    }

    /// Whether all numbers are usable, since a file may hold anything.
    pub(crate) fn is_sound(&self) -> bool {
        self.mean.len() == self.variance.len()
            && self.count >= 0.0
            && self.count.is_finite()
            && self.mean.iter().all(|m| m.is_finite())
            && self.variance.iter().all(|v| *v >= 0.0 && v.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_do_not_depend_on_the_batches() {
        let data: Vec<f64> = (0..24)
            .map(|i| (i as f64 * 0.7).sin() * 5.0 + 100.0)
            .collect();
        let mut whole = Normaliser::identity(2);
        whole.update(&data);
        let mut parts = Normaliser::identity(2);
        parts.update(&data[..2]);
        parts.update(&data[2..14]);
        parts.update(&data[14..]);
        let column: Vec<f64> = data.iter().copied().step_by(2).collect();
        let mean = column.iter().sum::<f64>() / 12.0;
        let variance = column.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 12.0;
        // Tolerance: rounding relative to squares of about 10^4.
        assert!((whole.mean[0] - mean).abs() < 1e-10);
        assert!((whole.variance[0] - variance).abs() < 1e-10);
        assert!((whole.variance[1] - parts.variance[1]).abs() < 1e-10);
        assert!((whole.mean[1] - parts.mean[1]).abs() < 1e-10);
    }

    #[test]
    fn outliers_are_clipped_and_constants_become_zero() {
        let mut normaliser = Normaliser::identity(2);
        normaliser.update(&[-1.0, 7.0, 1.0, 7.0]);
        let mut out = [0.0; 4];
        normaliser.normalise(&[0.5, 7.0, 1e6, 7.0], &mut out);
        assert!((out[0] - 0.5).abs() < 1e-6);
        assert_eq!(out[1..], [0.0, 10.0, 0.0]);
    }

    #[test]
    fn before_any_observation_it_is_the_identity() {
        let mut out = [0.0; 2];
        Normaliser::identity(2).normalise(&[3.0, -40.0], &mut out);
        assert_eq!(out, [3.0, -40.0]);
    }
}
