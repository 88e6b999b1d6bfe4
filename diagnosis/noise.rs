//! The noise floor of each sensor, estimated from the record itself.
//!
//! Residuals are smooth where the model is wrong and rough where the sensor is noisy. Third
//! differences of residuals remove the former and keep the latter. For white noise of standard
//! deviation s they have the standard deviation s sqrt(20). The median of their magnitudes ignores
//! the few moments (impacts) at which the residual is not smooth.
//!
//! Two things make the differences small although the noise is not. A reading that only repeats the
//! one before (an encoder at rest, a sensor logged faster than it reads) has no noise of its own:
//! such rows are skipped. Filtered noise differs little from row to row: third differences over
//! more rows show it ([`Noise::correlation`]).
//!
//! Gaps of replays are in units of this noise. [`crate::prepare`] takes it from readings or
//! residuals, [`crate::diagnose`] once more from the residuals of the best explanation, and
//! [`crate::checks`] checks whether it is white. For the missing force it is the initial value and
//! the bound of the readings' variances (`latent_force/estimate/variances.rs`). A study's own
//! `noise` overrides it.

mod quantization;

use asid_readings::noise::ThirdDifferences;

use crate::data::Logs;

pub use asid_readings::noise::{NORMAL, Noise, median};
pub use quantization::{noise_before, step};

/// Estimates the standard deviation of each sensor's noise; see [`describe`].
#[must_use]
pub fn estimate(logs: &Logs, residuals: &[Vec<f64>]) -> Vec<f64> {
    let all = describe(logs, residuals).into_iter();
    all.map(|n| n.deviation).collect()
}

/// Estimates the noise of each sensor from residuals `logged - predicted`, one array per episode.
///
/// Residuals are in the sensors' units (`rows x entries`, NaN where missing). A sensor whose
/// readings come in steps has at least the standard deviation of the rounding, step / sqrt(12). A
/// sensor with coarse steps has the noise before the rounding, since coarse rounding is an effect.
#[must_use]
pub fn describe(logs: &Logs, residuals: &[Vec<f64>]) -> Vec<Noise> {
    let n = logs.entries.len();
    (0..logs.sensors.len())
        .map(|sensor| {
            let least = smallest(logs, sensor);
            if let Some(before) = noise_before(logs, sensor) {
                return Noise::white(before.max(least));
            }
            let mut differences = ThirdDifferences::default();
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
                    differences.add(&series);
                }
            }
            let of_differences = differences.noise();
            let floor = (step(logs, sensor) / 12.0_f64.sqrt()).max(least);
            if of_differences.deviation >= floor {
                of_differences
            } else {
                Noise::white(floor)
            }
        })
        .collect()
}

/// Returns whether each row of an episode only repeats the reading of the row before.
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

/// Returns the readings of a sensor, component after component.
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

/// Returns a positive standard deviation for a sensor without any noise: a millionth of its range
/// of readings.
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
    use rand::Rng as _;

    use super::*;
    use crate::data::tests::{log, plant};

    /// Symptom: the gap of a right model was a thousand with a sensor that is logged seven times as
    /// fast as it reads.
    ///
    /// Cause: readings that repeat the one before are left out, and a third difference spanned 12
    /// rows at most. None was left, and the noise was the floor for a sensor without any.
    #[test]
    fn a_sensor_that_is_logged_faster_than_it_reads_has_the_noise_of_its_readings() {
        let mut rng = asid_core::Streams::new(1).stream("readings");
        let noise = rand_distr::Normal::new(0.0, 0.01).unwrap();
        let read: Vec<f64> = (0..3000).map(|_| rng.sample(noise)).collect();
        let held: Vec<f64> = read.iter().flat_map(|x| [*x; 7]).collect();
        let logs = Logs::new(&plant(), &["place".to_owned()], vec![log("a", &held)]).unwrap();
        let found = describe(&logs, &[held])[0];
        assert!((found.deviation / 0.01 - 1.0).abs() < 0.12, "{found:?}");
    }
}
