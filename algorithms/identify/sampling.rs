//! From a search's samples to a posterior: adaptive multiple importance sampling.
//!
//! Every point that was simulated counts. With proposals `q_1 … q_T` and `n_t`
//! draws from each, a point `x` weighs `L(x) / sum_t n_t q_t(x)` (the deterministic
//! mixture of Owen and Zhou 2000; adapted over rounds as by Cornuet et al. 2012).
//! A few rounds of draws around the weighted samples follow the search, because a
//! search may end narrower than the posterior.
//!
//! The likelihood is tempered, `L^beta`, for two reasons, and both only widen the
//! interval: where the best fit leaves residuals larger than the sensors' noise
//! (`beta = 1 / reduced chi^2`), and where contact makes the likelihood so ragged
//! that a handful of points would carry all the weight (`beta` falls until the
//! effective number of samples is reached).

use asid_core::identify::{Identified, IterationSummary};
use asid_core::posterior::weighted_quantile;
use asid_core::rng::Rng;
use asid_core::{Error, Posterior, Problem, Result};
use serde::{Deserialize, Serialize};

use super::Likelihood;
use crate::optimise::{Gaussian, require};

/// How the posterior is sampled after the search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SamplingSettings {
    /// Rounds of draws around the weighted samples.
    pub rounds: usize,
    /// Draws a round.
    pub draws: usize,
    /// Factor on the deviations of a round's proposal.
    pub widen: f64,
    /// Smallest effective number of samples.
    pub min_effective: f64,
}

impl Default for SamplingSettings {
    fn default() -> Self {
        Self {
            rounds: 4,
            draws: 64,
            widen: 1.3,
            min_effective: 25.0,
        }
    }
}

impl SamplingSettings {
    /// Checks the settings.
    ///
    /// # Errors
    /// When one is out of its domain.
    pub fn check(&self) -> Result<()> {
        let Self { draws, widen, min_effective, .. } = *self;
        require(draws > 0, "identifier.sampling.draws", draws as f64, "at least 1")?;
        require(widen > 0.0, "identifier.sampling.widen", widen, "above 0")?;
        require(min_effective >= 1.0, "identifier.sampling.min_effective", min_effective, "at least 1")
    }
}

/// Everything that was simulated, and what it was drawn from.
#[derive(Default)]
pub struct Samples {
    points: Vec<Vec<f64>>,
    losses: Vec<f64>,
    proposals: Vec<(Gaussian, usize)>,
}

impl Samples {
    /// Adds draws from one proposal.
    pub fn add(&mut self, proposal: Gaussian, points: Vec<Vec<f64>>, losses: &[f64]) {
        self.proposals.push((proposal, points.len()));
        self.points.extend(points);
        self.losses.extend_from_slice(losses);
    }

    /// The point with the smallest loss.
    #[must_use]
    pub fn best(&self) -> Option<(&[f64], f64)> {
        (0..self.losses.len())
            .filter(|&i| self.losses[i].is_finite())
            .min_by(|&i, &j| self.losses[i].total_cmp(&self.losses[j]))
            .map(|i| (&*self.points[i], self.losses[i]))
    }

    /// Log of the mixture density at every point.
    fn log_mixture(&self) -> Vec<f64> {
        self.points
            .iter()
            .map(|x| {
                let terms: Vec<f64> = self
                    .proposals
                    .iter()
                    .map(|(q, n)| (*n as f64).ln() + q.log_density(x))
                    .collect();
                let max = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                max + terms.iter().map(|t| (t - max).exp()).sum::<f64>().ln()
            })
            .collect()
    }

    /// Normalised weights under the likelihood to the power `beta`.
    fn weights(&self, log_mixture: &[f64], beta: f64) -> Vec<f64> {
        let logs: Vec<f64> = self
            .losses
            .iter()
            .zip(log_mixture)
            .map(|(l, q)| {
                if l.is_finite() {
                    -beta * l - q
                } else {
                    f64::NEG_INFINITY
                }
            })
            .collect();
        let max = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = logs.iter().map(|l| (l - max).exp()).collect();
        let total: f64 = weights.iter().sum();
        weights.iter().map(|w| w / total).collect()
    }

    /// Weights with the largest `beta` not above `highest` that reach the effective number.
    fn tempered(&self, highest: f64, min_effective: f64) -> (Vec<f64>, f64) {
        let log_mixture = self.log_mixture();
        let effective = |w: &[f64]| 1.0 / w.iter().map(|w| w * w).sum::<f64>();
        let weights = self.weights(&log_mixture, highest);
        let target = min_effective.min(self.points.len() as f64 / 2.0);
        if effective(&weights) >= target {
            return (weights, highest);
        }
        let (mut low, mut high) = (highest * 1e-6, highest);
        for _ in 0..40 {
            let middle = (low * high).sqrt();
            if effective(&self.weights(&log_mixture, middle)) >= target {
                low = middle;
            } else {
                high = middle;
            }
        }
        (self.weights(&log_mixture, low), low)
    }
}

