//! The values that a fit with a hidden missing force considers possible.
//!
//! A whole replay accumulates what the model lacks: if an unnamed force makes an axis drift, a
//! wrong mass replays it best. The fit that allows for a missing force has the uncertainty of each
//! value. A fit to replays chooses among the values within it.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// The 99 % quantile of the standard normal distribution: the default rate of false alarms rejects
/// values outside.
const QUANTILE: f64 = 2.326_348;

/// An ellipsoid that contains 99 % of a normal distribution of some unknowns.
#[derive(Clone, Debug)]
pub struct Region {
    /// Indices of the unknowns.
    places: Vec<usize>,
    mean: DVector<f64>,
    covariance: Cholesky<f64, Dyn>,
}

/// Returns the 99 % quantile of the chi-square distribution with `n` degrees of freedom (Wilson and
/// Hilferty 1931).
fn chi_square(n: usize) -> f64 {
    let n = n as f64;
    let spread = 2.0 / (9.0 * n);
    n * (1.0 - spread + QUANTILE * spread.sqrt()).powi(3)
}

impl Region {
    /// Makes the region of the unknowns at some `places` from their mean and covariance, in their
    /// units.
    ///
    /// Returns `None` if the covariance is not of full rank.
    #[must_use]
    pub fn new(places: Vec<usize>, mean: Vec<f64>, covariance: DMatrix<f64>) -> Option<Self> {
        Some(Self {
            places,
            mean: DVector::from_vec(mean),
            covariance: covariance.cholesky()?,
        })
    }

    /// Moves values outside the region straight towards the mean, to its boundary.
    pub fn pull_in(&self, theta: &mut [f64]) {
        let own = self.places.iter().map(|&i| theta[i]);
        let off = DVector::from_iterator(self.places.len(), own) - &self.mean;
        let square = off.dot(&self.covariance.solve(&off));
        let most = chi_square(self.places.len());
        if square > most {
            let share = (most / square).sqrt();
            for (k, &i) in self.places.iter().enumerate() {
                theta[i] = self.mean[k] + share * off[k];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (n, want) in [(1, 6.635), (2, 9.210), (5, 15.086), (20, 37.566)] {
            assert!((chi_square(n) / want - 1.0).abs() < 0.02, "{n}");
        }
    }

    #[test]
    fn what_lies_outside_comes_to_the_edge_and_what_lies_inside_stays() {
        let covariance = DMatrix::from_row_slice(2, 2, &[4.0, 0.0, 0.0, 0.25]);
        let region = Region::new(vec![2, 0], vec![1.0, -1.0], covariance).unwrap();
        let inside = [-0.8, 7.0, 3.0];
        let mut theta = inside;
        region.pull_in(&mut theta);
        assert_eq!(theta, inside);
        // Ten standard deviations of the first: it moves to the quantile, and the value outside the
        // region's unknowns stays.
        let mut theta = [-1.0, 7.0, 21.0];
        region.pull_in(&mut theta);
        assert!((theta[2] - (1.0 + 2.0 * chi_square(2).sqrt())).abs() < 1e-12);
        assert_eq!((theta[0], theta[1]), (-1.0, 7.0));
    }
}
