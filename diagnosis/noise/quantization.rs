//! Quantization: the step of a sensor whose readings are multiples of one, and the noise before the
//! rounding.

use std::f64::consts::PI;

use super::{median, readings};
use crate::data::Logs;

/// Largest rounding error of the log's numbers, relative to the step, for which readings still
/// count as steps.
const ROUNDING: f64 = 0.05;

/// Returns the step of a sensor whose readings are multiples of one; 0 if they are not.
#[must_use]
pub fn step(logs: &Logs, sensor: usize) -> f64 {
    let mut steps: Vec<f64> = readings(logs, sensor)
        .into_iter()
        .filter_map(step_of)
        .collect();
    median(&mut steps).unwrap_or(0.0)
}

/// Fewest and most steps that a motion spans if they are coarse.
///
/// A sensor at rest spans fewer. An encoder that spans more than 16, four bits, resolves the
/// motion, and its rounding is its noise.
const COARSE: [f64; 2] = [4.0, 16.0];

/// Returns the standard deviation of the noise before the rounding, for a sensor whose motion spans
/// 4 to 16 steps; `None` for any other.
///
/// While a motion of `v` per row passes the edge of a step, noise of standard deviation `s` moves
/// the reading back and forth. The reading changes from row to row with probability `2 p (1 - p)`.
/// `p` is the normal distribution function of the distance from the edge over `s`. That is `2 s /
/// (v sqrt(pi))` changes per edge, if it is more than one. There are `v / step` edges per row. The
/// share of rows at which the reading changes therefore gives `s = share step sqrt(pi) / 2`. With
/// less noise a reading still changes once per edge, so this is an upper bound.
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

/// Returns the step of which some values are multiples, up to a common shift and rounding.
///
/// Multiples are counted from neighbour to neighbour, so that the rounding of the step does not
/// accumulate.
fn step_of(mut values: Vec<f64>) -> Option<f64> {
    let count = values.len();
    values.sort_by(f64::total_cmp);
    values.dedup();
    // There are few distinct values for many readings, all on one grid. Two values are one step, of
    // a joint that hardly leaves a step of its encoder.
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
        // An encoder of 4096 steps per turn, written with six digits, over 500 steps: multiples of
        // the rounded step would be off by a third of a step at the end.
        let step = std::f64::consts::TAU / 4096.0;
        let reading = |k: u32| (1e6 * (0.31 + step * f64::from(k))).round() / 1e6;
        let values: Vec<f64> = (0..4000).map(|i| reading((i * 7) % 501)).collect();
        assert!((step_of(values).unwrap() - step).abs() < 1e-8);
    }

    #[test]
    fn the_noise_before_a_coarse_rounding_is_told_by_how_often_readings_change() {
        // A slide that moves from 0 to 8 steps of 1 m in 8000 rows, with noise of 0.05 m.
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
        // Without noise the estimate is at most what the slide moves per row.
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
