//! Values at which the fit of the study's parameters begins.
//!
//! Without contact they begin as given. With contact, neither derivatives nor segments help. A
//! contact that sticks in the model, or slides too far, has no derivative that shows how wrong its
//! friction is. Segments of such a model begin where that friction has put the bodies. Replays of
//! whole logs do show it. So each parameter begins at the one of a few values over its range whose
//! replays leave least.

use asid_core::Result;

use crate::bench::Bench;
use crate::fit::cost;
use crate::predict::Point;

use super::rows::Rows;

/// Values over the range of a parameter that are tried. A fit continues from the best, and its
/// derivatives reach about a tenth of a range.
const TRIED: usize = 5;

/// Values to begin with: `nominal` if no bodies touch.
///
/// # Errors
/// When a rollout fails.
pub(super) fn begin_values(bench: &Bench, rows: &Rows, nominal: &[f64]) -> Result<Vec<f64>> {
    let mut values = nominal.to_vec();
    if !rows.touches() || values.is_empty() {
        return Ok(values);
    }
    let mut predictor = bench.predictor(&[], &bench.train)?;
    for (i, parameter) in bench.parameters.iter().enumerate() {
        let places = (0..TRIED).map(|k| (k as f64 + 0.5) / TRIED as f64);
        let others = places.map(|u| parameter.from_unit(u));
        let tried: Vec<f64> = std::iter::once(values[i]).chain(others).collect();
        let point = |&value: &f64| {
            let mut theta = values.clone();
            theta[i] = value;
            Point {
                theta,
                starts: bench.train.starts.clone(),
            }
        };
        let points: Vec<Point> = tried.iter().map(point).collect();
        let left = predictor.residuals(&points)?;
        let left = left.iter().map(|residuals| cost(residuals)).zip(&tried);
        if let Some((_, &best)) = left.min_by(|a, b| a.0.total_cmp(&b.0)) {
            values[i] = best;
        }
    }
    Ok(values)
}
