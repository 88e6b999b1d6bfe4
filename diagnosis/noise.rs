//! The noise floor of each sensor, estimated from the record itself.
//!
//! What a model leaves is smooth where the model is wrong and rough where the sensor is
//! noisy: third differences of consecutive residuals remove the first and keep the second.
//! For white noise of deviation s they have the deviation s sqrt(20). The median of their
//! magnitudes is blind to the few moments (impacts) at which the residual is not smooth.

use crate::data::Logs;

/// Ratio of a normal variable's deviation to the median of its magnitude.
pub const NORMAL: f64 = 1.482_602_218_505_602;

/// Estimates the noise of each sensor from residuals `logged - predicted` in the sensors'
/// units (`rows x entries`, NaN where missing), one array an episode. A sensor whose
/// readings come in steps has at least the deviation of a step, step / sqrt(12).
#[must_use]
pub fn estimate(logs: &Logs, residuals: &[Vec<f64>]) -> Vec<f64> {
    let n = logs.entries.len();
    (0..logs.sensors.len())
        .map(|sensor| {
            let mut differences = Vec::new();
            let entries = logs.entries.iter().enumerate();
            for (j, _) in entries.filter(|(_, e)| e.sensor == sensor) {
                for episode in residuals {
                    let series: Vec<f64> = episode.iter().skip(j).step_by(n).copied().collect();
                    differences.extend(
                        series
                            .windows(4)
                            .map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs())
                            .filter(|d| d.is_finite()),
                    );
                }
            }
            let rough = median(&mut differences).map_or(0.0, |m| NORMAL * m / 20.0_f64.sqrt());
            rough
                .max(step(logs, sensor) / 12.0_f64.sqrt())
                .max(smallest(logs, sensor))
        })
        .collect()
}

/// Median, `None` of nothing.
#[must_use]
pub fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Readings of a sensor, component after component.
fn readings(logs: &Logs, sensor: usize) -> Vec<Vec<f64>> {
    let width = logs.width();
    let mut at = 0;
    for s in &logs.sensors[..sensor] {
        let rotation = s.rotation;
        let entries = logs.entries.iter();
        let len = entries
            .filter(|e| logs.sensors[e.sensor].name == s.name)
            .count();
        at += if rotation { 4 } else { len };
    }
    let own = logs.entries.iter().filter(|e| e.sensor == sensor).count();
    let own = if logs.sensors[sensor].rotation {
        4
    } else {
        own
    };
    (at..at + own)
        .map(|c| {
            let episodes = logs.episodes.iter();
            episodes
                .flat_map(|e| e.readings.iter().skip(c).step_by(width).copied())
                .filter(|x| x.is_finite())
                .collect()
        })
        .collect()
}

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

/// A deviation above 0 for a sensor without any noise: a millionth of its spread.
fn smallest(logs: &Logs, sensor: usize) -> f64 {
    let spread = readings(logs, sensor)
        .iter()
        .map(|v| {
            let high = v.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let low = v.iter().copied().fold(f64::INFINITY, f64::min);
            high - low
        })
        .fold(0.0, f64::max);
    (1e-6 * spread).max(1e-12)
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
