//! A posterior over parameters: weighted samples and their summaries.

use rand::Rng as _;
use serde::{Deserialize, Serialize};

use crate::parameter::Parameter;
use crate::rng::Rng;

/// Marginal posterior of one parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Marginal {
    /// Name of the parameter.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Mean.
    pub estimate: f64,
    /// Standard deviation.
    pub std: f64,
    /// Central 95 % interval.
    pub interval95: [f64; 2],
    /// The end of the prior's range at which the posterior piles up, if any. The true value may lie
    /// beyond, and no interval inside the range contains it then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_edge: Option<Edge>,
    /// The final search range, if the search was extended beyond that end; it contains the
    /// posterior.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub searched: Option<[f64; 2]>,
    /// Whether the data do not determine it (see [`Posterior::unseen`]). Its marginal is then the
    /// prior's, and its deviation from the data alone is infinite.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub unidentified: bool,
}

impl Marginal {
    /// Whether the interval touches an end of this range, so that values beyond it may fit as well.
    #[must_use]
    pub fn reaches_an_end_of(&self, range: [f64; 2]) -> bool {
        let [low, high] = self.interval95;
        let touch = TOUCH * (high - low);
        low - range[0] <= touch || range[1] - high <= touch
    }
}

/// An end of a prior's range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Edge {
    /// The smallest value.
    Low,
    /// The largest value.
    High,
}

impl Edge {
    /// Name in results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::High => "high",
        }
    }
}

/// A combination of unknowns that the data do not see.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Direction {
    /// Name of each unknown that takes part, and its share in prior deviations; the squares of
    /// all shares sum to 1.
    pub weights: Vec<(String, f64)>,
}

/// Outer share of the prior's range in which a pile is sought.
const OUTER: f64 = 0.1;

/// A pile holds at least this many times the prior's mass in the outer share. A posterior that
/// falls off from the edge with a deviation of a quarter of the range just reaches it. A wider one
/// says too little to be called a pile.
const PILE: f64 = 3.0;

/// An interval touches the edge if its distance from it is below this share of its width. The
/// interval of a normal distribution cut at its mean ends at 0.014 of its width, that of an
/// exponential one at 0.007, that of one cut two deviations below its mean at 0.09.
const TOUCH: f64 = 0.05;

/// The end of its range at which a posterior piles up; `None` where it does not.
///
/// `positions` in the range are 0 to 1, and their weights sum to 1. A single value is no
/// distribution and never piles up.
fn edge(positions: &[f64], weights: &[f64]) -> Option<Edge> {
    if positions.len() < 2 {
        return None;
    }
    let [low, high] = [0.025, 0.975].map(|q| weighted_quantile(positions, weights, q));
    let touch = TOUCH * (high - low);
    let held = |near: &dyn Fn(f64) -> bool| -> f64 {
        let pairs = positions.iter().zip(weights);
        pairs.filter(|(u, _)| near(**u)).map(|(_, w)| w).sum()
    };
    if low <= touch && held(&|u| u <= OUTER) >= PILE * OUTER {
        Some(Edge::Low)
    } else if 1.0 - high <= touch && held(&|u| u >= 1.0 - OUTER) >= PILE * OUTER {
        Some(Edge::High)
    } else {
        None
    }
}

/// Weighted samples of the parameters, `n x d`, in their units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Posterior {
    /// One entry a parameter.
    pub marginals: Vec<Marginal>,
    /// Samples, one row each.
    pub samples: Vec<Vec<f64>>,
    /// Weights of the samples; they sum to 1.
    pub weights: Vec<f64>,
    /// Combinations of unknowns that the data do not determine, if the identifier looked for them.
    /// Along these the samples are those of the prior.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unseen: Vec<Direction>,
}

/// An unknown is unidentified if this share of its direction (a squared cosine) lies in the
/// subspace that the data do not determine. Otherwise at least nine tenths of it are determined.
const SHARE: f64 = 0.1;

