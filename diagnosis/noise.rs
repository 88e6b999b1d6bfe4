//! The noise floor of each sensor, estimated from the record itself.
//!
//! What a model leaves is smooth where the model is wrong and rough where the sensor is
//! noisy: third differences of residuals remove the first and keep the second.
//! For white noise of deviation s they have the deviation s sqrt(20). The median of their
//! magnitudes is blind to the few moments (impacts) at which the residual is not smooth.
//!
//! Two things make them small although the noise is not. A reading that only repeats the one before (an encoder at rest, a sensor
//! that is logged faster than it reads) has none of its own: such rows are passed over. And noise that was filtered
//! differs little from row to row: third differences over two and four rows show it ([`Noise::correlation`]), for those of
//! such noise grow by at most two from row to row, and those of a smooth residual by 64.
//!
//! Replays are measured in units of it ([`crate::prepare`] takes it from readings or residuals, [`crate::diagnose`] once more from what the
//! best explanation leaves, [`crate::checks`] asks whether it is white). For the missing force it is where the variances of the readings begin, and
//! what bounds them (`latent_force/estimate/variances.rs`). A study's own `noise` overrides it.

use crate::data::Logs;

/// Ratio of a normal variable's deviation to the median of its magnitude.
pub const NORMAL: f64 = 1.482_602_218_505_602;
/// Squared deviation of the third differences of white noise of deviation 1: 1 + 9 + 9 + 1.
const WHITE: f64 = 20.0;
/// Growth of squared third differences from one row to two up to which noise is white. Over a thousand rows it scatters by
/// a tenth about 1.
const GROWS: f64 = 1.2;
/// The same from which on what is rough is no noise but the residual itself. Correlated noise grows by at most two, a smooth
/// residual by 64.
const SMOOTH: f64 = 4.0;
/// Largest correlation from row to row that is called noise: slower changes are the model's.
const SLOWEST: f64 = 0.97;
/// Third differences that a correlation is told from, at least.
const FEWEST: usize = 200;
/// Rows that a third difference spans at most, where readings are missing: over more of them a residual is no parabola.
const SPAN: usize = 12;

/// Noise of one sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Standard deviation, in the sensor's unit.
    pub deviation: f64,
    /// Correlation from one reading to the next; 0 for white noise.
    pub correlation: f64,
}

/// Estimates the deviation of each sensor's noise; see [`describe`].
#[must_use]
pub fn estimate(logs: &Logs, residuals: &[Vec<f64>]) -> Vec<f64> {
    let all = describe(logs, residuals).into_iter();
    all.map(|n| n.deviation).collect()
}

/// Estimates the noise of each sensor from residuals `logged - predicted` in the sensors'
/// units (`rows x entries`, NaN where missing), one array an episode. A sensor whose
/// readings come in steps has at least the deviation of a step, step / sqrt(12).
#[must_use]
pub fn describe(logs: &Logs, residuals: &[Vec<f64>]) -> Vec<Noise> {
    let n = logs.entries.len();
    (0..logs.sensors.len())
        .map(|sensor| {
            let mut differences: [Vec<f64>; STRIDES.len()] = Default::default();
            let entries = logs.entries.iter().enumerate();
            for (j, entry) in entries.filter(|(_, e)| e.sensor == sensor) {
                for (e, residual) in residuals.iter().enumerate() {
                    let repeats = repeats(logs, e, sensor, entry.component);
                    let time = &logs.episodes[e].episode.time;
                    let series: Vec<(usize, f64, f64)> = (residual.iter().skip(j).step_by(n))
                        .enumerate()
                        .filter(|(k, x)| x.is_finite() && !repeats[*k])
                        .map(|(k, x)| (k, time[k], *x))
                        .collect();
                    for (stride, found) in STRIDES.iter().zip(&mut differences) {
                        third_differences(&series, *stride, found);
                    }
                }
            }
            let of_differences = from_differences(&mut differences);
            let floor = (step(logs, sensor) / 12.0_f64.sqrt()).max(smallest(logs, sensor));
            if of_differences.deviation >= floor {
                of_differences
            } else {
                Noise {
                    deviation: floor,
                    correlation: 0.0,
                }
            }
        })
        .collect()
}

/// Rows over which third differences are taken.
const STRIDES: [usize; 3] = [1, 2, 4];

/// Magnitudes of the third differences of a series (row, time, value) over some readings, scaled so that those of white noise of
/// deviation 1 have the deviation sqrt(20), whatever the times between.
fn third_differences(series: &[(usize, f64, f64)], stride: usize, found: &mut Vec<f64>) {
    for i in 0..series.len().saturating_sub(3 * stride) {
        let four = [0, 1, 2, 3].map(|k| series[i + k * stride]);
        if four[3].0 - four[0].0 > SPAN * stride {
            continue;
        }
        // Weights of the divided difference, which vanishes for parabolas.
        let weight = |k: usize| -> f64 {
            let others = (0..4).filter(|&l| l != k);
            others.map(|l| 1.0 / (four[k].1 - four[l].1)).product()
        };
        let weights = [0, 1, 2, 3].map(weight);
        let norm = weights.iter().map(|w| w * w).sum::<f64>().sqrt();
        let sum: f64 = weights.iter().zip(&four).map(|(w, p)| w * p.2).sum();
        let difference = (WHITE.sqrt() * sum / norm).abs();
        if difference.is_finite() {
            found.push(difference);
        }
    }
}

