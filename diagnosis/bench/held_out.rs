//! What a replay leaves of the logs held out beyond what their starts leave open.
//!
//! A start that was fitted on the first tenth of a log is known to some covariance, and a small error of it grows over the rest of the log.
//! Residuals are therefore measured by the covariance that they have if the model is right, `I + J S J'` in units of the
//! noise, with `J` their derivatives in the start and `S` the covariance of the start by the first tenth. By Woodbury's identity their squared
//! Mahalanobis distance is `r'r - r'J (J_h'J_h + J'J)^-1 J'r`, with `J_h` the derivatives of the first tenth.

use std::ops::Range;

use asid_core::Result;
use nalgebra::{DMatrix, DVector};

use crate::fit::cost;
use crate::linearise::{Differences, linearise};
use crate::normal::inverse;
use crate::predict::Point;

use super::{Bench, Explanation, Trial};

/// Physics steps of all logs held out times open coordinates of their starts, beyond which starts count as known: tens of seconds
/// of one core, in machines of many joints.
const AFFORDABLE: usize = 500_000;

/// Squared Mahalanobis distance of the readings held out from those that an explanation predicts, by the noise and by the covariance of the
/// starts that were fitted; infinite where a replay diverges.
///
/// # Errors
/// When a rollout fails.
pub fn misfit(bench: &Bench, trials: &[Trial<'_>], of: &Explanation) -> Result<f64> {
    let logs = &bench.test.logs;
    let steps = logs.episodes.iter().map(|e| e.plan.physics_steps());
    if bench.open.is_empty() || steps.sum::<usize>() * bench.open.len() > AFFORDABLE {
        return Ok(of.held_out);
    }
    let mut unknowns = bench.unknowns(trials);
    unknowns.iter_mut().for_each(|u| u.free = false);
    let point = Point {
        theta: of.fit.point.theta.clone(),
        starts: of.held_starts.clone(),
    };
    let line = linearise(
        &mut bench.predictor(trials, &bench.test)?,
        bench.layout(),
        &unknowns,
        &point,
        &bench.open,
        &mut Differences::new(unknowns.len(), bench.open.len()),
    )?;
    let entries = logs.entries.len();
    let of_episode = |e: usize| {
        let head = bench.head.logs.episodes[e].plan.rows() * entries;
        let rows = logs.offset(e)..logs.offset(e + 1);
        distance(&line.residuals, &line.start_columns, rows, head)
    };
    Ok((0..logs.episodes.len()).map(of_episode).sum())
}

/// Squared Mahalanobis distance of the residuals of one episode after its first `head`.
fn distance(residuals: &[f64], columns: &[Vec<f64>], rows: Range<usize>, head: usize) -> f64 {
    let rest = rows.start + head..rows.end;
    let square = cost(&residuals[rest.clone()]);
    if !square.is_finite() {
        return f64::INFINITY;
    }
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(x, y)| x * y).sum() };
    let m = columns.len();
    let information = DMatrix::from_fn(m, m, |i, j| {
        dot(&columns[i][rows.clone()], &columns[j][rows.clone()])
    });
    let along = DVector::from_fn(m, |i, _| {
        dot(&columns[i][rest.clone()], &residuals[rest.clone()])
    });
    (square - along.dot(&(inverse(&information, 1e-12) * &along))).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_that_grows_from_a_fitted_start_is_weighed_by_its_covariance() {
        // A speed that is fitted on one row of slope 1, and two rows after it, of slopes 2 and 3: r' (I + J J')^-1 r by hand.
        let columns = [vec![1.0, 2.0, 3.0]];
        let residuals = [0.1, 4.0, 6.0];
        let covariance = nalgebra::Matrix2::new(5.0, 6.0, 6.0, 10.0);
        let r = nalgebra::Vector2::new(4.0, 6.0);
        let by_hand = (r.transpose() * covariance.try_inverse().expect("it is regular") * r)[0];
        let found = distance(&residuals, &columns, 0..3, 1);
        assert!((found - by_hand).abs() < 1e-9, "{found} {by_hand}");
        assert!(found < 52.0 / 10.0);
        // What no start can make stays.
        let across = distance(&[0.0, 3.0, -2.0], &columns, 0..3, 1);
        assert!((across - 13.0).abs() < 1e-9, "{across}");
        let diverged = distance(&[0.0, f64::INFINITY, 1.0], &columns, 0..3, 1);
        assert!(diverged.is_infinite());
    }
}
