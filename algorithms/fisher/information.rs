//! Fisher information of an episode, and the exploration objectives built on it.
//!
//! With Gaussian noise of the readings an episode carries the information `I = sum_h J_h^T S^-1
//! J_h` about `theta` (ASID, Memmel et al. 2024, eq. 5), where `J_h` is the derivative of reading
//! `h`. Here `J_h` is whitened (divided by the noise) and in prior-scaled parameters. `I` is then a
//! sum of outer products, and the prior's information `I_0` is the identity.
//!
//! Parameters come first. *Nuisance* entries (the start pose) may follow: they are estimated
//! jointly but are not sought, so objectives use the parameters' block of the inverse.

use std::str::FromStr;

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use asid_core::error::{Error, Result};

/// What a control step is rewarded for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Objective {
    /// `tr(J_h^T S^-1 J_h)`, clipped, as in the paper's published code.
    Trace,
    /// Decrease of `tr((I + I_0)^-1)`: the paper's objective; its sum over an
    /// episode telescopes to `tr I_0^-1 - tr (I + I_0)^-1`.
    #[default]
    AOptimal,
    /// Increase of `log det(I + I_0)`, which does not saturate.
    DOptimal,
}

/// Largest trace reward of one control step, as in the paper's published code.
pub const TRACE_CLIP: f64 = 1000.0;

impl Objective {
    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Trace => "trace",
            Self::AOptimal => "a-optimal",
            Self::DOptimal => "d-optimal",
        }
    }

    /// Unit of its rewards, for unknowns in prior standard deviations.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Trace => "per prior variance",
            Self::AOptimal => "prior variance",
            Self::DOptimal => "log of information",
        }
    }
}

impl FromStr for Objective {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        [Self::Trace, Self::AOptimal, Self::DOptimal]
            .into_iter()
            .find(|o| o.name() == text)
            .ok_or_else(|| Error::unknown("objective", text, ["trace", "a-optimal", "d-optimal"]))
    }
}

/// Information gathered so far about `d` parameters and some nuisance entries.
#[derive(Clone, Debug)]
pub struct Information {
    parameters: usize,
    /// `I + I_0` over parameters and nuisance, prior-scaled.
    total: DMatrix<f64>,
    /// `tr I` of the parameters' block, without the prior.
    trace: f64,
    value: (f64, f64),
}

impl Information {
    /// The prior's information about `parameters` and `nuisance` further entries: the identity.
    #[must_use]
    pub fn prior(parameters: usize, nuisance: usize) -> Self {
        let n = parameters + nuisance;
        let mut information = Self {
            parameters,
            total: DMatrix::identity(n, n),
            trace: 0.0,
            value: (0.0, 0.0),
        };
        information.value = information.measure();
        information
    }

    /// Resets to the prior.
    pub fn reset(&mut self) {
        self.total.fill_with_identity();
        self.trace = 0.0;
        self.value = self.measure();
    }

    /// Adds `J^T J` of one reading.
    ///
    /// `jacobian` holds one whitened, prior-scaled column of `rows` values per entry, one after the
    /// other. Missing readings (NaN) and slopes whose square is not finite contribute nothing.
    pub fn add(&mut self, jacobian: &[f64], rows: usize) {
        let n = self.total.nrows();
        for k in 0..rows {
            let square: f64 = (0..n).map(|i| jacobian[i * rows + k].powi(2)).sum();
            if !(self.total.trace() + square).is_finite() {
                continue;
            }
            for i in 0..n {
                let a = jacobian[i * rows + k];
                for j in 0..n {
                    self.total[(i, j)] += a * jacobian[j * rows + k];
                }
                if i < self.parameters {
                    self.trace += a * a;
                }
            }
        }
    }

    /// Reward for the information that was added since the last call or reset.
    pub fn reward(&mut self, objective: Objective, trace_before: f64) -> f64 {
        let before = self.value;
        self.value = self.measure();
        match objective {
            Objective::Trace => (self.trace - trace_before).min(TRACE_CLIP),
            Objective::AOptimal => before.0 - self.value.0,
            Objective::DOptimal => self.value.1 - before.1,
        }
    }

