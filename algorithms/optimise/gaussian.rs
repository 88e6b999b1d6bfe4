//! A normal distribution with full covariance, cut to a box.

use asid_core::rng::Rng;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rand_distr::{Distribution, StandardNormal};

/// Draws that fall outside the box are drawn again this often before they are clamped.
const REDRAWS: usize = 100;

/// `N(mean, covariance)` cut to `[low, high]`.
#[derive(Clone, Debug)]
pub struct Gaussian {
    mean: DVector<f64>,
    factor: Cholesky<f64, Dyn>,
    low: Vec<f64>,
    high: Vec<f64>,
}

impl Gaussian {
    /// A normal distribution; the covariance is made positive definite by raising
    /// its diagonal where it is not.
    #[must_use]
    pub fn new(mean: DVector<f64>, covariance: DMatrix<f64>, low: &[f64], high: &[f64]) -> Self {
        let n = mean.len();
        let scale = (covariance.trace() / n as f64).max(1e-300);
        let mut ridge = 0.0;
        let factor = loop {
            let raised = &covariance + DMatrix::identity(n, n) * ridge;
            if let Some(factor) = Cholesky::new(raised) {
                break factor;
            }
            ridge = if ridge == 0.0 {
                1e-12 * scale
            } else {
                ridge * 10.0
            };
        };
        Self {
            mean,
            factor,
            low: low.to_vec(),
            high: high.to_vec(),
        }
    }

    /// Independent entries with these deviations.
    #[must_use]
    pub fn diagonal(mean: &[f64], std: &[f64], low: &[f64], high: &[f64]) -> Self {
        let variance = DVector::from_iterator(std.len(), std.iter().map(|s| s * s));
        Self::new(
            DVector::from_column_slice(mean),
            DMatrix::from_diagonal(&variance),
            low,
            high,
        )
    }

    /// Weighted fit with the effective-size correction of the covariance,
    /// `Z = sum d - sum d^2 / sum d`, and the deviations kept above `min_std`.
    #[must_use]
    pub fn fit(
        samples: &[Vec<f64>],
        weights: &[f64],
        min_std: &[f64],
        low: &[f64],
        high: &[f64],
    ) -> Self {
        let n = low.len();
        let total: f64 = weights.iter().sum();
        let squares: f64 = weights.iter().map(|w| w * w).sum();
        let mut mean = DVector::<f64>::zeros(n);
        for (s, w) in samples.iter().zip(weights) {
            for i in 0..n {
                mean[i] += w / total * s[i];
            }
        }
        let z = total - squares / total;
        let mut covariance = DMatrix::<f64>::zeros(n, n);
        if z > 1e-12 * total {
            for (s, w) in samples.iter().zip(weights) {
                for i in 0..n {
                    for j in 0..n {
                        covariance[(i, j)] += w / z * (s[i] - mean[i]) * (s[j] - mean[j]);
                    }
                }
            }
        }
        for i in 0..n {
            covariance[(i, i)] = covariance[(i, i)].max(min_std[i] * min_std[i]);
        }
        Self::new(mean, covariance, low, high)
    }

    /// The mean before it was cut to the box.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        self.mean.as_slice()
    }

    /// The same distribution with its deviations multiplied.
    #[must_use]
    pub fn widened(&self, factor: f64) -> Self {
        let l = self.factor.l() * factor;
        Self::new(self.mean.clone(), &l * l.transpose(), &self.low, &self.high)
    }

    /// Standard deviations before it was cut to the box.
    #[must_use]
    pub fn std(&self) -> Vec<f64> {
        let l = self.factor.l();
        (0..self.mean.len()).map(|i| l.row(i).norm()).collect()
    }

    /// Coordinates in which the distribution is a standard normal one.
    #[must_use]
    pub fn standardise(&self, x: &[f64]) -> Vec<f64> {
        let d = DVector::from_column_slice(x) - &self.mean;
        let l = self.factor.l();
        l.solve_lower_triangular(&d)
            .unwrap_or(d)
            .as_slice()
            .to_vec()
    }

    /// The point at these standardised coordinates.
    #[must_use]
    pub fn unstandardise(&self, u: &[f64]) -> Vec<f64> {
        let x = &self.mean + self.factor.l() * DVector::from_column_slice(u);
        x.as_slice().to_vec()
    }

    /// A draw inside the box.
    pub fn sample(&self, rng: &mut Rng) -> Vec<f64> {
        let n = self.mean.len();
        let l = self.factor.l();
        let mut x = DVector::zeros(n);
        for _ in 0..REDRAWS {
            let e = DVector::from_fn(n, |_, _| StandardNormal.sample(rng));
            x = &self.mean + &l * e;
            if (0..n).all(|i| x[i] >= self.low[i] && x[i] <= self.high[i]) {
                return x.as_slice().to_vec();
            }
        }
        (0..n)
            .map(|i| x[i].clamp(self.low[i], self.high[i]))
            .collect()
    }

    /// Log density of the uncut distribution.
    #[must_use]
    pub fn log_density(&self, x: &[f64]) -> f64 {
        let d = DVector::from_column_slice(x) - &self.mean;
        let l = self.factor.l();
        let solved = l.solve_lower_triangular(&d).unwrap_or(d);
        let log_det: f64 = (0..x.len()).map(|i| l[(i, i)].ln()).sum();
        -0.5 * solved.norm_squared()
            - log_det
            - 0.5 * x.len() as f64 * (2.0 * std::f64::consts::PI).ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Streams;

    #[test]
    fn the_density_of_two_entries_is_the_formula() {
        let g = Gaussian::diagonal(&[1.0, -1.0], &[0.5, 2.0], &[-9.0; 2], &[9.0; 2]);
        let expected = -0.5 * (0.5_f64 / 0.5).powi(2)
            - 0.5 * (1.0_f64 / 2.0).powi(2)
            - (2.0 * std::f64::consts::PI * 0.5 * 2.0).ln();
        assert!((g.log_density(&[1.5, 0.0]) - expected).abs() < 1e-12);
    }

    #[test]
    fn a_fit_of_draws_finds_the_distribution() {
        let covariance = DMatrix::from_row_slice(2, 2, &[1.0, 0.6, 0.6, 0.5]);
        let g = Gaussian::new(
            DVector::from_vec(vec![0.3, -0.2]),
            covariance,
            &[-9.0; 2],
            &[9.0; 2],
        );
        let mut rng = Streams::new(3).stream("g");
        let samples: Vec<Vec<f64>> = (0..20_000).map(|_| g.sample(&mut rng)).collect();
        let fit = Gaussian::fit(
            &samples,
            &vec![1.0; samples.len()],
            &[0.0; 2],
            &[-9.0; 2],
            &[9.0; 2],
        );
        // Standard errors are about 1/sqrt(20000) = 0.007.
        assert!((fit.mean()[0] - 0.3).abs() < 0.03 && (fit.std()[0] - 1.0).abs() < 0.03);
    }

    #[test]
    fn draws_stay_in_the_box() {
        let g = Gaussian::diagonal(&[5.0], &[1.0], &[0.0], &[1.0]);
        let mut rng = Streams::new(0).stream("g");
        assert!((0..100).all(|_| (0.0..=1.0).contains(&g.sample(&mut rng)[0])));
    }
}
