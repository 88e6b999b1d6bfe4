//! Weights of readings under noise and roughness: the inverse of a residual's covariance.
//!
//! Whitened readings have noise 1. Roughness adds the regression residuals `E` (points x readings):
//! its variance at each reading, or also its covariance along the episode. A contact that comes a
//! step early shifts all later readings together. Quantities that do not shift with them, such as
//! the relative pose of two parts, keep their weight only if the correlation is known.
//!
//! The sample covariance spans no more directions than it has points. A share of the roughness is
//! therefore treated as independent at each reading (shrinkage, Ledoit and Wolf 2004):
//!
//! `S = 1 + a diag(s^2) + (1 - a) E^T E / freedom`, inverted by Woodbury's identity.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::fisher::symmetric_eigen;

/// Share of the roughness that is treated as independent from reading to reading; see the module.
const ALONE: f64 = 0.2;

/// `S^-1`.
pub struct Precision {
    /// `1 / (1 + a s^2)` of each reading.
    alone: DVector<f64>,
    /// `G N^-1` and the factor of `1 + G N^-1 G^T`, `G = E sqrt((1 - a) / freedom)`.
    together: Option<(DMatrix<f64>, Cholesky<f64, Dyn>)>,
}

impl Precision {
    /// Weights for roughness with these variances, independent from reading to reading.
    #[must_use]
    pub fn diagonal(spread: &DVector<f64>) -> Self {
        Self {
            alone: spread.map(|s| 1.0 / (1.0 + s)),
            together: None,
        }
    }

    /// Weights for the roughness given by the rows of `epsilon` (points x readings), with `freedom`
    /// degrees of freedom.
    #[must_use]
    pub fn correlated(epsilon: &DMatrix<f64>, freedom: f64) -> Self {
        let m = epsilon.ncols();
        let spread = |k: usize| epsilon.column(k).norm_squared() / freedom;
        let alone = DVector::from_fn(m, |k, _| 1.0 / (1.0 + ALONE * spread(k)));
        let mut rows = epsilon * ((1.0 - ALONE) / freedom).sqrt();
        let plain = rows.clone();
        scale_columns(&mut rows, &alone);
        let core = &rows * plain.transpose() + DMatrix::identity(epsilon.nrows(), epsilon.nrows());
        Self {
            alone,
            together: core.cholesky().map(|factor| (rows, factor)),
        }
    }

    /// `X S^-1` for `X` of any rows x readings.
    #[must_use]
    pub fn weigh(&self, x: &DMatrix<f64>) -> DMatrix<f64> {
        let mut out = x.clone();
        scale_columns(&mut out, &self.alone);
        if let Some((rows, factor)) = &self.together {
            // X N^-1 - X N^-1 G^T (1 + G N^-1 G^T)^-1 G N^-1
            let inner = rows * x.transpose();
            out -= factor.solve(&inner).transpose() * rows;
        }
        out
    }
}

/// Variance of an estimate over the one that the weights imply, along every direction at once.
///
/// `b` are the slopes (readings x entries) and the rows of `epsilon` the roughness. The weights
/// give the curvature `H = b^T P b`, and the sandwich formula gives the covariance `H^-1 M H^-1`,
/// with `M = b^T P (1 + R) P b`. Returned is `L^-1 M L^-T`, where `L L^T = H`: the covariance of
/// `L^T x`, in which the implied one is the identity. `lower` is `L`, of [`implied`].
#[must_use]
pub fn inflation(
    precision: &Precision,
    b: &DMatrix<f64>,
    epsilon: &DMatrix<f64>,
    freedom: f64,
    lower: &DMatrix<f64>,
) -> Option<DMatrix<f64>> {
    let weighed = lower.solve_lower_triangular(&precision.weigh(&b.transpose()))?;
    let projected = &weighed * epsilon.transpose();
    Some(&weighed * weighed.transpose() + &projected * projected.transpose() / freedom)
}

/// Lower factor `L` of the curvature `H = L L^T` that weights imply at slopes `b` (readings x
/// entries).
#[must_use]
pub fn implied(precision: &Precision, b: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = b.ncols();
    let h = precision.weigh(&b.transpose()) * b;
    // In standardised coordinates: a direction that the data do not see keeps the region's width.
    // The share of the trace is above the rounding of the sums.
    let ridge = 1e-9 + 1e-12 * h.trace();
    Some((h + DMatrix::identity(n, n) * ridge).cholesky()?.l())
}