    /// `tr I` of the parameters, without the prior.
    #[must_use]
    pub fn trace(&self) -> f64 {
        self.trace
    }

    /// `tr` of the parameters' block of `(I + I_0)^-1`, prior-scaled: 1 per parameter before any
    /// data.
    #[must_use]
    pub fn a_optimality(&self) -> f64 {
        self.measure().0
    }

    /// `log det` of the information about the parameters, with the nuisance entries projected out.
    #[must_use]
    pub fn log_det(&self) -> f64 {
        self.measure().1
    }

    /// Expected posterior standard deviation of each parameter, prior-scaled.
    #[must_use]
    pub fn expected_std(&self) -> Vec<f64> {
        let covariance = self.covariance();
        (0..self.parameters)
            .map(|i| covariance[(i, i)].max(0.0).sqrt())
            .collect()
    }

    /// `(I + I_0)^-1`; see [`inverse_above_prior`].
    fn covariance(&self) -> DMatrix<f64> {
        inverse_above_prior(&self.total)
    }

    fn measure(&self) -> (f64, f64) {
        let d = self.parameters;
        if self.total.nrows() == 1 {
            return (1.0 / self.total[(0, 0)], self.total[(0, 0)].ln());
        }
        let covariance = self.covariance();
        let block = covariance.view((0, 0), (d, d)).into_owned();
        (block.trace(), -log_determinant(block))
    }
}

/// Inverse of a symmetric matrix that is the identity (the prior) plus the information of data, so
/// that no eigenvalue is below 1.
///
/// Where one direction is known far better than another, rounding loses the information about the
/// other. Eigenvalues below the resolution of the largest one are then noise of either sign, and a
/// Cholesky factor fails or contains that noise. Directions that are not resolved keep the prior's
/// uncertainty. A matrix with a non-finite entry gives no information at all.
#[must_use]
pub fn inverse_above_prior(total: &DMatrix<f64>) -> DMatrix<f64> {
    let n = total.nrows();
    if total.iter().any(|x| !x.is_finite()) {
        return DMatrix::identity(n, n);
    }
    if n == 0 {
        return total.clone();
    }
    let resolution = n as f64 * f64::EPSILON;
    if let Some(factor) = total.clone().cholesky() {
        let pivots = factor.l_dirty().diagonal().map(|p| p * p);
        // Safely resolved: at least half of the digits remain.
        if pivots.min() > resolution.sqrt() * pivots.max() {
            return factor.inverse();
        }
    }
    let symmetric = (total + total.transpose()) * 0.5;
    let mut eigen = symmetric.symmetric_eigen();
    let least = resolution * eigen.eigenvalues.amax();
    for value in eigen.eigenvalues.iter_mut() {
        *value = if *value > least {
            value.max(1.0).recip()
        } else {
            1.0
        };
    }
    eigen.recompose()
}

