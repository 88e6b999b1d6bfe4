//! Intervals that are at least as wide as the disagreement of the episodes.
//!
//! An effect that a model lacks often pulls a value up in one episode and down in another.
//! Residuals within an episode are then correlated. Least squares treats them as independent
//! readings and is overconfident. The parts of a sum that are independent between episodes tell its
//! variance without further assumptions (K.-Y. Liang, S. L. Zeger, Biometrika 73, 1986, with
//! episodes as clusters).

use asid_core::error::Result;
use asid_core::{Layout, Parameter};
use nalgebra::{DMatrix, DVector};

use crate::dataset::{Dataset, Replayer};
use crate::marginal::{marginal, values};

/// Half width of the differences for slopes, in posterior standard deviations of the fit.
///
/// The slopes then cover the region of the posterior.
const STEP: f64 = 1.0;
/// Smallest half width, in prior standard deviations: double precision resolves such a change.
const LEAST_STEP: f64 = 1e-4;
/// Largest half width, in prior standard deviations: beyond it a replay is not linear.
const MOST_STEP: f64 = 0.3;

/// An episode's contribution to the normal equations.
pub(crate) struct Part {
    /// Products of the slopes, `J^T J`.
    normal: DMatrix<f64>,
    /// Products of slopes and residuals, `J^T r`.
    gradient: DVector<f64>,
}

/// The contributions of all episodes at a point, in prior standard deviations.
///
/// Empty where a replay beside the point diverges.
pub(crate) fn parts(
    replayer: &mut Replayer,
    layout: &Layout,
    data: &Dataset,
    (parameters, point): (&[Parameter], &[f64]),
    information: &DMatrix<f64>,
) -> Result<Vec<Part>> {
    let covariance = covariance(information);
    let theta = values(parameters, point);
    let steps: Vec<f64> = (0..point.len())
        .map(|k| (STEP * covariance[(k, k)].sqrt()).clamp(LEAST_STEP, MOST_STEP))
        .collect();
    let mut parts = Vec::with_capacity(data.trials.len());
    for trial in &data.trials {
        let marginal = marginal(replayer, layout, data, trial, &theta)?;
        let mut beside = vec![theta.clone()];
        let bound = Parameter::scaled_bound();
        let mut widths = Vec::with_capacity(steps.len());
        for (k, step) in steps.iter().enumerate() {
            // At an end of a range the difference is one-sided.
            let ends = [1.0, -1.0].map(|sign| (point[k] + sign * step).clamp(-bound, bound));
            for end in ends {
                let mut z = point.to_vec();
                z[k] = end;
                beside.push(values(parameters, &z));
            }
            widths.push(ends[0] - ends[1]);
        }
        let points: Vec<_> = beside.iter().map(|t| (&t[..], &marginal.start)).collect();
        let rows = replayer.residuals(data, trial, &points)?;
        let Some(rows) = rows.into_iter().collect::<Option<Vec<_>>>() else {
            return Ok(Vec::new());
        };
        let rows: Vec<DVector<f64>> = rows
            .iter()
            .map(|r| DVector::from_vec(marginal.apply(r)))
            .collect();
        let slopes: Vec<DVector<f64>> = widths
            .iter()
            .enumerate()
            .map(|(k, width)| (&rows[2 * k + 1] - &rows[2 * k + 2]) / *width)
            .collect();
        let slopes = DMatrix::from_columns(&slopes);
        parts.push(Part {
            normal: slopes.transpose() * &slopes,
            gradient: slopes.transpose() * &rows[0],
        });
    }
    Ok(parts)
}

/// Covariance of the fit with the prior, a unit normal.
fn covariance(information: &DMatrix<f64>) -> DMatrix<f64> {
    let n = information.nrows();
    let with_prior = information + DMatrix::identity(n, n);
    with_prior
        .cholesky()
        .map_or_else(|| DMatrix::identity(n, n), |c| c.inverse())
}

