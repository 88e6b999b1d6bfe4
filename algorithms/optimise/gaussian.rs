//! A normal distribution with full covariance, truncated to a box.

use asid_core::rng::Rng;
use asid_core::{Error, Result};
use nalgebra::{Cholesky, DMatrix, DVector};
use rand_distr::{Distribution, StandardNormal};

/// How often a draw outside the box is drawn again before it is clamped.
const REDRAWS: usize = 100;

/// Initial ridge on a covariance that is not positive definite, in units of the mean variance.
const RIDGE: f64 = 1e-12;
/// How often the ridge is raised tenfold: the last is a million times the mean variance, where any
/// finite symmetric matrix is positive definite.
const RAISES: usize = 18;

/// `N(mean, covariance)` truncated to `[low, high]`.
#[derive(Clone, Debug)]
pub struct Gaussian {
    mean: DVector<f64>,
    /// Lower triangular factor `L`; `L L^T` is the covariance.
    factor: DMatrix<f64>,
    low: Vec<f64>,
    high: Vec<f64>,
}

impl Gaussian {
    /// A normal distribution; where the covariance is not positive definite, its diagonal is
    /// raised.
    ///
    /// # Errors
    /// [`Error::Failed`] where an entry of mean or covariance is not finite.
    pub fn new(
        mean: DVector<f64>,
        covariance: DMatrix<f64>,
        low: &[f64],
        high: &[f64],
    ) -> Result<Self> {
        let n = mean.len();
        let fail = || {
            Error::Failed(
                "a search distribution has entries that are not finite numbers; its points or their weights \
                 were not either"
                    .into(),
            )
        };
        if mean.iter().chain(&covariance).any(|x| !x.is_finite()) {
            return Err(fail());
        }
        let scale = (covariance.trace() / n as f64).max(1e-300);
        let ridges = (0..=RAISES).map(|k| RIDGE * scale * 10_f64.powi(k as i32));
        let factor = std::iter::once(0.0)
            .chain(ridges)
            .find_map(|ridge| Cholesky::new(&covariance + DMatrix::identity(n, n) * ridge))
            .ok_or_else(fail)?
            .unpack();
        Ok(Self {
            mean,
            factor,
            low: low.to_vec(),
            high: high.to_vec(),
        })
    }

    /// Independent entries with these standard deviations; one that is not positive is replaced by
    /// the smallest positive number.
    #[must_use]
    pub fn diagonal(mean: &[f64], std: &[f64], low: &[f64], high: &[f64]) -> Self {
        let std = std.iter().map(|s| s.max(f64::MIN_POSITIVE));
        Self {
            mean: DVector::from_column_slice(mean),
            factor: DMatrix::from_diagonal(&DVector::from_iterator(mean.len(), std)),
            low: low.to_vec(),
            high: high.to_vec(),
        }
    }

    /// Weighted fit with the effective-size correction of the covariance, `Z = sum d - sum d^2 /
    /// sum d`; standard deviations are kept above `min_std`.
    ///
    /// # Errors
    /// As [`Gaussian::new`], for example where all weights are zero.
    pub fn fit(
        samples: &[Vec<f64>],
        weights: &[f64],
        min_std: &[f64],
        low: &[f64],
        high: &[f64],
    ) -> Result<Self> {
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

    /// Independent entries with these standard deviations, in the same box.
    #[must_use]
    pub fn with_diagonal(&self, mean: &[f64], std: &[f64]) -> Self {
        Self::diagonal(mean, std, &self.low, &self.high)
    }

    /// The box: smallest and largest value of each entry.
    #[must_use]
    pub fn bounds(&self) -> (&[f64], &[f64]) {
        (&self.low, &self.high)
    }

    /// Covariance before truncation to the box.
    #[must_use]
    pub fn covariance(&self) -> DMatrix<f64> {
        &self.factor * self.factor.transpose()
    }

    /// Mean before truncation to the box.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        self.mean.as_slice()
    }

    /// The same distribution about another mean.
    #[must_use]
    pub fn moved_to(&self, mean: &[f64]) -> Self {
        Self {
            mean: DVector::from_column_slice(mean),
            ..self.clone()
        }
    }

    /// The same distribution with its standard deviations multiplied by `factor`.
    #[must_use]
    pub fn widened(&self, factor: f64) -> Self {
        Self {
            factor: &self.factor * factor,
            ..self.clone()
        }
    }

    /// Standard deviations before truncation to the box.
    #[must_use]
    pub fn std(&self) -> Vec<f64> {
        let l = &self.factor;
        (0..self.mean.len()).map(|i| l.row(i).norm()).collect()
    }

