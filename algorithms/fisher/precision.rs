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

/// Factor by which the variance of an unknown exceeds the one that the weights imply; the largest
/// of all unknowns, and at least 1.
///
/// It comes from the sandwich formula at slopes `b` (readings x entries), with the roughness given
/// by the rows of `epsilon`.
#[must_use]
pub fn inflation(
    precision: &Precision,
    b: &DMatrix<f64>,
    epsilon: &DMatrix<f64>,
    freedom: f64,
    sought: usize,
) -> Option<f64> {
    let n = b.ncols();
    let bw = precision.weigh(&b.transpose());
    // In standardised coordinates: a direction that the data do not see keeps the region's width.
    let h = &bw * b + DMatrix::identity(n, n) * 1e-9;
    let projected = &bw * epsilon.transpose();
    let middle = &bw * bw.transpose() + &projected * projected.transpose() / freedom;
    let inverse = h.cholesky()?.inverse();
    let sandwich = &inverse * middle * &inverse;
    let inflated = (0..sought).map(|i| sandwich[(i, i)] / inverse[(i, i)]);
    Some(inflated.fold(1.0, f64::max))
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
}