/// The 97.5 % quantiles of Student's distribution with one to ten degrees of freedom.
const FEW: [f64; 10] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228,
];

/// The 97.5 % quantile of Student's distribution with some degrees of freedom.
///
/// From the eleventh on by the first terms of its expansion about the normal one (Cornish and
/// Fisher), right to a thousandth.
fn student_975(degrees: usize) -> f64 {
    let z = 1.959_964_f64;
    let n = degrees as f64;
    let more = (z.powi(3) + z) / (4.0 * n)
        + (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * n * n);
    match degrees.checked_sub(1) {
        Some(place) if place < FEW.len() => FEW[place],
        _ => z + more,
    }
}

/// Information whose standard deviations are at least the disagreement of the episodes.
///
/// Correlations stay; standard deviations grow.
pub(crate) fn widened(information: &DMatrix<f64>, parts: &[Part]) -> DMatrix<f64> {
    let (n, count) = (information.nrows(), parts.len() as f64);
    if parts.len() < 2 {
        return information.clone();
    }
    let normal = parts.iter().map(|p| &p.normal).sum::<DMatrix<f64>>();
    let inverse = covariance(&normal);
    let pulls: Vec<DVector<f64>> = parts.iter().map(|p| &inverse * &p.gradient).collect();
    let covariance = covariance(information);
    let factor = |k: usize| {
        let mean = pulls.iter().map(|p| p[k]).sum::<f64>() / count;
        let squares: f64 = pulls.iter().map(|p| (p[k] - mean).powi(2)).sum();
        // The variance of a few episodes is known badly: Student's quantile in place of the normal one.
        let wider = student_975(parts.len() - 1) / student_975(usize::MAX);
        let disagree = wider * wider * count * squares / (count - 1.0);
        (covariance[(k, k)] / disagree.max(covariance[(k, k)])).sqrt()
    };
    let factors = DMatrix::from_diagonal(&DVector::from_fn(n, |k, _| factor(k)));
    &factors * information * &factors
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Episodes that each read one value ten times with unit noise, offset by `off` from the fit.
    fn read(off: &[f64]) -> (DMatrix<f64>, Vec<Part>) {
        let part = |x: &f64| Part {
            normal: DMatrix::from_element(1, 1, 10.0),
            gradient: DVector::from_element(1, 10.0 * x),
        };
        let information = DMatrix::from_element(1, 1, 10.0 * off.len() as f64);
        (information, off.iter().map(part).collect())
    }

    #[test]
    fn a_mean_is_as_uncertain_as_its_episodes_are_apart() {
        let off = [0.9, -1.1, 0.4, -0.2];
        let (information, parts) = read(&off);
        let wide = widened(&information, &parts);
        // The standard error of a mean of four, by Student's quantile; the prior has no weight.
        let variance = (3.182_f64 / 1.96).powi(2) * off.iter().map(|x| x * x).sum::<f64>() / 12.0;
        assert!((wide[(0, 0)] * variance - 1.0).abs() < 0.05, "{wide}");
    }

    #[test]
    fn episodes_that_agree_leave_it_as_it_is() {
        let (information, parts) = read(&[0.1, -0.1, 0.05]);
        assert_eq!(widened(&information, &parts), information);
        let (information, parts) = read(&[3.0]);
        assert_eq!(widened(&information, &parts), information, "one episode");
    }

    #[test]
    fn a_value_that_no_reading_sees_stays_unseen() {
        let mut information = DMatrix::zeros(2, 2);
        information[(0, 0)] = 40.0;
        let part = |x: f64| Part {
            normal: DMatrix::from_diagonal(&DVector::from_vec(vec![10.0, 0.0])),
            gradient: DVector::from_vec(vec![10.0 * x, 0.0]),
        };
        let wide = widened(&information, &[1.0, -1.0, 1.0, -1.0].map(part));
        assert!(wide[(0, 0)] < 10.0 && wide[(1, 1)] == 0.0);
    }
}
