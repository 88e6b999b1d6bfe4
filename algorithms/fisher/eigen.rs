//! Eigendecomposition of symmetric matrices that refuses non-finite entries.

use nalgebra::{DMatrix, DVector, Dyn, SymmetricEigen};

/// Eigenvalues and eigenvectors of a symmetric matrix.
///
/// `None` where an entry is not finite: the iteration would never end. A matrix without entries has
/// none of either.
#[must_use]
pub fn symmetric_eigen(matrix: DMatrix<f64>) -> Option<SymmetricEigen<f64, Dyn>> {
    if matrix.is_empty() {
        return Some(SymmetricEigen {
            eigenvectors: matrix,
            eigenvalues: DVector::zeros(0),
        });
    }
    matrix
        .iter()
        .all(|x| x.is_finite())
        .then(|| matrix.symmetric_eigen())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_with_a_nan_has_no_eigenvalues() {
        let mut matrix = DMatrix::identity(3, 3);
        assert_eq!(
            symmetric_eigen(matrix.clone()).unwrap().eigenvalues.sum(),
            3.0
        );
        matrix[(1, 2)] = f64::NAN;
        assert!(symmetric_eigen(matrix).is_none());
    }
}