/// Quantiles of the unknowns over weighted points, for pictures.
#[must_use]
pub fn summary(
    likelihood: &Likelihood<'_>,
    points: &[Vec<f64>],
    weights: &[f64],
    best_loss: f64,
) -> IterationSummary {
    let values: Vec<Vec<f64>> = points.iter().map(|p| likelihood.parameters(p)).collect();
    let total: f64 = weights.iter().sum();
    let weights: Vec<f64> = weights.iter().map(|w| w / total).collect();
    let d = values.first().map_or(0, Vec::len);
    IterationSummary {
        quantiles: (0..d)
            .map(|i| {
                let column: Vec<f64> = values.iter().map(|v| v[i]).collect();
                [0.025, 0.25, 0.5, 0.75, 0.975].map(|q| weighted_quantile(&column, &weights, q))
            })
            .collect(),
        best_loss,
    }
}

/// Rounds of importance sampling after a search, and the posterior.
///
/// # Errors
/// When the engine fails or every simulation diverged.
pub fn posterior(
    problem: &Problem<'_>,
    likelihood: &mut Likelihood<'_>,
    settings: &SamplingSettings,
    mut samples: Samples,
    mut iterations: Vec<IterationSummary>,
    rng: &mut Rng,
) -> Result<Identified> {
    let (low, high) = likelihood.bounds();
    let n = likelihood.dimension();
    let diverged = || Error::Failed("every simulation of the episode diverged".into());
    // Entries of the reading minus entries of the point: what a perfect fit leaves.
    let freedom = (likelihood.present() as f64 - n as f64).max(1.0);
    let mismatch = |loss: f64| (2.0 * loss / freedom).max(1.0);
    for _ in 0..settings.rounds {
        let (_, best) = samples.best().ok_or_else(diverged)?;
        let (weights, _) = samples.tempered(
            1.0 / mismatch(best),
            settings.min_effective.max(4.0 * n as f64),
        );
        let proposal = Gaussian::fit(&samples.points, &weights, &vec![1e-4; n], &low, &high)
            .widened(settings.widen);
        let points: Vec<Vec<f64>> = (0..settings.draws).map(|_| proposal.sample(rng)).collect();
        let losses = likelihood.losses(&points)?;
        samples.add(proposal, points, &losses);
        problem.progress.advance(1);
        let best = samples.best().ok_or_else(diverged)?.1;
        iterations.push(summary(
            likelihood,
            &samples.points,
            &weights_padded(&weights, samples.points.len()),
            best,
        ));
    }
    let (best_point, best_loss) = samples
        .best()
        .map(|(x, l)| (x.to_vec(), l))
        .ok_or_else(diverged)?;
    let (weights, _) = samples.tempered(1.0 / mismatch(best_loss), settings.min_effective);
    iterations.push(summary(likelihood, &samples.points, &weights, best_loss));
    let values: Vec<Vec<f64>> = samples
        .points
        .iter()
        .map(|p| likelihood.parameters(p))
        .collect();
    let (values, weights): (Vec<_>, Vec<_>) = values
        .into_iter()
        .zip(weights)
        .filter(|(_, w)| *w > 1e-9)
        .unzip();
    let episodes = (n - problem.parameters.len()) / problem.task.exploration().start.len().max(1);
    Ok(Identified {
        posterior: Posterior::from_samples(problem.parameters, values, &weights),
        starts: (0..episodes)
            .map(|k| likelihood.start(&best_point, k))
            .collect(),
        iterations,
        residual: (2.0 * best_loss / likelihood.present().max(1) as f64).sqrt(),
    })
}

/// Weights of the points before the last round, with zeros for that round.
fn weights_padded(weights: &[f64], len: usize) -> Vec<f64> {
    let mut padded = weights.to_vec();
    padded.resize(len, 0.0);
    padded
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Streams;

    fn drawn(stds: &[f64], target_mean: f64, target_std: f64) -> Samples {
        let mut rng = Streams::new(5).stream("s");
        let mut samples = Samples::default();
        for &std in stds {
            let q = Gaussian::diagonal(&[0.1], &[std], &[-50.0], &[50.0]);
            let points: Vec<Vec<f64>> = (0..2000).map(|_| q.sample(&mut rng)).collect();
            let losses: Vec<f64> = points
                .iter()
                .map(|p| 0.5 * ((p[0] - target_mean) / target_std).powi(2))
                .collect();
            samples.add(q, points, &losses);
        }
        samples
    }

    #[test]
    fn a_mixture_of_wide_and_narrow_proposals_gives_the_known_posterior() {
        let samples = drawn(&[3.0, 1.0, 0.1], 0.4, 0.5);
        let weights = samples.weights(&samples.log_mixture(), 1.0);
        let mean: f64 = samples
            .points
            .iter()
            .zip(&weights)
            .map(|(p, w)| p[0] * w)
            .sum();
        let var: f64 = samples
            .points
            .iter()
            .zip(&weights)
            .map(|(p, w)| w * (p[0] - mean).powi(2))
            .sum();
        // About 2500 effective samples: errors of 0.5 / sqrt(2500) = 0.01.
        assert!((mean - 0.4).abs() < 0.03, "{mean}");
        assert!((var.sqrt() - 0.5).abs() < 0.03, "{}", var.sqrt());
    }

    #[test]
    fn tempering_reaches_the_effective_number() {
        let samples = drawn(&[3.0], 0.4, 1e-4);
        let (weights, beta) = samples.tempered(1.0, 25.0);
        let effective = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
        assert!(
            beta < 1.0 && effective >= 25.0 && effective < 30.0,
            "{beta} {effective}"
        );
    }
}