/// Log determinant of a covariance.
///
/// Where the determinant itself underflows or is not positive, it is the sum of the eigenvalues'
/// logarithms, each floored at the smallest positive number.
fn log_determinant(covariance: DMatrix<f64>) -> f64 {
    let determinant = covariance.determinant();
    if determinant.is_normal() && determinant > 0.0 {
        return determinant.ln();
    }
    let values = covariance.symmetric_eigenvalues();
    values.iter().map(|v| v.max(f64::MIN_POSITIVE).ln()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rewards_by_hand_for_one_parameter() {
        // Two readings with whitened derivatives 3 and 4: I = 25, prior 1.
        let mut information = Information::prior(1, 0);
        information.add(&[3.0, 4.0], 2);
        assert!((information.trace() - 25.0).abs() < 1e-12);
        assert!((information.a_optimality() - 1.0 / 26.0).abs() < 1e-12);
        assert!((information.log_det() - 26.0_f64.ln()).abs() < 1e-12);
        assert!((information.expected_std()[0] - 26.0_f64.sqrt().recip()).abs() < 1e-12);
        let mut again = Information::prior(1, 0);
        again.add(&[3.0, 4.0], 2);
        assert!((again.reward(Objective::AOptimal, 0.0) - 25.0 / 26.0).abs() < 1e-12);
        assert_eq!(again.reward(Objective::AOptimal, 25.0), 0.0);
    }

    #[test]
    fn rewards_by_hand_for_two_parameters() {
        // J = [[1, 2], [0, 1]] (rows are readings): I = [[1, 2], [2, 5]], I + 1 = [[2, 2], [2, 6]],
        // determinant 8, inverse [[6, -2], [-2, 2]] / 8.
        let mut information = Information::prior(2, 0);
        information.add(&[1.0, 0.0, 2.0, 1.0], 2);
        assert!((information.trace() - 6.0).abs() < 1e-12);
        assert!((information.a_optimality() - 1.0).abs() < 1e-12);
        assert!((information.log_det() - 8.0_f64.ln()).abs() < 1e-12);
        assert!((information.reward(Objective::DOptimal, 0.0) - 8.0_f64.ln()).abs() < 1e-12);
        assert_eq!(information.reward(Objective::Trace, 0.0), 6.0);
    }

    #[test]
    fn rewards_telescope_over_an_episode() {
        for objective in [Objective::AOptimal, Objective::DOptimal] {
            let mut information = Information::prior(2, 0);
            let (a0, l0) = (information.a_optimality(), information.log_det());
            let mut sum = 0.0;
            for h in 0..20 {
                let x = f64::from(h);
                let before = information.trace();
                information.add(&[x.sin(), 0.3 * x.cos(), 0.1 * x, 0.5], 2);
                sum += information.reward(objective, before);
            }
            let expected = match objective {
                Objective::AOptimal => a0 - information.a_optimality(),
                _ => information.log_det() - l0,
            };
            assert!((sum - expected).abs() < 1e-12, "{objective:?}");
        }
    }

    #[test]
    fn a_nuisance_that_looks_the_same_hides_the_parameter() {
        // Parameter and nuisance move the reading alike. Only their sum is seen, so half of the
        // prior variance stays however large the information.
        let mut information = Information::prior(1, 1);
        information.add(&[1e4, 1e4], 1);
        assert!((information.a_optimality() - 0.5).abs() < 1e-6);
    }

    #[test]
    fn the_trace_is_clipped_a_step() {
        let mut information = Information::prior(1, 0);
        information.add(&[100.0], 1);
        assert_eq!(information.reward(Objective::Trace, 0.0), TRACE_CLIP);
    }

    #[test]
    fn what_rounding_swallows_is_no_knowledge() {
        // Two entries seen only by their sum: the difference keeps the prior's variance, so each
        // has variance 1/2, however well the sum is known. From 1e8 on the rounded matrix is
        // singular.
        for slope in [1e3, 1e7, 1e8, 1e9, 1e12, 1e100, 1e150] {
            let mut information = Information::prior(2, 0);
            information.add(&[slope, slope], 1);
            for std in information.expected_std() {
                // Just below 1e8 the last digits of the variance are lost.
                assert!((std - 0.5_f64.sqrt()).abs() < 0.02, "{slope}: {std}");
            }
            assert!(information.log_det().is_finite() && information.log_det() > 0.0);
        }
        // Slopes whose square overflows are ignored.
        let mut information = Information::prior(2, 0);
        information.add(&[1e200, 1e200], 1);
        assert_eq!(information.expected_std(), [1.0, 1.0]);
    }

    #[test]
    fn scales_far_apart_are_both_known() {
        // Independent entries known to 1e-3 and 1e-6 of the prior.
        let mut information = Information::prior(2, 0);
        information.add(&[1e3, 0.0, 0.0, 1e6], 2);
        let std = information.expected_std();
        assert!((std[0] / 1e-3 - 1.0).abs() < 1e-3, "{std:?}");
        assert!((std[1] / 1e-6 - 1.0).abs() < 1e-3, "{std:?}");
    }

    #[test]
    fn a_matrix_without_numbers_leaves_the_prior() {
        let total = DMatrix::from_element(2, 2, f64::NAN);
        assert_eq!(inverse_above_prior(&total), DMatrix::identity(2, 2));
    }

    #[test]
    fn missing_readings_carry_nothing() {
        let mut information = Information::prior(1, 0);
        information.add(&[f64::NAN, 2.0], 2);
        assert!((information.trace() - 4.0).abs() < 1e-12);
    }
}