    /// The largest standard deviation of another distribution along an axis of the coordinates in
    /// which this one is a standard normal one.
    #[must_use]
    pub fn widest_axis(&self, other: &Self) -> f64 {
        let ratio = self.factor.solve_lower_triangular(&other.factor);
        let widths = ratio.iter().flat_map(|ratio| ratio.row_iter());
        widths.map(|row| row.norm()).fold(0.0, f64::max)
    }

    /// Coordinates of `x` in which the distribution is a standard normal one.
    #[must_use]
    pub fn standardise(&self, x: &[f64]) -> Vec<f64> {
        let d = DVector::from_column_slice(x) - &self.mean;
        self.factor
            .solve_lower_triangular(&d)
            .unwrap_or(d)
            .as_slice()
            .to_vec()
    }

    /// The point at these standardised coordinates.
    #[must_use]
    pub fn unstandardise(&self, u: &[f64]) -> Vec<f64> {
        let x = &self.mean + &self.factor * DVector::from_column_slice(u);
        x.as_slice().to_vec()
    }

    /// Draws a point inside the box.
    pub fn sample(&self, rng: &mut Rng) -> Vec<f64> {
        let n = self.mean.len();
        let mut x = DVector::zeros(n);
        for _ in 0..REDRAWS {
            let e = DVector::from_fn(n, |_, _| StandardNormal.sample(rng));
            x = &self.mean + &self.factor * e;
            if (0..n).all(|i| x[i] >= self.low[i] && x[i] <= self.high[i]) {
                return x.as_slice().to_vec();
            }
        }
        (0..n)
            .map(|i| x[i].clamp(self.low[i], self.high[i]))
            .collect()
    }

    /// Log density of the distribution without truncation.
    #[must_use]
    pub fn log_density(&self, x: &[f64]) -> f64 {
        let d = DVector::from_column_slice(x) - &self.mean;
        let l = &self.factor;
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
        )
        .unwrap();
        let mut rng = Streams::new(3).stream("g");
        let samples: Vec<Vec<f64>> = (0..20_000).map(|_| g.sample(&mut rng)).collect();
        let fit = Gaussian::fit(
            &samples,
            &vec![1.0; samples.len()],
            &[0.0; 2],
            &[-9.0; 2],
            &[9.0; 2],
        )
        .unwrap();
        // Standard errors are about 1/sqrt(20000) = 0.007.
        assert!((fit.mean()[0] - 0.3).abs() < 0.03 && (fit.std()[0] - 1.0).abs() < 0.03);
    }

    #[test]
    fn the_widest_axis_is_that_of_standardised_coordinates() {
        let of = |covariance: [f64; 4]| {
            let covariance = DMatrix::from_row_slice(2, 2, &covariance);
            Gaussian::new(DVector::zeros(2), covariance, &[-9.0; 2], &[9.0; 2]).unwrap()
        };
        let (round, tilted) = (of([1.0, 0.0, 0.0, 1.0]), of([4.0, 1.0, 1.0, 0.5]));
        assert!((round.widest_axis(&tilted) - 2.0).abs() < 1e-12);
        // L = [[2, 0], [0.5, 0.5]], so that L^-1 = [[0.5, 0], [-0.5, 2]].
        assert!((tilted.widest_axis(&round) - 4.25_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_number_is_refused() {
        let of = |mean: f64, variance: f64| {
            let covariance = DMatrix::from_element(1, 1, variance);
            Gaussian::new(DVector::from_vec(vec![mean]), covariance, &[0.0], &[1.0])
        };
        for (mean, variance) in [(0.0, f64::NAN), (f64::NAN, 1.0), (0.0, f64::INFINITY)] {
            assert!(of(mean, variance).is_err(), "{mean} {variance}");
        }
        // If all weights are zero there is no mean.
        let points = [vec![0.3], vec![0.4]];
        assert!(Gaussian::fit(&points, &[0.0; 2], &[0.1], &[0.0], &[1.0]).is_err());
    }

    #[test]
    fn a_covariance_that_is_not_positive_is_raised() {
        // Two identical entries, and an indefinite matrix (eigenvalues 3 and -1).
        for rows in [[1.0, 1.0, 1.0, 1.0], [1.0, 2.0, 2.0, 1.0]] {
            let covariance = DMatrix::from_row_slice(2, 2, &rows);
            let mean = DVector::from_vec(vec![0.0; 2]);
            let g = Gaussian::new(mean, covariance, &[-9.0; 2], &[9.0; 2]).unwrap();
            assert!(g.std().iter().all(|s| s.is_finite() && *s >= 1.0));
        }
    }

    #[test]
    fn draws_stay_in_the_box() {
        let g = Gaussian::diagonal(&[5.0], &[1.0], &[0.0], &[1.0]);
        let mut rng = Streams::new(0).stream("g");
        assert!((0..100).all(|_| (0.0..=1.0).contains(&g.sample(&mut rng)[0])));
    }
}
