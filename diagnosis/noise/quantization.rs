//! Quantization: the step of a sensor whose readings are multiples of one, and what noise there was before the rounding.

use std::f64::consts::PI;

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

/// Steps that a motion spans, at least and at most, where they are coarse: fewer are a sensor at rest, and more than 16, four bits, an encoder that
/// resolves the motion, whose rounding is its noise.
const COARSE: [f64; 2] = [4.0, 16.0];

/// Deviation of the noise before the rounding, for a sensor that resolves its motion into no more than 16 steps; `None` for any other.
///
/// While a motion of `v` a row passes the edge of a step, noise of deviation `s` takes the reading back and forth. It changes with
/// probability `2 p (1 - p)` from row to row, with `p` the normal distribution function of the distance from the edge over `s`: `2 s / (v sqrt(pi))`
/// times an edge where that is more than once. There are `v / step` edges a row, so that of the share of rows at which the reading changes
/// `s = share step sqrt(pi) / 2` follows. Less noise changes a reading no less than once an edge: this is the most that there can have been.
#[must_use]
pub fn noise_before(logs: &Logs, sensor: usize) -> Option<f64> {
    let step = step(logs, sensor);
    let columns = readings(logs, sensor);
    let span = |column: &Vec<f64>| {
        let column = column.iter().copied();
        column.clone().fold(f64::NEG_INFINITY, f64::max) - column.fold(f64::INFINITY, f64::min)
    };
    let spans = columns.iter().map(span).fold(0.0, f64::max) / step;
    if !(COARSE[0]..=COARSE[1]).contains(&spans.round()) {
        return None;
    }
    let (mut rows, mut changes) = (0, 0);
    for column in &columns {
        rows += column.len();
        changes += column.windows(2).filter(|w| w[0] != w[1]).count();
    }
    Some(changes as f64 / rows as f64 * step * PI.sqrt() / 2.0)
}

/// Step that some values are multiples of, but for one common shift and rounding. Multiples are counted from
/// neighbour to neighbour, so that a rounded step does not add up.
fn step_of(mut values: Vec<f64>) -> Option<f64> {
    let count = values.len();
    values.sort_by(f64::total_cmp);
    values.dedup();
    // Few distinct values for many readings, all on one grid. Two are one: of a joint that hardly leaves a step of its encoder.
    if values.len() < 2 || 2 * values.len() >= count {
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
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::Rng as _;

    use crate::data::tests::{log, plant};

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
    fn the_noise_before_a_coarse_rounding_is_told_by_how_often_readings_change() {
        // A slide that goes from 0 to 8 steps of 1 m in 8000 rows, with noise of 0.05 m.
        let mut rng = asid_core::Streams::new(1).stream("readings");
        let noise = rand_distr::Normal::new(0.0, 0.05).unwrap();
        let places: Vec<f64> = (0..8000)
            .map(|k| (0.001 * f64::from(k) + rng.sample(noise)).round())
            .collect();
        let of = |places: &[f64]| {
            let logs = vec![log("a", places)];
            noise_before(
                &Logs::new(&plant(), &["place".to_owned()], logs).unwrap(),
                0,
            )
        };
        let found = of(&places).expect("eight steps are coarse");
        assert!((found / 0.05 - 1.0).abs() < 0.2, "{found}");
        // Without noise it is no more than how far the slide goes in a row.
        let clean: Vec<f64> = (0..8000).map(|k| (0.001 * f64::from(k)).round()).collect();
        assert!(of(&clean).expect("they are coarse") < 0.001);
        let fine: Vec<f64> = (0..8000).map(|k| (0.01 * f64::from(k)).round()).collect();
        assert_eq!(of(&fine), None);
    }

    #[test]
    fn a_joint_that_hardly_leaves_one_step_of_its_encoder_is_read_to_that_step() {
        let values: Vec<f64> = (0..800)
            .map(|i| if i % 200 < 3 { 0.25 } else { 0.375 })
            .collect();
        assert!((step_of(values).unwrap() - 0.125).abs() < 1e-12);
        assert_eq!(step_of(vec![0.25; 800]), None);
    }

    #[test]
    fn a_reading_without_steps_has_none() {
        let smooth: Vec<f64> = (0..4000).map(|i| (0.01 * f64::from(i)).sin()).collect();
        assert!(step_of(smooth).is_none());
    }
}