impl Posterior {
    /// Summarises weighted samples.
    ///
    /// `samples` is `n x d`, one row a sample and one entry a parameter, in its unit. `weights` are
    /// `n` numbers of at least 0, which need not sum to 1.
    ///
    /// # Panics
    /// When the numbers of weights and samples differ, a sample has fewer entries than there are
    /// parameters, or the weights do not sum to a number above 0.
    #[must_use]
    pub fn from_samples(parameters: &[Parameter], samples: Vec<Vec<f64>>, weights: &[f64]) -> Self {
        let (n, d) = (samples.len(), parameters.len());
        assert!(
            weights.len() == n,
            "a posterior of {n} samples has {} weights",
            weights.len()
        );
        assert!(
            samples.iter().all(|s| s.len() >= d),
            "a sample of a posterior over {d} parameters has fewer entries"
        );
        let total: f64 = weights.iter().sum();
        assert!(
            total.is_finite() && total > 0.0,
            "the weights of a posterior sum to {total}, which is no number above 0"
        );
        let weights: Vec<f64> = weights.iter().map(|w| w / total).collect();
        let marginals = parameters
            .iter()
            .enumerate()
            .map(|(i, p)| {
                let values: Vec<f64> = samples.iter().map(|s| s[i]).collect();
                let mean: f64 = values.iter().zip(&weights).map(|(x, w)| x * w).sum();
                // By rounding, the mean of equal values can differ from them.
                let low = values.iter().copied().fold(f64::INFINITY, f64::min);
                let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let mean = if mean < low {
                    low
                } else if mean > high {
                    high
                } else {
                    mean
                };
                let variance: f64 = values
                    .iter()
                    .zip(&weights)
                    .map(|(x, w)| w * (x - mean).powi(2))
                    .sum();
                Marginal {
                    name: p.name.clone(),
                    unit: p.unit.clone(),
                    estimate: mean,
                    std: variance.max(0.0).sqrt(),
                    interval95: [
                        weighted_quantile(&values, &weights, 0.025),
                        weighted_quantile(&values, &weights, 0.975),
                    ],
                    at_edge: (!p.is_binary())
                        .then(|| values.iter().map(|x| p.to_unit(*x)).collect::<Vec<_>>())
                        .and_then(|positions| edge(&positions, &weights)),
                    searched: None,
                    unidentified: false,
                }
            })
            .collect();
        Self {
            marginals,
            samples,
            weights,
            unseen: Vec::new(),
        }
    }

    /// Sets the directions that the data do not determine, and marks the unknowns that lie in them.
    #[must_use]
    pub fn with_unseen(mut self, unseen: Vec<Direction>) -> Self {
        for marginal in &mut self.marginals {
            let weights = unseen.iter().flat_map(|d| &d.weights);
            let own = weights.filter(|(name, _)| *name == marginal.name);
            marginal.unidentified = own.map(|(_, w)| w * w).sum::<f64>() > SHARE;
        }
        self.unseen = unseen;
        self
    }

    /// The prior as `n` equally weighted samples: a stratified draw in each parameter, in
    /// independent order.
    #[must_use]
    pub fn prior(parameters: &[Parameter], n: usize, rng: &mut Rng) -> Self {
        let mut samples = vec![vec![0.0; parameters.len()]; n];
        for (i, parameter) in parameters.iter().enumerate() {
            let mut strata: Vec<usize> = (0..n).collect();
            for k in (1..n).rev() {
                strata.swap(k, rng.random_range(0..=k));
            }
            for (sample, stratum) in samples.iter_mut().zip(strata) {
                let u: f64 = rng.random();
                sample[i] = parameter.from_unit((stratum as f64 + u) / n as f64);
            }
        }
        Self::from_samples(parameters, samples, &vec![1.0; n])
    }

    /// Mean of each parameter.
    #[must_use]
    pub fn mean(&self) -> Vec<f64> {
        self.marginals.iter().map(|m| m.estimate).collect()
    }

    /// `n` equally weighted samples by systematic resampling.
    pub fn resample(&self, n: usize, rng: &mut Rng) -> Vec<Vec<f64>> {
        let offset: f64 = rng.random();
        let mut out = Vec::with_capacity(n);
        let (mut k, mut cumulative) = (0, self.weights[0]);
        for i in 0..n {
            let u = (i as f64 + offset) / n as f64;
            while u > cumulative && k + 1 < self.weights.len() {
                k += 1;
                cumulative += self.weights[k];
            }
            out.push(self.samples[k].clone());
        }
        out
    }
}

