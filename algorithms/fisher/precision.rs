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

use crate::fisher::roughness::Roughness;
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
/// `b` are the slopes (readings x entries), and `R` is the covariance of the roughness. The weights
/// give the curvature `H = b^T P b`, and the sandwich formula gives the covariance `H^-1 M H^-1`,
/// with `M = b^T P (1 + R) P b`. Returned is `L^-1 M L^-T`, where `L L^T = H`: the covariance of
/// `L^T x`, in which the implied one is the identity. `lower` is `L`, of [`implied`].
#[must_use]
pub fn inflation(
    precision: &Precision,
    b: &DMatrix<f64>,
    roughness: &Roughness,
    lower: &DMatrix<f64>,
) -> Option<DMatrix<f64>> {
    let weighed = lower.solve_lower_triangular(&precision.weigh(&b.transpose()))?;
    Some(&weighed * weighed.transpose() + roughness.covariance_of(&weighed))
}

/// `X S^-1 X^T` for `X` of any rows x readings, without negative eigenvalues.
///
/// Where the roughness is many times the noise, `S^-1` is a small difference of large numbers, and
/// rounding may leave an eigenvalue below zero. Such a direction counts as one without information.
#[must_use]
pub fn weighed_squares(precision: &Precision, x: &DMatrix<f64>) -> DMatrix<f64> {
    let squares = precision.weigh(x) * x.transpose();
    let squares = (&squares + squares.transpose()) * 0.5;
    let Some(eigen) = symmetric_eigen(squares.clone()) else {
        return squares;
    };
    if eigen.eigenvalues.iter().all(|value| *value >= 0.0) {
        return squares;
    }
    let values = DMatrix::from_diagonal(&eigen.eigenvalues.map(|value| value.max(0.0)));
    &eigen.eigenvectors * values * eigen.eigenvectors.transpose()
}

/// Lower factor `L` of the curvature `H = L L^T` that weights imply at slopes `b` (readings x
/// entries).
#[must_use]
pub fn implied(precision: &Precision, b: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = b.ncols();
    let h = weighed_squares(precision, &b.transpose());
    // In standardised coordinates: a direction that the data do not see keeps the region's width.
    // The share of the trace is above the rounding of the sums.
    let ridge = 1e-9 + 1e-12 * h.trace();
    Some((h + DMatrix::identity(n, n) * ridge).cholesky()?.l())
}

/// How a loss with curvature `H = L L^T` is divided so that it has the width of the sandwich formula.
///
/// Along axis `i` of [`inflation`] the sandwich has `v_i` times the variance that `H` implies. A
/// ratio below 1 counts as 1, so that no direction becomes narrower than the weights imply. Returned
/// are the largest ratio `v` and the matrix `X` with the same axes and the eigenvalues
/// `1 / v_i - 1 / v`. With `w = L^-1 B^T P e`, the sum of the loss over `v` and of `w^T X w / 2` has
/// the curvature `L V^-1 L^T`, where `V` has the eigenvalues `v_i`. Each direction is widened by what
/// *its* readings scatter, so that an unknown that smooth readings determine keeps its narrow
/// interval beside one that rough readings determine (curvature adjustment: Ribatet, Cooley and
/// Davison 2012). Without any entry, `v` is 1.
#[must_use]
pub fn tempered(inflation: &DMatrix<f64>) -> Option<(f64, DMatrix<f64>)> {
    let eigen = symmetric_eigen((inflation + inflation.transpose()) * 0.5)?;
    let ratios = eigen.eigenvalues.map(|v| v.max(1.0));
    let most = ratios.iter().copied().fold(1.0, f64::max);
    let further = DMatrix::from_diagonal(&ratios.map(|v| 1.0 / v - 1.0 / most));
    let axes = eigen.eigenvectors;
    Some((most, &axes * further * axes.transpose()))
}

