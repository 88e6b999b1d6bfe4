//! The measured roughness of simulations: what a regression over nearby points leaves.
//!
//! Its covariance over the readings is `R = E^T E / freedom`, where the rows of `E` are the
//! residuals of the regression.

use nalgebra::{DMatrix, DVector};

use super::precision::{Precision, implied, inflation};

/// Most rows of several models together, since the cost of weights by a whole covariance grows with
/// their cube. By default the search and all rounds of one model simulate `5 * 64 + 12 * 64` points.
const MOST_ROWS: usize = 1024;

/// Residuals of a regression over nearby simulations, in units of the sensors' noise.
#[derive(Clone, Debug)]
pub struct Roughness {
    /// Simulations x readings.
    rows: DMatrix<f64>,
    /// Degrees of freedom of all rows together, above 0.
    freedom: f64,
}

impl Roughness {
    /// Roughness by the rows (simulations x readings) that a regression leaves, with `freedom`
    /// degrees of freedom.
    #[must_use]
    pub fn new(rows: DMatrix<f64>, freedom: f64) -> Self {
        Self { rows, freedom }
    }

    /// No roughness of this many readings.
    #[must_use]
    pub fn none(readings: usize) -> Self {
        Self::new(DMatrix::zeros(0, readings), 1.0)
    }

    /// Roughness of several models together: the mean of their covariances, weighed by the degrees
    /// of freedom. All have the same readings. Of more than 1024 rows,
    /// evenly spaced ones stand for all.
    #[must_use]
    pub fn pooled<'r>(parts: impl Iterator<Item = &'r Self> + Clone) -> Self {
        let count = parts.clone().map(|part| part.rows.nrows()).sum();
        let readings = parts.clone().map(|part| part.rows.ncols()).max();
        let mut rows = DMatrix::zeros(count, readings.unwrap_or(0));
        let (mut from, mut freedom) = (0, 0.0);
        for part in parts {
            rows.rows_mut(from, part.rows.nrows()).copy_from(&part.rows);
            from += part.rows.nrows();
            freedom += part.freedom;
        }
        let all = Self::new(rows, freedom);
        if count <= MOST_ROWS {
            return all;
        }
        all.some((0..count).step_by(count.div_ceil(MOST_ROWS)))
    }

    /// Some of the rows, with their share of the degrees of freedom.
    fn some(&self, rows: impl Iterator<Item = usize>) -> Self {
        let rows: Vec<usize> = rows.collect();
        let share = rows.len() as f64 / self.rows.nrows().max(1) as f64;
        let freedom = (self.freedom * share).max(f64::MIN_POSITIVE);
        Self::new(self.rows.select_rows(&rows), freedom)
    }

    /// The roughness of the first `readings` entries.
    #[must_use]
    pub fn first(&self, readings: usize) -> Self {
        Self::new(self.rows.columns(0, readings).into_owned(), self.freedom)
    }

    /// Variance at each reading.
    #[must_use]
    pub fn variance(&self) -> DVector<f64> {
        let square = |k: usize| self.rows.column(k).norm_squared() / self.freedom;
        DVector::from_fn(self.rows.ncols(), |k, _| square(k))
    }

    /// Root mean square over `readings` entries that are present.
    #[must_use]
    pub fn size(&self, readings: usize) -> f64 {
        (self.rows.norm_squared() / self.freedom / readings.max(1) as f64).sqrt()
    }

    /// Weights of the readings, by the variance at each or by the whole covariance along the
    /// episode (`correlated`).
    #[must_use]
    pub fn precision(&self, correlated: bool) -> Precision {
        if correlated {
            Precision::correlated(&self.rows, self.freedom)
        } else {
            Precision::diagonal(&self.variance())
        }
    }

    /// Pairs of weights and of the roughness that they are tested on, which count alike.
    ///
    /// A sample covariance cannot be tested on the rows that it was computed from: each half of the
    /// rows is tested with the weights of the other. Variances alone have no such freedom.
    #[must_use]
    pub fn crossed(&self, correlated: bool) -> Vec<(Precision, Self)> {
        if !correlated {
            return vec![(self.precision(false), self.clone())];
        }
        let [one, other] = self.halves();
        vec![
            (one.precision(true), other.clone()),
            (other.precision(true), one),
        ]
    }

    /// The rows in two interleaved halves.
    fn halves(&self) -> [Self; 2] {
        [0, 1].map(|k| self.some((k..self.rows.nrows()).step_by(2)))
    }

    /// `X R X^T` for `X` of any rows x readings.
    #[must_use]
    pub fn covariance_of(&self, x: &DMatrix<f64>) -> DMatrix<f64> {
        let projected = x * self.rows.transpose();
        &projected * projected.transpose() / self.freedom
    }

    /// `tr(S^-1 R)`: the weighed sum of squares of one draw of the roughness, on average.
    #[must_use]
    pub fn weighed_by(&self, precision: &Precision) -> f64 {
        precision.weigh(&self.rows).component_mul(&self.rows).sum() / self.freedom
    }

    /// The [`inflation`] of estimates with slopes `b` (readings x entries); `None` where the
    /// slopes are not finite.
    #[must_use]
    pub fn inflation(&self, b: &DMatrix<f64>, correlated: bool) -> Option<DMatrix<f64>> {
        let pairs = self.crossed(correlated);
        let mut mean = DMatrix::zeros(b.ncols(), b.ncols());
        for (precision, asked) in &pairs {
            mean += inflation(precision, b, asked, &implied(precision, b)?)?;
        }
        Some(mean / pairs.len() as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pooled_roughness_has_the_mean_covariance() {
        let rows =
            |scale: f64| DMatrix::from_fn(7, 4, |i, k| scale * ((3 * i + 2 * k) as f64).sin());
        let [one, other] = [(1.0, 5.0), (3.0, 5.0)].map(|(s, f)| Roughness::new(rows(s), f));
        let pooled = Roughness::pooled([&one, &other].into_iter());
        let eye = DMatrix::identity(4, 4);
        let mean = (one.covariance_of(&eye) + other.covariance_of(&eye)) * 0.5;
        assert!((pooled.covariance_of(&eye) - mean).norm() < 1e-12);
        assert!((pooled.variance()[1] - 5.0 * one.variance()[1]).abs() < 1e-12);
        // Of many models alike, some of the rows say the same.
        let many = Roughness::pooled(std::iter::repeat_n(&one, 400));
        assert!(many.rows.nrows() <= MOST_ROWS);
        let error = many.covariance_of(&eye) - one.covariance_of(&eye);
        assert!(error.norm() < 0.01 * one.covariance_of(&eye).norm());
    }

    #[test]
    fn the_weighed_sum_of_squares_is_a_trace() {
        let rows = DMatrix::from_fn(7, 3, |i, k| ((5 * i + k) as f64).cos());
        let roughness = Roughness::new(rows, 6.0);
        let precision = roughness.precision(true);
        let covariance = roughness.covariance_of(&DMatrix::identity(3, 3));
        let wanted = precision.weigh(&covariance).trace();
        assert!((roughness.weighed_by(&precision) - wanted).abs() < 1e-12);
    }

    #[test]
    fn without_roughness_each_reading_counts_once() {
        let none = Roughness::none(3);
        for correlated in [false, true] {
            let row = DMatrix::from_row_slice(1, 3, &[1.0, 2.0, 3.0]);
            assert_eq!(none.precision(correlated).weigh(&row), row);
            for (precision, asked) in none.crossed(correlated) {
                assert_eq!(precision.weigh(&row), row);
                assert_eq!(asked.covariance_of(&row)[(0, 0)], 0.0);
            }
        }
    }
}
