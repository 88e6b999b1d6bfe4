//! Laplace evidence of a linear regression with normal priors and bounds.
//!
//! `X'X` and `X'y` are those of whitened innovations. Coefficients are in prior standard
//! deviations, with the prior `N(0, 1)`. Let `A = X'X + I`, and `c` be the best coefficients within
//! their bounds. The log marginal likelihood relative to the model without the columns is then
//! `b'c - c'Ac/2 - ln det A / 2` (MacKay 1992).

use nalgebra::{DMatrix, DVector};

/// Evidence, and the coefficients behind it.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// Log marginal likelihood, natural, relative to the model without the columns.
    pub gain: f64,
    /// Coefficients in prior standard deviations.
    pub coefficients: Vec<f64>,
    /// Posterior covariance of the coefficients, without regard to bounds.
    pub covariance: DMatrix<f64>,
}

/// Computes the evidence of the columns `which` of a regression.
///
/// `gram` and `moment` are in prior standard deviations. `center` is the prior's mean relative to
/// the present point. `bounds` limit the coefficients relative to it. Both are in standard
/// deviations.
#[must_use]
pub fn evidence(
    gram: &DMatrix<f64>,
    moment: &DVector<f64>,
    which: &[usize],
    center: &[f64],
    bounds: &[[f64; 2]],
) -> Evidence {
    let n = which.len();
    let a = DMatrix::from_fn(n, n, |i, j| {
        gram[(which[i], which[j])] + f64::from(u8::from(i == j))
    });
    let b = DVector::from_fn(n, |i, _| moment[which[i]] + center[which[i]]);
    let own: Vec<[f64; 2]> = which.iter().map(|&i| bounds[i]).collect();
    let c = bounded(&a, &b, &own);
    let prior: f64 = which.iter().map(|&i| center[i] * center[i]).sum();
    let (log_determinant, covariance) = match a.clone().cholesky() {
        Some(factor) => {
            let log: f64 = factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum();
            (2.0 * log, factor.inverse())
        }
        None => (f64::INFINITY, DMatrix::zeros(n, n)),
    };
    Evidence {
        gain: b.dot(&c) - 0.5 * c.dot(&(&a * &c)) - 0.5 * log_determinant - 0.5 * prior,
        coefficients: c.iter().copied().collect(),
        covariance,
    }
}

/// Largest number of sweeps of coordinate descent.
const SWEEPS: usize = 400;
/// Coordinate descent has converged at this largest change of a sweep, in prior standard
/// deviations.
const STANDS: f64 = 1e-9;

/// Returns the `c` within bounds that maximises `b'c - c'Ac/2`.
///
/// It is the unbounded maximum if that lies within the bounds. Else coordinate descent finds it, as
/// it does for any concave function over a box.
fn bounded(a: &DMatrix<f64>, b: &DVector<f64>, bounds: &[[f64; 2]]) -> DVector<f64> {
    let n = b.len();
    let free = a.clone().cholesky().map(|f| f.solve(b));
    let mut c = free.unwrap_or_else(|| DVector::zeros(n));
    let inside = |i: usize, x: f64| x >= bounds[i][0] - 1e-12 && x <= bounds[i][1] + 1e-12;
    if (0..n).all(|i| inside(i, c[i])) {
        return c;
    }
    for i in 0..n {
        c[i] = c[i].clamp(bounds[i][0], bounds[i][1]);
    }
    for _ in 0..SWEEPS {
        let mut moved: f64 = 0.0;
        for i in 0..n {
            let others: f64 = (0..n).filter(|&j| j != i).map(|j| a[(i, j)] * c[j]).sum();
            let new = ((b[i] - others) / a[(i, i)]).clamp(bounds[i][0], bounds[i][1]);
            moved = moved.max((new - c[i]).abs());
            c[i] = new;
        }
        if moved < STANDS {
            break;
        }
    }
    c
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_one_column_is_the_ratio_of_two_normal_densities() {
        // y = x c + noise of variance 1 with c ~ N(0, 1): y'y - y'(I + xx')^-1 y over 2, less ln(1
        // + x'x) / 2.
        let (x, y) = ([1.0, 2.0, -1.0], [0.9, 2.2, -0.7]);
        let xx: f64 = x.iter().map(|x| x * x).sum();
        let xy: f64 = x.iter().zip(&y).map(|(x, y)| x * y).sum();
        let gram = DMatrix::from_element(1, 1, xx);
        let moment = DVector::from_element(1, xy);
        let found = evidence(&gram, &moment, &[0], &[0.0], &[[-9.0, 9.0]]);
        let want = 0.5 * xy * xy / (1.0 + xx) - 0.5 * (1.0 + xx).ln();
        assert!((found.gain - want).abs() < 1e-12);
        assert!((found.coefficients[0] - xy / (1.0 + xx)).abs() < 1e-12);
    }

    #[test]
    fn a_coefficient_stays_within_its_bounds_and_the_others_make_the_best_of_it() {
        let gram = DMatrix::from_row_slice(2, 2, &[10.0, 6.0, 6.0, 10.0]);
        let moment = DVector::from_row_slice(&[-4.0, 8.0]);
        let found = evidence(
            &gram,
            &moment,
            &[0, 1],
            &[0.0; 2],
            &[[0.0, 9.0], [-9.0, 9.0]],
        );
        assert!(found.coefficients[0].abs() < 1e-12);
        assert!((found.coefficients[1] - 8.0 / 11.0).abs() < 1e-12);
    }

    #[test]
    fn of_two_columns_that_are_nearly_one_neither_is_driven_to_a_far_bound() {
        // Without bounds, one goes to 30 and the other to -20. With the first held at 5, the best
        // second is near 4.
        let gram = DMatrix::from_row_slice(2, 2, &[1000.0, 999.0, 999.0, 1000.0]);
        let moment = DVector::from_row_slice(&[9050.0, 9000.0]);
        let bounds = [[-5.0, 5.0], [-5.0, 5.0]];
        let found = evidence(&gram, &moment, &[0, 1], &[0.0; 2], &bounds);
        assert!((found.coefficients[0] - 5.0).abs() < 1e-9);
        assert!((found.coefficients[1] - (9000.0 - 999.0 * 5.0) / 1001.0).abs() < 1e-6);
    }

    #[test]
    fn a_column_that_does_nothing_costs_nothing_and_earns_nothing() {
        let found = evidence(
            &DMatrix::zeros(1, 1),
            &DVector::zeros(1),
            &[0],
            &[0.0],
            &[[-1.0, 1.0]],
        );
        assert!(found.gain.abs() < 1e-12);
    }
}
