//! From a search to a posterior.
//!
//! A search locates the likelihood's maximum. It does not measure its width, and neither does the
//! spread of an elite. So rounds of draws over a region around the search's end follow. Each round
//! fits an [`Emulator`] to all points inside the region. The emulator's posterior makes the next
//! region: narrower where the data are informative, wider where the region was too narrow.

use asid_core::identify::{Identified, IterationSummary};
use asid_core::posterior::weighted_quantile;
use asid_core::rng::Rng;
use asid_core::{Error, Posterior, Problem, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Likelihood;
use super::emulator::{Emulator, REACH, features_len};
use super::evidence::Evidence;
use crate::optimise::{Gaussian, require};

/// Offset of a posterior's mean from the region's middle, in standard deviations of the region
/// ([`REACH`] are searched), above which the region moves without narrowing.
///
/// The likelihood is then still better outside. The posterior's width is that of a tail cut off by
/// the region, and no measure of its true width.
const OUTSIDE: f64 = 2.0;

/// Maximum number of rounds, in multiples of those of the settings: a round whose region was too
/// narrow, or lay beside the posterior, does not count as one of these.
const PATIENCE: usize = 3;

/// How the posterior is sampled after the search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SamplingSettings {
    /// Rounds of draws, at least; up to three times as many where the region of a round cuts the
    /// posterior.
    pub rounds: usize,
    /// Draws per round; at least three per feature of the emulator are taken.
    pub draws: usize,
    /// Standard deviations of the next region in units of the posterior's.
    pub widen: f64,
    /// Number of posterior samples that are kept.
    pub samples: usize,
    /// Whether readings are weighted by the whole covariance of the roughness along the episode, or
    /// by its variance alone. Where `model_errors.members` is given, it is true unless it is given
    /// too.
    pub correlated: bool,
    /// How far the search continues past an end of a prior's range where the posterior piles up, in
    /// widths of the range; 0 keeps it inside.
    pub beyond: f64,
}

impl Default for SamplingSettings {
    fn default() -> Self {
        Self {
            rounds: 4,
            draws: 64,
            widen: 2.0,
            samples: 1000,
            correlated: false,
            beyond: 1.0,
        }
    }
}

impl SamplingSettings {
    /// Checks that each setting is in its domain.
    ///
    /// # Errors
    /// [`Error::Config`] naming the setting.
    pub fn check(&self) -> Result<()> {
        let Self {
            draws,
            widen,
            samples,
            beyond,
            ..
        } = *self;
        require(
            draws > 0,
            "identifier.sampling.draws",
            draws as f64,
            "at least 1",
        )?;
        require(
            samples > 1,
            "identifier.sampling.samples",
            samples as f64,
            "at least 2",
        )?;
        require(widen > 0.0, "identifier.sampling.widen", widen, "above 0")?;
        require(
            beyond >= 0.0 && beyond.is_finite(),
            "identifier.sampling.beyond",
            beyond,
            "at least 0",
        )
    }

    /// Draws per round for a search space of `n` entries.
    #[must_use]
    pub fn draws_for(&self, n: usize) -> usize {
        self.draws.max(3 * features_len(n))
    }
}

/// All points that were simulated, with their residuals and losses.
#[derive(Default)]
pub struct Samples {
    points: Vec<Vec<f64>>,
    residuals: Vec<Vec<f64>>,
    losses: Vec<f64>,
}

impl Samples {
    /// Adds points with their residuals; returns the loss of each.
    ///
    /// The loss is half the sum of squares, infinite where the simulation diverged.
    pub fn add(&mut self, points: &[Vec<f64>], residuals: Vec<Option<Vec<f64>>>) -> Vec<f64> {
        let mut losses = Vec::with_capacity(points.len());
        for (point, residual) in points.iter().zip(residuals) {
            let Some(residual) = residual else {
                losses.push(f64::INFINITY);
                continue;
            };
            let loss = 0.5 * residual.iter().map(|x| x * x).sum::<f64>();
            losses.push(loss);
            self.points.push(point.clone());
            self.residuals.push(residual);
            self.losses.push(loss);
        }
        losses
    }

