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

/// Share of a variance below which what earlier values leave of it is rounding: a millionth of the
/// deviation.
const FLAT: f64 = 1e-12;

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
    let steps = deviations(of, bench.train.readings);
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
/// the opposite direction. `readings` is the number of readings that the values were fitted to.
fn deviations(of: &Explanation, readings: usize) -> Vec<(Vec<f64>, f64)> {
    let fit = &of.fit;
    let left = (fit.cost / readings.max(1) as f64).max(1.0);
    let root = factor(&(&fit.covariance * left));
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
        .filter(|&column| root[(column, column)] != 0.0)
        .filter_map(|column| {
            let each = shares.iter().map(|&s| (moved(column, s), s));
            each.into_iter().find(|(theta, _)| is_within(theta))
        })
        .collect()
}

/// Returns the lower Cholesky factor of a covariance of any rank.
///
/// A column is zero where the earlier values determine its value, and where a value has no
/// variance.
fn factor(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let n = covariance.nrows();
    let mut root = DMatrix::<f64>::zeros(n, n);
    for j in 0..n {
        let own = covariance[(j, j)];
        let pivot = own - root.row(j).norm_squared();
        if pivot <= FLAT * own {
            continue;
        }
        let pivot = pivot.sqrt();
        root[(j, j)] = pivot;
        for i in j + 1..n {
            let earlier: f64 = (0..j).map(|k| root[(i, k)] * root[(j, k)]).sum();
            root[(i, j)] = (covariance[(i, j)] - earlier) / pivot;
        }
    }
    root
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
    use asid_core::Parameter;
    use asid_core::parameter::Scale;

    use super::*;

    /// An explanation with values at 0 and ranges from -9 to 9, whose fit leaves a sum of squares.
    fn explanation(covariance: DMatrix<f64>, cost: f64) -> Explanation {
        let parameter = |i: usize| Parameter {
            name: format!("value {i}"),
            targets: Vec::new(),
            range: [-9.0, 9.0],
            scale: Scale::Linear,
            unit: String::new(),
        };
        let parameters: Vec<Parameter> = (0..covariance.nrows()).map(parameter).collect();
        let mut explanation = Explanation::of_parameters(&parameters, covariance, 100);
        explanation.fit.cost = cost;
        explanation
    }

    /// Symptom: with a value that no reading shows, such as an axis that a sensor does not have,
    /// no value was fitted again. Cause: a covariance with a zero row has no Cholesky
    /// decomposition.
    #[test]
    fn values_beside_one_that_does_not_show_are_fitted_again() {
        let c = DMatrix::from_row_slice(3, 3, &[4.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 1.25]);
        let steps = deviations(&explanation(c, 10.0), 10);
        let expected = [(vec![2.0, 0.0, 1.0], 1.0), (vec![0.0, 0.0, 0.5], 1.0)];
        assert_eq!(steps, expected);
        // Two values of which the logs show only the sum.
        let c = DMatrix::from_element(2, 2, 4.0);
        let steps = deviations(&explanation(c, 10.0), 10);
        assert_eq!(steps, [(vec![2.0, 2.0], 1.0)]);
    }

    /// Symptom: a fit to logs with gaps looked better than it is. Cause: its sum of squares was
    /// divided by the number of rows, with those that lack the reading.
    #[test]
    fn a_misfit_is_per_reading_that_is_there() {
        let one = || explanation(DMatrix::from_element(1, 1, 1.0), 40.0);
        assert_eq!(deviations(&one(), 10), [(vec![2.0], 1.0)]);
        assert_eq!(deviations(&one(), 40), [(vec![1.0], 1.0)]);
    }

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
