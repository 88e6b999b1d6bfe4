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
    let mut fixed: Vec<Option<f64>> = vec![None; n];
    let mut c = DVector::zeros(n);
    // One coefficient after the other is held at the bound that it leaves furthest.
    for _ in 0..=n {
        let free: Vec<usize> = (0..n).filter(|&i| fixed[i].is_none()).collect();
        let part = DMatrix::from_fn(free.len(), free.len(), |i, j| a[(free[i], free[j])]);
        let right = DVector::from_fn(free.len(), |i, _| {
            let held: f64 = (0..n)
                .filter_map(|j| fixed[j].map(|x| a[(free[i], j)] * x))
                .sum();
            b[free[i]] - held
        });
        let Some(factor) = part.cholesky() else { break };
        let solved = factor.solve(&right);
        for (i, x) in free.iter().zip(solved.iter()) {
            c[*i] = *x;
        }
        for (i, x) in fixed.iter().enumerate() {
            if let Some(x) = x {
                c[i] = *x;
            }
        }
        let beyond = |i: usize| {
            let [low, high] = bounds[which[i]];
            (low - c[i]).max(c[i] - high)
        };
        let worst = free
            .into_iter()
            .max_by(|&i, &j| beyond(i).total_cmp(&beyond(j)));
        match worst.filter(|&i| beyond(i) > 1e-12) {
            Some(i) => {
                let [low, high] = bounds[which[i]];
                fixed[i] = Some(c[i].clamp(low, high));
            }
            None => break,
        }
    }
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
