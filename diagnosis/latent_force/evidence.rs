//! Laplace evidence of a linear regression with normal priors and bounds.
//!
//! With `X'X`, `X'y` of whitened innovations, coefficients in units of their prior deviations and a prior
//! `N(0, 1)`, the logarithm of the marginal likelihood relative to that without the columns is
//! `b'c - c'Ac/2 - ln det A / 2` at the best coefficients `c` within their bounds, `A = X'X + I` (MacKay 1992).

use nalgebra::{DMatrix, DVector};

/// Evidence, and the coefficients behind it.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// Logarithm of the marginal likelihood, natural, relative to none of the columns.
    pub gain: f64,
    /// Coefficients in units of their prior deviations.
    pub coefficients: Vec<f64>,
    /// Posterior covariance of the coefficients, bounds aside.
    pub covariance: DMatrix<f64>,
}

/// Evidence of the columns `which` of a regression. `gram` and `moment` are in units of the prior deviations;
/// `center` is where the prior's mean lies from the present point, and `bounds` where the coefficients may
/// go from it, all in deviations.
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

/// Most sweeps of coordinate descent.
const SWEEPS: usize = 400;
/// Largest move of a sweep at which it stands, in deviations of the prior.
const STANDS: f64 = 1e-9;

/// The `c` within bounds that maximises `b'c - c'Ac/2`: without bounds where that lies within them, else by
/// coordinate descent, which finds the maximum of a concave function over a box.
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
        // y = x c + noise of variance 1 with c ~ N(0, 1): y'y - y'(I + xx')^-1 y over 2, less ln(1 + x'x) / 2.
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
        // Without bounds one wants 30 and the other -20; held at 5, the first is best near 5 and the second near 4.
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
