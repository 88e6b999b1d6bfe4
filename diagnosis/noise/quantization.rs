//! Quantization: the step of a sensor whose readings are multiples of one.

use super::{median, readings};
use crate::data::Logs;

/// Rounding of the readings in a log, relative to their step, up to which they still count as steps.
const ROUNDING: f64 = 0.05;

/// Step of a sensor whose readings are multiples of one; 0 where they are not.
#[must_use]
pub fn step(logs: &Logs, sensor: usize) -> f64 {
    let mut steps: Vec<f64> = readings(logs, sensor)
        .into_iter()
        .filter_map(step_of)
        .collect();
    median(&mut steps).unwrap_or(0.0)
}

/// Step that some values are multiples of, but for one common shift and rounding. Multiples are counted from
/// neighbour to neighbour, so that a rounded step does not add up.
fn step_of(mut values: Vec<f64>) -> Option<f64> {
    let count = values.len();
    values.sort_by(f64::total_cmp);
    values.dedup();
    // Few distinct values for many readings, all on one grid.
    if values.len() < 3 || 2 * values.len() >= count {
        return None;
    }
    let gaps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
    let typical = median(&mut gaps.clone())?;
    let smallest = gaps.iter().copied().filter(|g| *g > 0.3 * typical);
    let first = smallest.fold(f64::INFINITY, f64::min);
    let (mut at, mut products, mut squares) = (0.0, 0.0, 0.0);
    let mut multiples = vec![0.0];
    for (gap, value) in gaps.iter().zip(&values[1..]) {
        at += (gap / first).round();
        products += at * (value - values[0]);
        squares += at * at;
        multiples.push(at);
    }
    let step = products / squares;
    let on_grid = |(v, k): (&f64, &f64)| (v - values[0] - k * step).abs() < ROUNDING * step;
    let all = values.iter().zip(&multiples).all(on_grid);
    (all && step.is_finite() && step > 0.0).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_found_though_the_log_rounds_its_readings() {
        // An encoder of 4096 steps a turn, written with six digits, over 500 steps: multiples of the rounded step would
        // be off by a third of one at the end.
        let step = std::f64::consts::TAU / 4096.0;
        let reading = |k: u32| (1e6 * (0.31 + step * f64::from(k))).round() / 1e6;
        let values: Vec<f64> = (0..4000).map(|i| reading((i * 7) % 501)).collect();
        assert!((step_of(values).unwrap() - step).abs() < 1e-8);
    }

    #[test]
    fn a_reading_without_steps_has_none() {
        let smooth: Vec<f64> = (0..4000).map(|i| (0.01 * f64::from(i)).sin()).collect();
        assert!(step_of(smooth).is_none());
    }
}