/// Information of the sandwich formula: the curvature `h`, divided as by [`tempered`].
///
/// `lower` is the factor of `h` with the ridge of [`implied`], which is negligible here.
#[must_use]
pub fn informed(
    h: &DMatrix<f64>,
    lower: &DMatrix<f64>,
    inflation: &DMatrix<f64>,
) -> Option<DMatrix<f64>> {
    let (most, further) = tempered(inflation)?;
    Some(h / most + lower * further * lower.transpose())
}

fn scale_columns(x: &mut DMatrix<f64>, by: &DVector<f64>) {
    for (mut column, &factor) in x.column_iter_mut().zip(by) {
        column *= factor;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rough(rows: &DMatrix<f64>, freedom: f64) -> Roughness {
        Roughness::new(rows.clone(), freedom)
    }

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
    fn rounding_leaves_no_negative_information() {
        // Roughness of 1e9 noises along three shapes, in which the rows lie but for one reading each.
        let shape = |i: usize, k: usize| ((1 + i) as f64 * (0.3 + 0.1 * k as f64)).sin();
        let epsilon = DMatrix::from_fn(60, 40, |r, k| {
            let share = |i: usize| ((3 * r + 7 * i) as f64).cos();
            1e9 * (0..3).map(|i| share(i) * shape(i, k)).sum::<f64>()
        });
        let precision = Precision::correlated(&epsilon, 57.0);
        let rows = DMatrix::from_fn(3, 40, |i, k| 1e9 * shape(i, k));
        let squares = weighed_squares(&precision, &rows);
        let eigen = symmetric_eigen(squares).unwrap();
        let least = eigen.eigenvalues.min();
        assert!(least >= -1e-12 * eigen.eigenvalues.max(), "{least}");
    }

    #[test]
    fn the_tempered_loss_has_the_covariance_of_the_sandwich() {
        // Two entries, one shared shift of the last three readings, all inflations above 1.
        let b = DMatrix::from_row_slice(4, 2, &[1.0, 0.2, 0.5, 0.0, 0.0, 1.0, 0.3, 2.0]);
        let epsilon = DMatrix::from_row_slice(2, 4, &[2.0, 0.0, 0.0, 0.0, 0.0, 3.0, 3.0, 3.0]);
        let precision = Precision::diagonal(&DVector::from_vec(vec![0.5, 1.0, 1.0, 1.0]));
        let lower = implied(&precision, &b).unwrap();
        let inflated = inflation(&precision, &b, &rough(&epsilon, 1.0), &lower).unwrap();
        let p = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0 / 1.5, 0.5, 0.5, 0.5]));
        let h = b.transpose() * &p * &b;
        let information = informed(&h, &lower, &inflated).unwrap();
        let covariance = DMatrix::identity(4, 4) + epsilon.transpose() * &epsilon;
        let m = b.transpose() * &p * covariance * &p * &b;
        let bread = h.clone().try_inverse().unwrap();
        let sandwich = &bread * m * &bread;
        let adjusted = information.try_inverse().unwrap();
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
        let inflated = inflation(&precision, &b, &rough(&epsilon, 8.0), &lower).unwrap();
        let h = &lower * lower.transpose();
        let information = informed(&h, &lower, &inflated).unwrap();
        let along = |g: &DMatrix<f64>, by: [f64; 2]| {
            let by = DVector::from_column_slice(&by);
            by.dot(&(g * &by))
        };
        // Where the curvature is that of the ridge, the inflation is below 1.
        let apart = [1.0, -1.0];
        let ratio = along(&information, apart) / along(&h, apart);
        assert!((ratio - 1.0).abs() < 1e-2, "{ratio}");
        // M / H = 1 + |b|^2 along the sum.
        let ratio = 1.0 + b.column(0).norm_squared();
        let sum = along(&information, [0.5; 2]) / along(&h, [0.5; 2]);
        assert!((sum * ratio - 1.0).abs() < 1e-2, "{sum} {ratio}");
    }
}
