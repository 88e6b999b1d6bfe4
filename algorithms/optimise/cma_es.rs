//! Covariance matrix adaptation (Hansen, The CMA Evolution Strategy: A Tutorial, arXiv:1604.00772).
//!
//! It recombines the better half of the draws, applies rank-one and rank-mu updates to the
//! covariance, and sets the step size by the length of the mean's path (cumulative step-size
//! adaptation). Names and default constants are the tutorial's (table 1), with zero weights for the
//! worse half.
//!
//! The box is handled by the simplest method of the tutorial's section B.5: draws outside are drawn
//! again. The closer the mean is to an optimum on the edge, the slower it approaches it.

use asid_core::Result;
use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::search::ranked;
use super::{Gaussian, Search, UpdateRule, require};
use crate::fisher::symmetric_eigen;

/// How fast the covariance and the mean adapt.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CmaEsSettings {
    /// Factor on the rank-mu update's learning rate (`alpha_cov` in the tutorial); below 2 for
    /// noisy costs.
    pub alpha_cov: f64,
    /// Learning rate of the mean; below 1 for noisy costs.
    pub c_m: f64,
}

impl Default for CmaEsSettings {
    fn default() -> Self {
        Self {
            alpha_cov: 2.0,
            c_m: 1.0,
        }
    }
}

/// A search by covariance matrix adaptation. `4 + 3 ln n` draws per refit suffice for `n` entries.
pub type CmaEs = Search<CmaEsSettings>;

/// State that is kept from one refit to the next.
#[derive(Clone, Debug)]
pub struct Paths {
    /// Step size.
    sigma: f64,
    /// Covariance in units of the step size squared.
    covariance: DMatrix<f64>,
    /// Conjugate path; its length sets the step size.
    path_sigma: DVector<f64>,
    /// Evolution path; the rank-one update follows its direction.
    path_c: DVector<f64>,
    /// Number of refits so far.
    refits: i32,
}

/// Strategy parameters for `lambda` draws of `n` entries (table 1 of the tutorial).
struct Strategy {
    weights: Vec<f64>,
    mu_eff: f64,
    c_sigma: f64,
    d_sigma: f64,
    c_c: f64,
    c_1: f64,
    c_mu: f64,
    /// Expected length of a standard normal vector.
    chi: f64,
}

impl Strategy {
    fn new(n: usize, lambda: usize, alpha_cov: f64) -> Self {
        let n = n as f64;
        let raw: Vec<f64> = (1..=lambda / 2)
            .map(|i| (0.5 * (lambda as f64 + 1.0)).ln() - (i as f64).ln())
            .collect();
        let total: f64 = raw.iter().sum();
        let weights: Vec<f64> = raw.iter().map(|w| w / total).collect();
        let mu_eff = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
        let c_sigma = (mu_eff + 2.0) / (n + mu_eff + 5.0);
        let c_1 = alpha_cov / ((n + 1.3).powi(2) + mu_eff);
        Self {
            d_sigma: 1.0 + 2.0 * (((mu_eff - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma,
            c_c: (4.0 + mu_eff / n) / (n + 4.0 + 2.0 * mu_eff / n),
            c_mu: (alpha_cov * (0.25 + mu_eff + 1.0 / mu_eff - 2.0)
                / ((n + 2.0).powi(2) + alpha_cov * mu_eff / 2.0))
                .min(1.0 - c_1),
            chi: n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)),
            c_sigma,
            c_1,
            weights,
            mu_eff,
        }
    }
}

/// Fewest draws that did not fail: half of them must determine a mean and a spread.
const LEAST: usize = 4;

impl CmaEsSettings {
    /// Checks the settings; `key` is their place in a configuration.
    ///
    /// # Errors
    /// When a setting is out of its domain.
    pub fn check(&self, key: &str) -> Result<()> {
        let Self { alpha_cov, c_m } = *self;
        require(
            alpha_cov > 0.0 && alpha_cov <= 2.0,
            &format!("{key}.alpha_cov"),
            alpha_cov,
            "above 0 and at most 2",
        )?;
        require(
            c_m > 0.0 && c_m <= 1.0,
            &format!("{key}.c_m"),
            c_m,
            "above 0 and at most 1",
        )
    }
}

impl UpdateRule for CmaEsSettings {
    type Memory = Paths;

    fn begin(&self, first: &Gaussian) -> Paths {
        let n = first.mean().len();
        Paths {
            sigma: 1.0,
            covariance: first.covariance(),
            path_sigma: DVector::zeros(n),
            path_c: DVector::zeros(n),
            refits: 0,
        }
    }

