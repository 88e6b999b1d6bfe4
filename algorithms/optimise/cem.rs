//! The cross-entropy method (Rubinstein 1999): refits a normal distribution to the best of its own
//! draws.

use asid_core::Result;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::search::ranked;
use super::{Gaussian, Search, UpdateRule, require};

/// How the search distribution follows its elite.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CemSettings {
    /// Share of the draws that the distribution is refitted to.
    pub elite_fraction: f64,
    /// Weight of the old distribution in the new one.
    pub smoothing: f64,
    /// Smallest standard deviations, as a fraction of their initial values.
    pub min_std_fraction: f64,
}

impl Default for CemSettings {
    fn default() -> Self {
        Self {
            elite_fraction: 0.1,
            smoothing: 0.1,
            min_std_fraction: 1e-3,
        }
    }
}

/// A search by the cross-entropy method with independent entries.
pub type Cem = Search<CemSettings>;

impl CemSettings {
    /// Checks the settings; `key` is their place in a configuration.
    ///
    /// # Errors
    /// When a setting is out of its domain.
    pub fn check(&self, key: &str) -> Result<()> {
        let Self {
            elite_fraction: elite,
            smoothing,
            min_std_fraction: least,
        } = *self;
        let key = |name: &str| format!("{key}.{name}");
        require(
            elite > 0.0 && elite <= 1.0,
            &key("elite_fraction"),
            elite,
            "above 0 and at most 1",
        )?;
        require(
            (0.0..1.0).contains(&smoothing),
            &key("smoothing"),
            smoothing,
            "from 0 to below 1",
        )?;
        require(
            (0.0..=1.0).contains(&least),
            &key("min_std_fraction"),
            least,
            "from 0 to 1",
        )
    }
}

impl UpdateRule for CemSettings {
    /// Smallest standard deviation of each entry.
    type Memory = Vec<f64>;

    fn begin(&self, first: &Gaussian) -> Vec<f64> {
        let std = first.std();
        std.iter().map(|s| s * self.min_std_fraction).collect()
    }

    fn update(
        &self,
        min_std: &mut Vec<f64>,
        present: &Gaussian,
        draws: &[Vec<f64>],
        costs: &[f64],
    ) -> Option<Gaussian> {
        let mut order = ranked(costs);
        order.retain(|&draw| costs[draw].is_finite());
        if order.len() < 2 {
            return None;
        }
        let count = (costs.len() as f64 * self.elite_fraction).round() as usize;
        let count = count.clamp(2, order.len());
        let elite = &order[..count];
        let keep = self.smoothing;
        let (mut means, mut stds) = (present.mean().to_vec(), present.std());
        for i in 0..means.len() {
            let mean = elite.iter().map(|&k| draws[k][i]).sum::<f64>() / count as f64;
            let variance = elite
                .iter()
                .map(|&k| (draws[k][i] - mean).powi(2))
                .sum::<f64>()
                / count as f64;
            means[i] = keep * means[i] + (1.0 - keep) * mean;
            stds[i] = (keep * stds[i] + (1.0 - keep) * variance.sqrt()).max(min_std[i]);
        }
        Some(present.with_diagonal(&means, &stds))
    }
}