/// Transformation `N` that gives a loss with curvature `H` the width of the sandwich formula.
///
/// The loss at `best + N (u - best)` has the covariance `N^-1 H^-1 N^-T = H^-1 M H^-1` at `best`
/// (curvature adjustment: Ribatet, Cooley and Davison 2012). Each direction is widened by what
/// *its* readings scatter, so that an unknown that smooth readings determine keeps its narrow
/// interval beside one that rough readings determine. No direction becomes narrower than the
/// weights imply.
///
/// `lower` is the factor of `H`, of [`implied`], and `inflation` the matrix of [`inflation`].
/// Returned with it is the largest inflation of a direction, at least 1.
#[must_use]
pub fn narrowing(lower: &DMatrix<f64>, inflation: &DMatrix<f64>) -> Option<(DMatrix<f64>, f64)> {
    let eigen = symmetric_eigen((inflation + inflation.transpose()) * 0.5)?;
    let axes = eigen.eigenvectors;
    let upper = lower.transpose();
    let mut narrowed = upper.solve_upper_triangular(&axes)?;
    for (mut column, v) in narrowed.column_iter_mut().zip(&eigen.eigenvalues) {
        column /= v.max(1.0).sqrt();
    }
    let most = eigen.eigenvalues.iter().copied().fold(1.0, f64::max);
    Some((narrowed * axes.transpose() * upper, most))
}

fn scale_columns(x: &mut DMatrix<f64>, by: &DVector<f64>) {
    for (mut column, &factor) in x.column_iter_mut().zip(by) {
        column *= factor;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_inverse_of_the_covariance() {
        let epsilon = DMatrix::from_fn(3, 5, |i, k| ((3 * i + 2 * k) as f64).sin());
        let precision = Precision::correlated(&epsilon, 2.0);
        let mut covariance = epsilon.transpose() * &epsilon * ((1.0 - ALONE) / 2.0);
        for k in 0..5 {
            covariance[(k, k)] += 1.0 + ALONE * epsilon.column(k).norm_squared() / 2.0;
        }
        let identity = precision.weigh(&covariance);
        assert!((identity - DMatrix::identity(5, 5)).norm() < 1e-12);
        let spread = DVector::from_vec(vec![0.0, 3.0]);
        let weighed = Precision::diagonal(&spread).weigh(&DMatrix::from_element(1, 2, 1.0));
        assert_eq!(weighed.as_slice(), [1.0, 0.25]);
    }

    #[test]
    fn the_narrowed_loss_has_the_covariance_of_the_sandwich() {
        // Two entries, one shared shift of the last three readings, all inflations above 1.
        let b = DMatrix::from_row_slice(4, 2, &[1.0, 0.2, 0.5, 0.0, 0.0, 1.0, 0.3, 2.0]);
        let epsilon = DMatrix::from_row_slice(2, 4, &[2.0, 0.0, 0.0, 0.0, 0.0, 3.0, 3.0, 3.0]);
        let precision = Precision::diagonal(&DVector::from_vec(vec![0.5, 1.0, 1.0, 1.0]));
        let lower = implied(&precision, &b).unwrap();
        let inflated = inflation(&precision, &b, &epsilon, 1.0, &lower).unwrap();
        let (back, _) = narrowing(&lower, &inflated).unwrap();
        let p = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0 / 1.5, 0.5, 0.5, 0.5]));
        let h = b.transpose() * &p * &b;
        let covariance = DMatrix::identity(4, 4) + epsilon.transpose() * &epsilon;
        let m = b.transpose() * &p * covariance * &p * &b;
        let bread = h.clone().try_inverse().unwrap();
        let sandwich = &bread * m * &bread;
        let adjusted = (back.transpose() * h * back).try_inverse().unwrap();
        assert!(
            (&adjusted - &sandwich).norm() < 1e-6 * sandwich.norm(),
            "{adjusted} {sandwich}"
        );
    }

    /// The readings show only the sum of two entries, to a thousandth of the region's width. Along
    /// the difference the loss keeps its shape; along the sum it is widened.
    #[test]
    fn a_direction_that_no_reading_sees_stays_as_it_is() {
        let m = 1000;
        let b = DMatrix::from_fn(m, 2, |k, _| 50.0 * (0.01 * k as f64).sin());
        // Every simulation is off by a multiple of what the sum does.
        let epsilon = DMatrix::from_fn(8, m, |i, k| [1.0, -1.0][i % 2] * b[(k, 0)]);
        let precision = Precision::diagonal(&DVector::repeat(m, 0.0));
        let lower = implied(&precision, &b).unwrap();
        let inflated = inflation(&precision, &b, &epsilon, 8.0, &lower).unwrap();
        let (back, _) = narrowing(&lower, &inflated).unwrap();
        let apart = DVector::from_vec(vec![1.0, -1.0]);
        assert!((&back * &apart - &apart).norm() < 1e-3, "{back}");
        // M / H = 1 + |b|^2 along the sum.
        let ratio = 1.0 + b.column(0).norm_squared();
        let sum = (&back * DVector::from_vec(vec![0.5, 0.5])).sum();
        assert!((sum * ratio.sqrt() - 1.0).abs() < 1e-3, "{sum} {ratio}");
    }
}
