//! How far the predictions of two explanations differ once each is fitted again.
//!
//! A difference that other values of a rival would remove carries no information. Let `d` be the
//! difference of the predictions in units of the noise. Let `K` be the change of each explanation's
//! own prediction per standard deviation of its values. The readings of the experiment then have
//! the covariance `I + K K^T` about either prediction. `d^T (I + K K^T)^-1 d` is what remains of
//! `d^T d` when both are fitted to the logs and the experiment together.

use asid_core::Result;
use nalgebra::{DMatrix, DVector};

use crate::bench::{Bench, Explanation};
use crate::predict::{Point, State};
use crate::record::Record;

use super::Rival;

/// Returns how far the predictions of an episode by two explanations differ after a fit to it, a
/// sum of squares in units of the noise.
///
/// It is not a finite number where a prediction diverges. `record` holds that episode alone.
pub(super) fn apart(bench: &Bench, record: &Record, rivals: [Rival<'_>; 2]) -> Result<f64> {
    let mut predictions = Vec::with_capacity(2);
    let mut columns: Vec<DVector<f64>> = Vec::new();
    for rival in rivals {
        let start = &record.starts[..1];
        let (prediction, own) = predicted(bench, record, rival, start)?;
        predictions.push(prediction);
        columns.extend(own);
    }
    let difference = &predictions[0] - &predictions[1];
    Ok(beyond(&difference, &columns))
}

/// Returns the prediction of an explanation, and its change per standard deviation of the values
/// along each column of the Cholesky factor of their covariance.
fn predicted(
    bench: &Bench,
    record: &Record,
    (trials, of): Rival<'_>,
    start: &[State],
) -> Result<(DVector<f64>, Vec<DVector<f64>>)> {
    let steps = deviations(of);
    let point = |theta: Vec<f64>| Point {
        theta,
        starts: start.to_vec(),
    };
    let mut points = vec![point(of.fit.point.theta.clone())];
    points.extend(steps.iter().map(|(theta, _)| point(theta.clone())));
    let mut predictor = bench.predictor(trials, record)?;
    let all = predictor.residuals(&points)?;
    // A residual is the reading less the prediction, and the reading is the same for all.
    let mut all = all.into_iter().map(|r| -DVector::from_vec(r));
    let here = all.next().unwrap_or_else(|| DVector::zeros(0));
    let columns = all
        .zip(&steps)
        .map(|(there, (_, share))| (there - &here) / *share);
    Ok((here.clone(), columns.collect()))
}

/// Returns the values of a fit, moved by a standard deviation along each column of the Cholesky
/// factor of their covariance, with the share moved.
///
/// The share is smaller where a whole standard deviation would leave the ranges, and negative in
/// the opposite direction.
fn deviations(of: &Explanation) -> Vec<(Vec<f64>, f64)> {
    let fit = &of.fit;
    let readings = fit.residuals.len().max(1) as f64;
    let covariance = &fit.covariance * (fit.cost / readings).max(1.0);
    let Some(root) = covariance.cholesky() else {
        return Vec::new();
    };
    let root: DMatrix<f64> = root.l();
    let moved = |column: usize, share: f64| {
        let mut theta = fit.point.theta.clone();
        for (k, &i) in fit.free.iter().enumerate() {
            theta[i] += share * root[(k, column)];
        }
        theta
    };
    let is_within = |theta: &[f64]| {
        let pairs = of.unknowns.iter().zip(theta);
        pairs.into_iter().all(|(u, x)| {
            let [low, high] = u.parameter.range;
            (low..=high).contains(x)
        })
    };
    let shares = [1.0, -1.0, 0.1, -0.1, 0.01, -0.01];
    (0..root.ncols())
        .filter_map(|column| {
            let each = shares.iter().map(|&s| (moved(column, s), s));
            each.into_iter().find(|(theta, _)| is_within(theta))
        })
        .collect()
}

/// `d^T (I + K K^T)^-1 d`, by the matrix inversion lemma.
fn beyond(difference: &DVector<f64>, columns: &[DVector<f64>]) -> f64 {
    let whole = difference.norm_squared();
    if columns.is_empty() {
        return whole;
    }
    let k = DMatrix::from_columns(columns);
    let along = k.transpose() * difference;
    let inner = DMatrix::identity(k.ncols(), k.ncols()) + k.transpose() * &k;
    match inner.cholesky() {
        Some(inner) => whole - along.dot(&inner.solve(&along)),
        None => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_value_can_take_away_tells_nothing() {
        let d = DVector::from_vec(vec![3.0, 4.0]);
        assert_eq!(beyond(&d, &[]), 25.0);
        // One value moves the first reading by s standard deviations of the noise: 9 / (1 + s^2) of
        // it remain.
        for s in [0.1, 1.0, 100.0] {
            let column = DVector::from_vec(vec![s, 0.0]);
            let expected = 9.0 / (1.0 + s * s) + 16.0;
            assert!((beyond(&d, &[column]) - expected).abs() < 1e-9, "{s}");
        }
        // Two explanations that may each move it are equivalent to one with the sum of their
        // variances.
        let column = DVector::from_vec(vec![1.0, 0.0]);
        let both = beyond(&d, &[column.clone(), column]);
        assert!((both - (9.0 / 3.0 + 16.0)).abs() < 1e-9);
    }

    #[test]
    fn a_prediction_that_is_no_number_is_no_difference() {
        let d = DVector::from_vec(vec![f64::INFINITY, 0.0]);
        let column = DVector::from_vec(vec![1.0, 0.0]);
        assert!(!beyond(&d, &[column]).is_finite());
    }
}