    /// The smallest loss so far.
    #[must_use]
    pub fn best_loss(&self) -> f64 {
        self.losses.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// The residual of the point with the smallest loss; `None` where every simulation diverged.
    #[must_use]
    pub fn best_residual(&self) -> Option<&[f64]> {
        let best =
            (0..self.losses.len()).min_by(|&i, &j| self.losses[i].total_cmp(&self.losses[j]));
        best.map(|i| &*self.residuals[i])
    }

    /// Fit to the `count` best points, weighted by rank so that no single lucky point dominates.
    fn elite(&self, count: usize, low: &[f64], high: &[f64]) -> Result<Gaussian> {
        let mut order: Vec<usize> = (0..self.losses.len()).collect();
        order.sort_by(|&i, &j| self.losses[i].total_cmp(&self.losses[j]));
        order.truncate(count);
        let weights: Vec<f64> = (0..order.len())
            .map(|rank| ((count as f64 + 0.5) / (rank as f64 + 1.0)).ln())
            .collect();
        let points: Vec<Vec<f64>> = order.iter().map(|&i| self.points[i].clone()).collect();
        Gaussian::fit(&points, &weights, &vec![1e-2; low.len()], low, high)
    }
}

/// Quantiles of the unknowns over points, for plots.
#[must_use]
pub fn summary(
    likelihood: &Likelihood<'_>,
    points: &[Vec<f64>],
    best_loss: f64,
) -> IterationSummary {
    let values: Vec<Vec<f64>> = points.iter().map(|p| likelihood.parameters(p)).collect();
    let weights = vec![1.0 / values.len().max(1) as f64; values.len()];
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

/// The region that follows a posterior, and whether the posterior has its own width and not that of
/// the region in which it was drawn.
///
/// In standard deviations of the region, a posterior has the width `1 / widen` in a region as wide
/// as it should be. One that fills the region is uniform over [`REACH`] to either side, and has the
/// width `REACH / sqrt(3)`. The limit between the two is their geometric mean.
fn next_region(region: &Gaussian, posterior: &Gaussian, widen: f64) -> (Gaussian, bool) {
    let off = region.standardise(posterior.mean());
    if off.iter().any(|u| u.abs() > OUTSIDE) {
        return (region.moved_to(posterior.mean()), false);
    }
    let cut = (REACH / 3.0_f64.sqrt() / widen).sqrt();
    let settled = region.widest_axis(posterior) <= cut;
    (posterior.widened(widen), settled)
}

/// Runs rounds of draws after a search; returns the posterior and its evidence.
///
/// # Errors
/// When the engine fails or nearly every simulation diverged.
pub fn posterior(
    problem: &Problem<'_>,
    likelihood: &mut Likelihood<'_>,
    settings: &SamplingSettings,
    mut samples: Samples,
    mut iterations: Vec<IterationSummary>,
    rng: &mut Rng,
) -> Result<(Identified, Evidence)> {
    let (low, high) = likelihood.bounds();
    let n = likelihood.dimension();
    let d = likelihood.sought();
    let too_few = || Error::Failed("nearly every simulation of the episode diverged".into());
    if samples.points.len() < 2 {
        return Err(too_few());
    }
    let draws = settings.draws_for(n);
    let mut region = samples
        .elite(2 * n + 4, &low, &high)?
        .widened(settings.widen);
    let mut found: Option<(Emulator, Vec<Vec<f64>>)> = None;
    let rounds = settings.rounds.max(1);
    let (mut narrowed, mut round) = (0, 0);
    while narrowed < rounds && round < PATIENCE * rounds {
        round += 1;
        let points: Vec<Vec<f64>> = (0..draws).map(|_| region.sample(rng)).collect();
        let residuals = likelihood.residuals(&points)?;
        samples.add(&points, residuals);
        let near: Vec<usize> = (0..samples.points.len())
            .filter(|&i| {
                region
                    .standardise(&samples.points[i])
                    .iter()
                    .all(|u| u.abs() <= REACH)
            })
            .collect();
        let points: Vec<&[f64]> = near.iter().map(|&i| &*samples.points[i]).collect();
        let residuals: Vec<&[f64]> = near.iter().map(|&i| &*samples.residuals[i]).collect();
        let present = likelihood.present();
        let emulator = Emulator::fit(&region, &points, &residuals, present, settings.correlated)
            .ok_or_else(too_few)?;
        let drawn = emulator.sample(settings.samples.max(2), rng);
        iterations.push(summary(likelihood, &drawn, samples.best_loss()));
        let posterior =
            Gaussian::fit(&drawn, &vec![1.0; drawn.len()], &vec![1e-3; n], &low, &high)?;
        let settled;
        (region, settled) = next_region(&region, &posterior, settings.widen);
        narrowed += usize::from(settled);
        found = Some((emulator, drawn));
        if round <= rounds {
            problem.progress.advance(1);
        }
    }
    let (emulator, drawn) = found.ok_or_else(too_few)?;
    let best = emulator.best();
    let values: Vec<Vec<f64>> = drawn.iter().map(|p| likelihood.parameters(p)).collect();
    let widths = (0..d).map(|i| {
        let column = drawn.iter().map(|p| p[i]);
        let mean = column.clone().sum::<f64>() / drawn.len() as f64;
        let variance = column.map(|z| (z - mean).powi(2)).sum::<f64>() / drawn.len() as f64;
        variance.sqrt().clamp(1e-9, 1.0).ln()
    });
    let evidence = emulator.evidence(likelihood.present(), widths.sum());
    let identified = Identified {
        posterior: Posterior::from_samples(problem.parameters, values, &vec![1.0; drawn.len()]),
        starts: (0..likelihood.episodes())
            .map(|k| likelihood.start(&best, k))
            .collect(),
        iterations,
        residual: emulator.residual,
        misfit: Some(emulator.misfit),
        roughness: emulator.roughness,
    };
    Ok((identified, evidence))
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Streams;
    use nalgebra::DMatrix;

    use crate::identify::walk::Walk;

    fn normal(mean: [f64; 2], std: [f64; 2]) -> Gaussian {
        Gaussian::diagonal(&mean, &std, &[-99.0; 2], &[99.0; 2])
    }

    /// Symptom: on the shuffleboard the deviation of the sliding friction was up to three times too
    /// small. Cause: rounds ended while the region still cut the start pose, and what a region cuts
    /// looks known.
    #[test]
    fn a_round_whose_region_cuts_the_posterior_does_not_count() {
        let region = normal([0.0; 2], [1.0; 2]);
        // A uniform density over three standard deviations to either side has 1.7 of them.
        let (next, settled) = next_region(&region, &normal([0.0; 2], [0.1, 1.7]), 2.0);
        assert!(!settled);
        assert_eq!(next.std(), [0.2, 3.4]);
        let (next, settled) = next_region(&next, &normal([0.1; 2], [0.1, 1.7]), 2.0);
        assert!(settled);
        assert_eq!(next.std(), [0.2, 3.4]);
    }

    /// Symptom: with eight episodes hardly any round counted. Cause: the largest ratio of two sample
    /// covariances grows with the number of entries.
    #[test]
    fn rounds_of_a_normal_posterior_count_with_many_episodes() {
        for n in [3, 19, 27] {
            let walk = Walk {
                shape: DMatrix::identity(n, n),
                inside: &|_| true,
                loss: &|u: &[f64]| 0.5 * u.iter().map(|x| x * x).sum::<f64>(),
            };
            let fitted = |seed| {
                let mut rng = Streams::new(seed).stream("walk");
                let drawn = walk.draws(&vec![0.0; n], 1000, &mut rng);
                let (low, high) = (vec![-99.0; n], vec![99.0; n]);
                Gaussian::fit(&drawn, &vec![1.0; 1000], &vec![0.0; n], &low, &high).unwrap()
            };
            for seed in 0..5 {
                let region = fitted(2 * seed).widened(2.0);
                assert!(next_region(&region, &fitted(2 * seed + 1), 2.0).1, "{n}");
            }
        }
    }

    #[test]
    fn a_posterior_at_the_end_of_its_region_moves_the_region() {
        let region = normal([0.0; 2], [1.0; 2]);
        let (next, settled) = next_region(&region, &normal([2.5, 0.0], [0.1; 2]), 2.0);
        assert!(!settled);
        assert_eq!((next.mean(), next.std()), (&[2.5, 0.0][..], vec![1.0; 2]));
    }
}