/// Quantile of weighted values, interpolated between the midpoints of their weights.
///
/// `weights` sum to 1.
#[must_use]
pub fn weighted_quantile(values: &[f64], weights: &[f64], q: f64) -> f64 {
    let mut order: Vec<usize> = (0..values.len()).filter(|&i| weights[i] > 0.0).collect();
    order.sort_by(|&i, &j| values[i].total_cmp(&values[j]));
    let Some(&first) = order.first() else {
        return f64::NAN;
    };
    let (mut last_value, mut last_at) = (values[first], weights[first] / 2.0);
    if q <= last_at {
        return last_value;
    }
    let mut below = weights[first];
    for &i in &order[1..] {
        let at = below + weights[i] / 2.0;
        if q <= at {
            let along = (q - last_at) / (at - last_at);
            return last_value + along * (values[i] - last_value);
        }
        (last_value, last_at) = (values[i], at);
        below += weights[i];
    }
    last_value
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Streams;

    #[test]
    fn quantiles_of_equal_weights_are_the_usual_ones() {
        let values: Vec<f64> = (0..101).map(f64::from).collect();
        let weights = vec![1.0 / 101.0; 101];
        assert!((weighted_quantile(&values, &weights, 0.5) - 50.0).abs() < 1e-9);
        assert!((weighted_quantile(&values, &weights, 0.25) - 24.75).abs() < 0.01);
    }

    #[test]
    fn a_heavy_sample_carries_the_quantile() {
        let q = weighted_quantile(&[1.0, 2.0, 3.0], &[0.01, 0.98, 0.01], 0.5);
        assert!((q - 2.0).abs() < 1e-9);
    }

    fn parameter() -> Parameter {
        Parameter {
            name: "p".into(),
            targets: vec!["geom/a/friction/0".parse().unwrap()],
            range: [0.0, 1.0],
            scale: crate::parameter::Scale::Linear,
            unit: String::new(),
        }
    }

    #[test]
    fn the_mean_of_samples_that_are_alike_is_that_sample() {
        for n in 1..2000 {
            // Weights whose rounded sum is not 1, like those of a comparison of models.
            let weights: Vec<f64> = (0..n).map(|i| 1.0 / (1.0 + f64::from(i % 7))).collect();
            let samples = vec![vec![1.0]; n as usize];
            let posterior = Posterior::from_samples(&[parameter()], samples, &weights);
            assert_eq!(posterior.mean(), [1.0]);
        }
    }

    /// The edge of a posterior with the quantile function `at`, defined on 0 to 1.
    fn edge_of(at: impl Fn(f64) -> f64) -> Option<Edge> {
        let n = 2000;
        let samples = (0..n).map(|i| vec![at((f64::from(i) + 0.5) / f64::from(n))]);
        let posterior =
            Posterior::from_samples(&[parameter()], samples.collect(), &vec![1.0; n as usize]);
        posterior.marginals[0].at_edge
    }

    #[test]
    fn a_pile_at_an_edge_is_named() {
        // Exponential decay from either end, by a twentieth of the range.
        let fall = |q: f64| -0.05 * (1.0 - q).ln();
        assert_eq!(edge_of(|q| fall(q).min(1.0)), Some(Edge::Low));
        assert_eq!(edge_of(|q| 1.0 - fall(q).min(1.0)), Some(Edge::High));
        // All at the edge.
        assert_eq!(edge_of(|_| 0.0), Some(Edge::Low));
    }

    #[test]
    fn a_posterior_inside_and_one_that_knows_nothing_pile_up_nowhere() {
        // The prior itself, a narrow posterior close to the edge, and an uninformative one.
        assert_eq!(edge_of(|q| q), None);
        assert_eq!(edge_of(|q| 0.01 + 0.005 * q), None);
        assert_eq!(edge_of(|q| q.powf(1.5)), None);
        // A logistic one, not cut, whose 2.5 % quantile is three of its scales from the edge.
        assert_eq!(
            edge_of(|q| (0.2 + 0.02 * (q / (1.0 - q)).ln()).max(0.0)),
            None
        );
    }

    #[test]
    fn what_the_data_do_not_see_is_marked() {
        let posterior = Posterior::from_samples(&[parameter()], vec![vec![0.5]], &[1.0]);
        let of = |share: f64| Direction {
            weights: vec![
                ("p".into(), share),
                ("q".into(), (1.0 - share * share).sqrt()),
            ],
        };
        let seen = posterior.clone().with_unseen(vec![of(0.1)]);
        assert!(!seen.marginals[0].unidentified && seen.unseen.len() == 1);
        assert!(posterior.with_unseen(vec![of(0.7)]).marginals[0].unidentified);
    }

    #[test]
    #[should_panic(expected = "the weights of a posterior sum to 0")]
    fn weights_that_sum_to_nothing_are_no_posterior() {
        let _ = Posterior::from_samples(&[parameter()], vec![vec![0.5]], &[0.0]);
    }

    #[test]
    fn resampling_keeps_the_mean() {
        let parameters = [parameter()];
        let samples: Vec<Vec<f64>> = (0..50).map(|i| vec![f64::from(i) / 50.0]).collect();
        let weights: Vec<f64> = (0..50).map(f64::from).collect();
        let posterior = Posterior::from_samples(&parameters, samples, &weights);
        let drawn = posterior.resample(1000, &mut Streams::new(0).stream("t"));
        let mean = drawn.iter().map(|s| s[0]).sum::<f64>() / 1000.0;
        // Systematic resampling is off by at most the range over the number drawn.
        assert!((mean - posterior.mean()[0]).abs() < 2e-3);
    }
}
