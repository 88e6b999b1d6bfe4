//! A search by draws from a normal distribution, independent of its update rule.

use asid_core::rng::Rng;

use super::Gaussian;

/// How a search distribution follows the costs of its draws; the algorithms differ in nothing else.
pub trait UpdateRule: Clone {
    /// State that the rule keeps from one refit to the next.
    type Memory: Clone + std::fmt::Debug;

    /// The initial state, from the first distribution.
    fn begin(&self, first: &Gaussian) -> Self::Memory;

    /// The next distribution after draws from `present` with their costs; `None` where they are too
    /// few to refit.
    ///
    /// Lower costs are better; a cost that is not finite marks a failed draw.
    fn update(
        &self,
        memory: &mut Self::Memory,
        present: &Gaussian,
        draws: &[Vec<f64>],
        costs: &[f64],
    ) -> Option<Gaussian>;
}

/// A search inside a box, by an update rule.
#[derive(Clone, Debug)]
pub struct Search<R: UpdateRule> {
    rule: R,
    memory: R::Memory,
    distribution: Gaussian,
    best: Option<(Vec<f64>, f64)>,
}

impl<R: UpdateRule> Search<R> {
    /// Starts from `mean` and `std`, inside the box `[low, high]`.
    #[must_use]
    pub fn new(rule: R, mean: &[f64], std: &[f64], low: &[f64], high: &[f64]) -> Self {
        let distribution = Gaussian::diagonal(mean, std, low, high);
        Self {
            memory: rule.begin(&distribution),
            rule,
            distribution,
            best: None,
        }
    }

    /// The present distribution.
    #[must_use]
    pub fn distribution(&self) -> &Gaussian {
        &self.distribution
    }

    /// Draws `n` candidates.
    pub fn ask(&self, n: usize, rng: &mut Rng) -> Vec<Vec<f64>> {
        (0..n).map(|_| self.distribution.sample(rng)).collect()
    }

    /// Refits to candidates with their costs; a cost that is not finite marks a failure.
    pub fn tell(&mut self, candidates: &[Vec<f64>], costs: &[f64]) {
        for (candidate, &cost) in candidates.iter().zip(costs) {
            if cost.is_finite() && self.best.as_ref().is_none_or(|(_, c)| cost < *c) {
                self.best = Some((candidate.clone(), cost));
            }
        }
        let next = self
            .rule
            .update(&mut self.memory, &self.distribution, candidates, costs);
        if let Some(next) = next {
            self.distribution = next;
        }
    }

    /// Mean of the distribution.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        self.distribution.mean()
    }

    /// Standard deviations of the distribution.
    #[must_use]
    pub fn std(&self) -> Vec<f64> {
        self.distribution.std()
    }

    /// Best candidate so far and its cost.
    #[must_use]
    pub fn best(&self) -> Option<(&[f64], f64)> {
        self.best.as_ref().map(|(x, c)| (&**x, *c))
    }
}

/// A cost as it is ranked: NaN, of either sign, ranks last, with the failures.
pub(crate) fn rank(cost: f64) -> f64 {
    if cost.is_nan() { f64::INFINITY } else { cost }
}

/// Indices of the costs, best first; NaN ranks last, with the failures.
pub(super) fn ranked(costs: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..costs.len()).collect();
    order.sort_by(|&i, &j| rank(costs[i]).total_cmp(&rank(costs[j])));
    order
}

#[cfg(test)]
pub(super) mod known {
    //! Costs with a known minimum, and the search that all rules are tested with.

    use super::*;
    use asid_core::Streams;

    /// `sum (x_i - t_i)^2`, with factors from 1 to `condition` on the terms.
    pub fn ellipsoid(condition: f64, target: &[f64], x: &[f64]) -> f64 {
        let last = (x.len() - 1).max(1) as f64;
        let terms = x.iter().zip(target).enumerate();
        terms
            .map(|(i, (x, t))| condition.powf(i as f64 / last) * (x - t).powi(2))
            .sum()
    }

    /// Rosenbrock's valley, with its minimum of 0 at ones.
    pub fn rosenbrock(x: &[f64]) -> f64 {
        let pairs = x.windows(2);
        pairs
            .map(|p| 100.0 * (p[1] - p[0] * p[0]).powi(2) + (1.0 - p[0]).powi(2))
            .sum()
    }