    fn update(
        &self,
        paths: &mut Paths,
        present: &Gaussian,
        draws: &[Vec<f64>],
        costs: &[f64],
    ) -> Option<Gaussian> {
        let mut order = ranked(costs);
        order.retain(|&i| costs[i].is_finite());
        if order.len() < LEAST {
            return None;
        }
        let n = present.mean().len();
        let s = Strategy::new(n, order.len(), self.alpha_cov);
        let mean = DVector::from_column_slice(present.mean());
        let steps: Vec<DVector<f64>> = order
            .iter()
            .take(s.weights.len())
            .map(|&i| (DVector::from_column_slice(&draws[i]) - &mean) / paths.sigma)
            .collect();
        let mut y = DVector::zeros(n);
        for (w, step) in s.weights.iter().zip(&steps) {
            y += step * *w;
        }
        paths.refits = paths.refits.saturating_add(1);

        let root = inverse_root(&paths.covariance)?;
        paths.path_sigma = &paths.path_sigma * (1.0 - s.c_sigma)
            + root * &y * (s.c_sigma * (2.0 - s.c_sigma) * s.mu_eff).sqrt();
        let length = paths.path_sigma.norm();
        let settled = (1.0 - (1.0 - s.c_sigma).powi(paths.refits.saturating_mul(2))).sqrt();
        // A path that is still long means that the step size is too small; the rank-one update then
        // waits.
        let on = f64::from(u8::from(
            length / settled < (1.4 + 2.0 / (n as f64 + 1.0)) * s.chi,
        ));
        paths.path_c =
            &paths.path_c * (1.0 - s.c_c) + &y * (on * (s.c_c * (2.0 - s.c_c) * s.mu_eff).sqrt());
        let lost = (1.0 - on) * s.c_c * (2.0 - s.c_c);
        let mut covariance = &paths.covariance * (1.0 + s.c_1 * lost - s.c_1 - s.c_mu)
            + &paths.path_c * paths.path_c.transpose() * s.c_1;
        for (w, step) in s.weights.iter().zip(&steps) {
            covariance += step * step.transpose() * (s.c_mu * w);
        }

        let next_mean = mean + &y * (self.c_m * paths.sigma);
        let (low, high) = present.bounds();
        // Where the costs of all draws are alike, the step size does a random walk. Beyond the
        // box's width nearly every draw falls outside, so more width has no effect.
        let widest = (0..n)
            .map(|i| (high[i] - low[i]) / covariance[(i, i)].sqrt())
            .fold(f64::INFINITY, f64::min);
        let growth = (s.c_sigma / s.d_sigma * (length / s.chi - 1.0)).exp();
        let sigma = (paths.sigma * growth).min(widest);
        let next = Gaussian::new(next_mean, &covariance * (sigma * sigma), low, high).ok()?;
        (paths.sigma, paths.covariance) = (sigma, covariance);
        Some(next)
    }
}

/// `C^-1/2`; eigenvalues lost to rounding are raised to the smallest that a double resolves.
fn inverse_root(covariance: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let mut eigen = symmetric_eigen(covariance.clone())?;
    let least = (eigen.eigenvalues.amax() * f64::EPSILON).max(f64::MIN_POSITIVE);
    eigen
        .eigenvalues
        .apply(|v| *v = v.max(least).sqrt().recip());
    Some(eigen.recompose())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimise::search::known::{ellipsoid, rosenbrock, searched};

    const N: usize = 5;

    /// Cost of the best draw with the default population `4 + floor(3 ln 5)`.
    fn best(refits: usize, cost: impl Fn(&[f64]) -> f64) -> f64 {
        let search = CmaEs::new(
            CmaEsSettings::default(),
            &[0.0; N],
            &[1.0; N],
            &[-5.0; N],
            &[5.0; N],
        );
        searched(search, (refits, 8), cost).best().unwrap().1
    }

    #[test]
    fn it_converges_on_a_sphere() {
        // Log-linear convergence: some 5 + n / 2 refits per decade of the cost (tutorial, section
        // B.2).
        let found = best(150, |x| ellipsoid(1.0, &[0.7, -1.2, 2.0, 0.1, -0.4], x));
        assert!(found < 1e-10, "{found}");
    }

    #[test]
    fn it_learns_the_axes_of_an_ellipsoid() {
        // Condition number 1e6: with independent entries of equal size it would need a million
        // draws.
        let found = best(500, |x| ellipsoid(1e6, &[0.7, -1.2, 2.0, 0.1, -0.4], x));
        assert!(found < 1e-8, "{found}");
    }

    #[test]
    fn it_follows_the_bent_valley() {
        let found = best(800, rosenbrock);
        assert!(found < 1e-8, "{found}");
    }

    #[test]
    fn strategy_parameters_are_the_tutorials() {
        // n = 10, lambda = 10: mu_eff 3.167, as Hansen's purecma prints; c_1 = 2 / (11.3^2 +
        // mu_eff).
        let s = Strategy::new(10, 10, 2.0);
        assert!((s.mu_eff - 3.167).abs() < 1e-2, "{}", s.mu_eff);
        assert!((s.c_1 - 2.0 / (11.3_f64.powi(2) + s.mu_eff)).abs() < 1e-12);
        assert!((s.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((s.chi - 3.0847).abs() < 1e-3);
    }
}
