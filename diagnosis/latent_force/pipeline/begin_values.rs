//! Values at which the fit of the study's parameters begins.
//!
//! Without contact they begin as given. With contact, neither derivatives nor segments help. A
//! contact that sticks in the model, or slides too far, has no derivative that shows how wrong its
//! friction is. Segments of such a model begin where that friction has put the bodies. Replays of
//! whole logs do show it. So each parameter begins at the one of a few values over its range whose
//! replays leave least.
//!
//! A parameter of two values has no derivative at all. Replays choose its value, with and without
//! contact, and no fit moves it.

use asid_core::{Parameter, Result};

use crate::bench::Bench;
use crate::fit::cost;
use crate::predict::Point;

use super::rows::Rows;

/// Values over the range of a parameter that are tried. A fit continues from the best, and its
/// derivatives reach about a tenth of a range.
const TRIED: usize = 5;

/// Values of a parameter that are tried: the only two that it has, or some over its range.
fn others(parameter: &Parameter) -> impl Iterator<Item = f64> {
    let n = if parameter.is_binary() { 2 } else { TRIED };
    (0..n).map(move |k| parameter.from_unit((k as f64 + 0.5) / n as f64))
}

/// Values to begin with: `nominal` if no bodies touch, except for parameters of two values.
///
/// # Errors
/// When a rollout fails.
pub(super) fn begin_values(bench: &Bench, rows: &Rows, nominal: &[f64]) -> Result<Vec<f64>> {
    let mut values = nominal.to_vec();
    let all = bench.parameters.iter().enumerate();
    let open: Vec<_> = all
        .filter(|(_, p)| rows.touches() || p.is_binary())
        .collect();
    if open.is_empty() {
        return Ok(values);
    }
    let mut predictor = bench.predictor(&[], &bench.train)?;
    for (i, parameter) in open {
        let tried: Vec<f64> = std::iter::once(values[i])
            .chain(others(parameter))
            .collect();
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
