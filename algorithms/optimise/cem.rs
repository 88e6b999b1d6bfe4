//! The cross-entropy method (Rubinstein 1999): refit a normal distribution to
//! the best of its own draws.

use asid_core::Result;
use asid_core::rng::Rng;
use serde::{Deserialize, Serialize};

use super::{Gaussian, require};

/// How the distribution follows its elite.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CemSettings {
    /// Share of the draws that are refitted to.
    pub elite_fraction: f64,
    /// Weight of the old distribution in the new one.
    pub smoothing: f64,
    /// Deviations never fall below this fraction of their first value.
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

impl CemSettings {
    /// Checks the settings; `key` is where they stand in a configuration.
    ///
    /// # Errors
    /// When one is out of its domain.
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

/// A search by the cross-entropy method with independent entries.
#[derive(Clone, Debug)]
pub struct Cem {
    settings: CemSettings,
    mean: Vec<f64>,
    std: Vec<f64>,
    min_std: Vec<f64>,
    low: Vec<f64>,
    high: Vec<f64>,
    best: Option<(Vec<f64>, f64)>,
}

impl Cem {
    /// Starts from `mean` and `std`, inside the box `[low, high]`.
    #[must_use]
    pub fn new(
        settings: CemSettings,
        mean: &[f64],
        std: &[f64],
        low: &[f64],
        high: &[f64],
    ) -> Self {
        Self {
            min_std: std.iter().map(|s| s * settings.min_std_fraction).collect(),
            settings,
            mean: mean.to_vec(),
            std: std.to_vec(),
            low: low.to_vec(),
            high: high.to_vec(),
            best: None,
        }
    }

    /// The present distribution.
    #[must_use]
    pub fn distribution(&self) -> Gaussian {
        Gaussian::diagonal(&self.mean, &self.std, &self.low, &self.high)
    }

    /// Draws `n` candidates.
    pub fn ask(&self, n: usize, rng: &mut Rng) -> Vec<Vec<f64>> {
        let distribution = self.distribution();
        (0..n).map(|_| distribution.sample(rng)).collect()
    }

    /// Refits to the best candidates; costs that are not finite rank last.
    pub fn tell(&mut self, candidates: &[Vec<f64>], costs: &[f64]) {
        let mut order: Vec<usize> = (0..costs.len()).collect();
        let rank = |c: f64| if c.is_nan() { f64::INFINITY } else { c };
        order.sort_by(|&i, &j| rank(costs[i]).total_cmp(&rank(costs[j])));
        let count = ((costs.len() as f64 * self.settings.elite_fraction).round() as usize)
            .clamp(2.min(costs.len()), costs.len());
        let elite = &order[..count];
        if let Some(&first) = elite.first()
            && costs[first].is_finite()
            && self.best.as_ref().is_none_or(|(_, c)| costs[first] < *c)
        {
            self.best = Some((candidates[first].clone(), costs[first]));
        }
        let keep = self.settings.smoothing;
        for i in 0..self.mean.len() {
            let mean = elite.iter().map(|&k| candidates[k][i]).sum::<f64>() / count as f64;
            let variance = elite
                .iter()
                .map(|&k| (candidates[k][i] - mean).powi(2))
                .sum::<f64>()
                / count as f64;
            self.mean[i] = keep * self.mean[i] + (1.0 - keep) * mean;
            self.std[i] =
                (keep * self.std[i] + (1.0 - keep) * variance.sqrt()).max(self.min_std[i]);
        }
    }

    /// Mean of the distribution.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Deviations of the distribution.
    #[must_use]
    pub fn std(&self) -> &[f64] {
        &self.std
    }

    /// Best candidate so far and its cost.
    #[must_use]
    pub fn best(&self) -> Option<(&[f64], f64)> {
        self.best.as_ref().map(|(x, c)| (&**x, *c))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Streams;

    #[test]
    fn it_finds_the_bottom_of_a_bowl() {
        let settings = CemSettings {
            elite_fraction: 0.2,
            ..CemSettings::default()
        };
        let mut cem = Cem::new(settings, &[0.0; 3], &[1.0; 3], &[-3.0; 3], &[3.0; 3]);
        let mut rng = Streams::new(0).stream("cem");
        let target = [0.7, -1.2, 2.0];
        for _ in 0..30 {
            let candidates = cem.ask(100, &mut rng);
            let costs: Vec<f64> = candidates
                .iter()
                .map(|c| c.iter().zip(target).map(|(x, t)| (x - t).powi(2)).sum())
                .collect();
            cem.tell(&candidates, &costs);
        }
        for (x, t) in cem.mean().iter().zip(target) {
            assert!((x - t).abs() < 0.01, "{x} {t}");
        }
    }

    #[test]
    fn candidates_without_a_cost_rank_last() {
        let mut cem = Cem::new(
            CemSettings {
                smoothing: 0.0,
                ..CemSettings::default()
            },
            &[0.0],
            &[1.0],
            &[-3.0],
            &[3.0],
        );
        cem.tell(
            &[vec![1.0], vec![2.0], vec![-2.0]],
            &[f64::NAN, 0.5, f64::INFINITY],
        );
        assert_eq!(cem.best(), Some((&[2.0][..], 0.5)));
    }
}
