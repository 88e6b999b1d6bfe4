//! Systematic errors of a tracker, which are common to all readings of an episode.
//!
//! A tracker is late by some milliseconds, and its frame is registered with the machine's to a
//! millimetre or two. Neither averages out over an episode's readings. A likelihood with noise
//! alone takes both for motion of the object, with false certainty. Here both have a normal prior
//! and are integrated out. Let `V` be the derivatives of the whitened readings with respect to
//! these errors, in their prior standard deviations. Then the readings have the covariance
//! `I + V V^T` (Rasmussen and Williams 2006, section 2.7: basis functions with a prior on their
//! weights). A residual is whitened by the Cholesky factor of this covariance. Entry by entry that
//! is a Kalman filter of constant states, and the result is its normalised innovations. So the
//! whitened residual of the first part of an episode is the first part of the whitened residual.
//! None of this needs a simulation.

use asid_core::tracker::TrackerPrior;
use nalgebra::{DMatrix, DVector};

use crate::SignalSet;

/// Derivatives of an episode's whitened readings with respect to the systematic errors of its
/// trackers.
#[derive(Clone, Debug)]
pub struct SystematicErrors {
    /// Errors x entries, in prior standard deviations of the errors.
    slopes: DMatrix<f64>,
}

impl SystematicErrors {
    /// Computes the derivatives for predicted readings (`rows x width`) and their times (s).
    #[must_use]
    pub fn at(errors: TrackerPrior, signals: &SignalSet, time: &[f64], predicted: &[f64]) -> Self {
        let (width, len) = (signals.width(), signals.whitened_len());
        let rows = predicted.len() / width.max(1);
        let row = |k: usize| &predicted[k * width..(k + 1) * width];
        let angles = signals.angles();
        let of = |j: usize| {
            if angles[j] {
                errors.rotation
            } else {
                errors.offset
            }
        };
        let offsets: Vec<usize> = (0..len).filter(|&j| of(j) > 0.0).collect();
        let late = errors.latency > 0.0 && rows > 1;
        let mut slopes = DMatrix::zeros(offsets.len() + usize::from(late), rows * len);
        let (mut shifted, mut shift) = (vec![0.0; width], vec![0.0; len]);
        let mut out = vec![0.0; len];
        let mut put = |error: usize, k: usize, out: &[f64]| {
            for (e, x) in out.iter().enumerate() {
                slopes[(error, k * len + e)] = if x.is_finite() { *x } else { 0.0 };
            }
        };
        for k in 0..rows {
            for (error, &j) in offsets.iter().enumerate() {
                shifted.copy_from_slice(row(k));
                shift[j] = of(j);
                signals.add_offset(&mut shifted, &shift);
                shift[j] = 0.0;
                signals.difference(&shifted, row(k), &mut out);
                put(error, k, &out);
            }
            if late {
                let (before, after) = (k.saturating_sub(1), (k + 1).min(rows - 1));
                signals.difference(row(after), row(before), &mut out);
                let step = -errors.latency / (time[after] - time[before]);
                out.iter_mut().for_each(|x| *x *= step);
                put(offsets.len(), k, &out);
            }
        }
        Self { slopes }
    }

    /// Whitens a residual by noise and systematic errors together.
    ///
    /// The residual is `rows x whitened_len`, in standard deviations of the noise. Where `present`
    /// is false there is no reading, and the entry stays as it is.
    pub fn whiten(&self, present: &[bool], residual: &mut [f64]) {
        let n = self.slopes.nrows();
        if n == 0 {
            return;
        }
        let mut mean = DVector::<f64>::zeros(n);
        let mut covariance = DMatrix::<f64>::identity(n, n);
        for (k, x) in residual.iter_mut().enumerate() {
            let slope = self.slopes.column(k);
            if !present[k] || slope.iter().all(|v| *v == 0.0) {
                continue;
            }
            let carried = &covariance * slope;
            let variance = 1.0 + slope.dot(&carried);
            let innovation = *x - slope.dot(&mean);
            mean.axpy(innovation / variance, &carried, 1.0);
            covariance.ger(-1.0 / variance, &carried, &carried, 1.0);
            *x = innovation / variance.sqrt();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three readings, two errors.
    fn errors() -> SystematicErrors {
        SystematicErrors {
            slopes: DMatrix::from_row_slice(2, 3, &[1.0, 2.0, 0.0, 0.5, -1.0, 3.0]),
        }
    }

    #[test]
    fn the_sum_of_squares_is_that_of_the_whole_covariance() {
        let r = DVector::from_row_slice(&[1.0, -2.0, 0.7]);
        let v = errors().slopes.transpose();
        let covariance = DMatrix::identity(3, 3) + &v * v.transpose();
        let wanted = r.dot(&covariance.cholesky().unwrap().solve(&r));
        let mut out = r.as_slice().to_vec();
        errors().whiten(&[true; 3], &mut out);
        let got: f64 = out.iter().map(|x| x * x).sum();
        assert!((got - wanted).abs() < 1e-12, "{got} {wanted}");
    }

    #[test]
    fn a_missing_reading_changes_nothing() {
        let (mut with, mut without) = ([1.0, 0.0, 0.7], [1.0, 0.7]);
        errors().whiten(&[true, false, true], &mut with);
        let slopes = errors().slopes.select_columns(&[0, 2]);
        SystematicErrors { slopes }.whiten(&[true; 2], &mut without);
        assert_eq!([with[0], with[2]], without);
        assert_eq!(with[1], 0.0);
    }

    #[test]
    fn the_first_part_of_an_episode_is_whitened_as_by_itself() {
        let (mut whole, mut part) = ([1.0, -2.0, 0.7], [1.0, -2.0]);
        errors().whiten(&[true; 3], &mut whole);
        errors().whiten(&[true; 3], &mut part);
        assert_eq!(whole[..2], part);
    }
}