/// Squared deviation of the third differences of noise of deviation 1 with a correlation between its readings.
fn squared(correlation: f64) -> f64 {
    let r = correlation;
    WHITE + 2.0 * (-15.0 * r + 6.0 * r * r - r * r * r)
}

/// Noise whose third differences over one, two and four rows are these: correlated noise and a smooth rest.
fn from_differences(differences: &mut [Vec<f64>; STRIDES.len()]) -> Noise {
    let counts = differences.iter().map(Vec::len).min().unwrap_or(0);
    let [one, two, four] = [0, 1, 2].map(|i| {
        let typical = median(&mut differences[i]).unwrap_or(0.0);
        (NORMAL * typical).powi(2)
    });
    let white = Noise {
        deviation: (one / WHITE).sqrt(),
        correlation: 0.0,
    };
    if counts < FEWEST || one <= 0.0 || two < GROWS * one || two > SMOOTH * one {
        return white;
    }
    // For a correlation, noise and rest follow from the first two; the third says which correlation it is.
    let mut best = (f64::INFINITY, white);
    for k in 1..=100 {
        let r = SLOWEST * f64::from(k) / 100.0;
        let (a, b, c) = (squared(r), squared(r * r), squared(r.powi(4)));
        // one = v a + s, two = v b + 64 s, for third differences of a smooth rest grow by 8.
        let v = (64.0 * one - two) / (64.0 * a - b);
        let s = (one - v * a).max(0.0);
        let miss = ((v * c + 4096.0 * s) / four).ln().abs() + ((v * b + 64.0 * s) / two).ln().abs();
        if v > 0.0 && miss < best.0 {
            best = (
                miss,
                Noise {
                    deviation: v.sqrt(),
                    correlation: r,
                },
            );
        }
    }
    best.1
}

/// Whether each row of an episode only repeats the reading of the row before.
fn repeats(logs: &Logs, episode: usize, sensor: usize, component: usize) -> Vec<bool> {
    let e = &logs.episodes[episode];
    let rows = e.plan.rows();
    let Some(range) = e.episode.channel(&logs.sensors[sensor].name) else {
        return vec![false; rows];
    };
    // All entries of an orientation are read at once.
    let columns = if logs.sensors[sensor].rotation {
        range
    } else {
        range.start + component..range.start + component + 1
    };
    let mut out = vec![false; rows];
    for k in 1..rows {
        let (a, b) = (e.episode.reading(k - 1), e.episode.reading(k));
        out[k] = columns.clone().all(|c| a[c] == b[c]);
    }
    out
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
pub(crate) fn readings(logs: &Logs, sensor: usize) -> Vec<Vec<f64>> {
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

    /// Noise of deviation 1 with a correlation from row to row, from sums of uniform numbers.
    fn coloured(correlation: f64, rows: usize) -> Vec<f64> {
        let mut state = 12345_u64;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut last = 0.0;
        (0..rows)
            .map(|_| {
                let fresh: f64 = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                last = correlation * last + (1.0 - correlation * correlation).sqrt() * fresh;
                last
            })
            .collect()
    }

    fn noise_of(values: impl Iterator<Item = f64>) -> Noise {
        let series: Vec<(usize, f64, f64)> = values
            .enumerate()
            .map(|(k, x)| (k, 0.01 * k as f64, x))
            .collect();
        let mut differences: [Vec<f64>; 3] = Default::default();
        for (stride, found) in STRIDES.iter().zip(&mut differences) {
            third_differences(&series, *stride, found);
        }
        from_differences(&mut differences)
    }

    #[test]
    fn filtered_noise_has_its_own_deviation() {
        // With a tenth for the scatter of an estimate whose correlation is estimated beside it, more where it is strong.
        for (correlation, tolerance) in [
            (0.0, 0.05),
            (0.3, 0.1),
            (0.5, 0.1),
            (0.8, 0.15),
            (0.9, 0.25),
        ] {
            let noise = noise_of(coloured(correlation, 20_000).into_iter());
            assert!(
                (noise.deviation - 1.0).abs() < tolerance,
                "{correlation}: {noise:?}"
            );
        }
    }

    #[test]
    fn a_smooth_residual_is_no_noise() {
        // White noise of deviation 1 on a swing a hundred times as large.
        let swing = |k: usize| 100.0 * (0.01 * k as f64).sin();
        let noise = noise_of(
            coloured(0.0, 5000)
                .into_iter()
                .enumerate()
                .map(|(k, x)| x + swing(k)),
        );
        assert!((noise.deviation - 1.0).abs() < 0.08, "{noise:?}");
        assert_eq!(noise.correlation, 0.0);
    }

    #[test]
    fn two_missing_readings_of_three_leave_the_noise_as_it_is() {
        let series: Vec<(usize, f64, f64)> = coloured(0.0, 9000)
            .into_iter()
            .enumerate()
            .filter(|(k, _)| (k * 7919) % 3 == 0 || (k * 104_729) % 11 == 0)
            .map(|(k, x)| (k, 0.01 * k as f64, x))
            .collect();
        let mut found = Vec::new();
        third_differences(&series, 1, &mut found);
        let deviation = NORMAL * median(&mut found).unwrap() / WHITE.sqrt();
        assert!((deviation - 1.0).abs() < 0.06, "{deviation}");
    }

    #[test]
    fn a_reading_without_steps_has_none() {
        let smooth: Vec<f64> = (0..4000).map(|i| (0.01 * f64::from(i)).sin()).collect();
        assert!(step_of(smooth).is_none());
    }
}