    /// The search after some refits of `population` draws.
    pub fn searched<R: UpdateRule>(
        mut search: Search<R>,
        (refits, population): (usize, usize),
        cost: impl Fn(&[f64]) -> f64,
    ) -> Search<R> {
        let mut rng = Streams::new(0).stream("search");
        for _ in 0..refits {
            let candidates = search.ask(population, &mut rng);
            let costs: Vec<f64> = candidates.iter().map(|c| cost(c)).collect();
            search.tell(&candidates, &costs);
        }
        search
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimise::{CemSettings, CmaEsSettings, RepsSettings};

    const TARGET: [f64; 3] = [0.7, -1.2, 2.0];

    fn finds_the_bottom_of_a_bowl<R: UpdateRule>(rule: R) {
        let search = Search::new(rule, &[0.0; 3], &[1.0; 3], &[-3.0; 3], &[3.0; 3]);
        let bowl = |x: &[f64]| known::ellipsoid(1.0, &TARGET, x);
        let found = known::searched(search, (40, 100), bowl);
        for (x, t) in found.mean().iter().zip(TARGET) {
            assert!((x - t).abs() < 0.01, "{x} {t}");
        }
        assert!(found.best().unwrap().1 < 1e-3);
    }

    #[test]
    fn every_rule_finds_the_bottom_of_a_bowl() {
        finds_the_bottom_of_a_bowl(CemSettings::default());
        finds_the_bottom_of_a_bowl(RepsSettings::default());
        finds_the_bottom_of_a_bowl(CmaEsSettings::default());
    }

    #[test]
    fn every_rule_finds_a_bottom_at_the_edge_of_its_box() {
        fn edge<R: UpdateRule>(rule: R) {
            let search = Search::new(rule, &[0.0; 2], &[0.5; 2], &[-1.0; 2], &[1.0; 2]);
            // Without the box the minimum is at (2, 0.3), outside it.
            let bowl = |x: &[f64]| known::ellipsoid(1.0, &[2.0, 0.3], x);
            let found = known::searched(search, (60, 60), bowl);
            let mean = found.mean();
            assert!(
                (mean[0] - 1.0).abs() < 0.02 && (mean[1] - 0.3).abs() < 0.05,
                "{mean:?}"
            );
        }
        edge(CemSettings::default());
        edge(RepsSettings::default());
        edge(CmaEsSettings::default());
    }

    /// Symptom: CEM refits its distribution to failed draws where few succeed.
    #[test]
    fn an_elite_has_no_failed_draws() {
        let after = |costs: &[f64]| {
            let rule = CemSettings {
                elite_fraction: 0.5,
                smoothing: 0.0,
                ..CemSettings::default()
            };
            let mut search = Search::new(rule, &[0.0], &[1.0], &[-3.0], &[3.0]);
            search.tell(&[vec![1.0], vec![2.0], vec![-2.0], vec![3.0]], costs);
            search.mean()[0]
        };
        assert_eq!(after(&[f64::NAN, 0.5, f64::INFINITY, 0.6]), 2.5);
        // One draw is no distribution.
        assert_eq!(after(&[f64::NAN, 0.5, f64::INFINITY, f64::NAN]), 0.0);
    }

    #[test]
    fn failures_teach_nothing() {
        fn fails<R: UpdateRule>(rule: R) {
            let mut search = Search::new(rule, &[0.0], &[1.0], &[-3.0], &[3.0]);
            let draws = [vec![1.0], vec![2.0], vec![-2.0]];
            search.tell(&draws, &[f64::NAN, 0.5, f64::INFINITY]);
            assert_eq!(search.best(), Some((&[2.0][..], 0.5)));
            let before = (search.mean().to_vec(), search.std());
            for _ in 0..3 {
                search.tell(&draws, &[f64::NAN; 3]);
            }
            assert_eq!((search.mean().to_vec(), search.std()), before);
        }
        fails(CemSettings::default());
        fails(RepsSettings::default());
        fails(CmaEsSettings::default());
    }
}
