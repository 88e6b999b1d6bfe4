//! Relative entropy policy search (Peters, Mülling and Altün 2010), episodic form.
//!
//! It weights the draws by `exp(J / eta)` and refits. The temperature `eta` bounds the step by
//! `eps` in relative entropy.
//!
//! If `J` is a log-likelihood, `eta` is also a temperature in the statistical sense. It is then
//! kept at 1 or above; at 1 the draws of one step are weighted by the likelihood itself.

use asid_core::Result;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Gaussian, Search, UpdateRule, require};

/// How far one refit may move the distribution.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RepsSettings {
    /// Bound on the relative entropy of a step.
    pub epsilon: f64,
    /// Smallest temperature; 1 for a log-likelihood, 0 for a plain search.
    pub min_eta: f64,
}

impl Default for RepsSettings {
    fn default() -> Self {
        Self {
            epsilon: 0.5,
            min_eta: 0.0,
        }
    }
}

/// The dual function `eta * eps + eta * log mean exp((J - max J) / eta) + max J`.
#[must_use]
pub fn dual(eta: f64, epsilon: f64, rewards: &[f64]) -> f64 {
    let max = rewards.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mean = rewards.iter().map(|j| ((j - max) / eta).exp()).sum::<f64>() / rewards.len() as f64;
    eta * epsilon + eta * mean.ln() + max
}

/// The temperature that minimises the dual, by golden-section search on its logarithm.
///
/// At a thousandth of the distance from the best reward to the next one all weight is on the best;
/// at a thousand times the spread all draws weigh alike. The minimum lies between.
#[must_use]
pub fn temperature(epsilon: f64, rewards: &[f64]) -> f64 {
    let max = rewards.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // Relative to the best, so that a large constant takes no digits from small differences.
    let rewards: Vec<f64> = rewards.iter().map(|j| j - max).collect();
    let spread = rewards.iter().fold(1e-12, |s: f64, j| s.max(-j));
    let worse = rewards.iter().filter(|j| **j < 0.0);
    let nearest = worse.fold(spread, |s, j| s.min(-j));
    let ratio = (5_f64.sqrt() - 1.0) / 2.0;
    let least = (nearest * 1e-3).max(f64::MIN_POSITIVE);
    let (mut a, mut b) = (least.ln(), (spread * 1e3).ln());
    let f = |x: f64| dual(x.exp(), epsilon, &rewards);
    let (mut c, mut d) = (b - ratio * (b - a), a + ratio * (b - a));
    let (mut fc, mut fd) = (f(c), f(d));
    for _ in 0..100 {
        if fc < fd {
            (b, d, fd) = (d, c, fc);
            c = b - ratio * (b - a);
            fc = f(c);
        } else {
            (a, c, fc) = (c, d, fd);
            d = a + ratio * (b - a);
            fd = f(d);
        }
    }
    ((a + b) / 2.0).exp()
}

/// A search by relative entropy policy search with full covariance; a cost is a negative reward.
pub type Reps = Search<RepsSettings>;

/// Smallest standard deviation, as a fraction of its initial value: a thousandth of a prior's
/// standard deviation is less than that of any posterior of the tasks.
const MIN_STD: f64 = 1e-3;

impl RepsSettings {
    /// Checks the settings; `key` is their place in a configuration.
    ///
    /// # Errors
    /// When a setting is out of its domain.
    pub fn check(&self, key: &str) -> Result<()> {
        let Self { epsilon, min_eta } = *self;
        require(epsilon > 0.0, &format!("{key}.epsilon"), epsilon, "above 0")?;
        require(
            min_eta >= 0.0,
            &format!("{key}.min_eta"),
            min_eta,
            "0 or above",
        )
    }
}

impl UpdateRule for RepsSettings {
    /// Smallest standard deviation of each entry.
    type Memory = Vec<f64>;

    fn begin(&self, first: &Gaussian) -> Vec<f64> {
        first.std().iter().map(|s| s * MIN_STD).collect()
    }

    fn update(
        &self,
        min_std: &mut Vec<f64>,
        present: &Gaussian,
        draws: &[Vec<f64>],
        costs: &[f64],
    ) -> Option<Gaussian> {
        let usable: Vec<usize> = (0..costs.len()).filter(|&i| costs[i].is_finite()).collect();
        // The relative entropy of weights over n draws is at most ln n. Where the bound allows that,
        // all weight would go to the best draw, and one draw is no distribution.
        if usable.len() < 2 || (usable.len() as f64).ln() <= self.epsilon {
            return None;
        }
        let rewards: Vec<f64> = usable.iter().map(|&i| -costs[i]).collect();
        let samples: Vec<Vec<f64>> = usable.iter().map(|&i| draws[i].clone()).collect();
        let eta = temperature(self.epsilon, &rewards).max(self.min_eta);
        let max = rewards.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = rewards.iter().map(|j| ((j - max) / eta).exp()).collect();
        let (low, high) = present.bounds();
        Gaussian::fit(&samples, &weights, min_std, low, high).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Streams;

    /// Relative entropy of the draws that a temperature weights, to the draws with equal weights.
    fn relative_entropy(rewards: &[f64], eta: f64) -> f64 {
        let max = rewards.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let w: Vec<f64> = rewards.iter().map(|j| ((j - max) / eta).exp()).collect();
        let total: f64 = w.iter().sum();
        // sum p log(p n)
        let shares = w.iter().map(|w| w / total).filter(|p| *p > 0.0);
        shares.map(|p| p * (p * rewards.len() as f64).ln()).sum()
    }

    #[test]
    fn the_temperature_bounds_the_relative_entropy() {
        let rewards: Vec<f64> = (0..200).map(|i| -0.01 * f64::from(i * i)).collect();
        let kl = relative_entropy(&rewards, temperature(0.5, &rewards));
        assert!((kl - 0.5).abs() < 1e-3, "{kl}");
    }

    /// Symptom: after one draw that flew off, with a cost of 10^12, a refit followed no other
    /// difference. Cause: temperatures below a millionth of the spread were not searched.
    #[test]
    fn one_terrible_draw_does_not_blind_the_others() {
        for max in [0.0, 1e9] {
            let mut rewards: Vec<f64> = (0..200).map(|i| max - 0.01 * f64::from(i * i)).collect();
            rewards.push(max - 1e12);
            let kl = relative_entropy(&rewards, temperature(0.5, &rewards));
            assert!((kl - 0.5).abs() < 1e-3, "{kl}");
        }
    }

    #[test]
    fn the_dual_by_hand() {
        // Rewards 0 and -ln 3, eta 1: mean exp = (1 + 1/3)/2 = 2/3.
        let value = dual(1.0, 0.5, &[0.0, -(3.0_f64.ln())]);
        assert!((value - (0.5 + (2.0_f64 / 3.0).ln())).abs() < 1e-12);
    }

    #[test]
    fn it_settles_on_the_peak_of_a_likelihood() {
        let settings = RepsSettings {
            epsilon: 0.5,
            min_eta: 1.0,
        };
        let mut reps = Reps::new(settings, &[0.0], &[2.0], &[-5.0], &[5.0]);
        let mut rng = Streams::new(0).stream("reps");
        for _ in 0..15 {
            let candidates = reps.ask(400, &mut rng);
            let costs: Vec<f64> = candidates
                .iter()
                .map(|c| 0.5 * ((c[0] - 0.5) / 0.1).powi(2))
                .collect();
            reps.tell(&candidates, &costs);
        }
        assert!((reps.distribution().mean()[0] - 0.5).abs() < 0.02);
        assert!(reps.distribution().std()[0] < 0.1);
    }
}
