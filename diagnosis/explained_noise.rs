//! The noise as estimated from the residuals of the best explanation, which hide the least of it.

use asid_core::Result;

use crate::bench::Bench;
use crate::candidate::Candidate;
use crate::data::Logs;
use crate::findings::{Findings, trials};
use crate::fit::{Fit, cost};
use crate::noise::{estimate, step};
use crate::prepare::reading_noise;
use crate::study::Study;

/// Ratio of the residuals' standard deviation to that from the readings alone, from which on the
/// former is used.
///
/// Two estimates of white noise differ by a few percent, those of slow noise by a third and more.
const SLOW: f64 = 1.2;

/// Noise of a sensor from the residuals, and the most that its readings allow.
struct Left {
    deviation: f64,
    most: f64,
}

/// Uses the noise from the best explanation's residuals for sensors where it is larger than from
/// the readings alone.
///
/// Noise that is slow compared with the motion shows its size only without the motion. It is at
/// most what the readings allow. Rounding errors are correlated from row to row as well, but their
/// size is known.
///
/// # Errors
/// When a rollout fails.
pub fn with_slow_noise(
    bench: &mut Bench,
    study: &Study,
    candidates: &[Candidate],
    findings: &mut Findings,
) -> Result<()> {
    let slow = |before: f64, left: Left, given: Option<f64>| {
        let larger = left.deviation.min(left.most);
        if given.is_none() && larger > SLOW * before {
            larger
        } else {
            before
        }
    };
    let before = bench.train.logs.entry_noise();
    with_noise(bench, study, findings, slow);
    if bench.train.logs.entry_noise() != before {
        bench.rescore_held_out(&[], &mut findings.none)?;
        for found in &mut findings.found {
            let trials = trials(candidates, &found.candidates, &found.explanation);
            bench.rescore_held_out(&trials, &mut found.explanation)?;
        }
    }
    Ok(())
}

/// Uses the noise from the best explanation's residuals for all sensors, if it is smaller: what an
/// explanation misses may look like noise.
pub fn with_noise_left(bench: &mut Bench, study: &Study, findings: &mut Findings) {
    let least =
        |before: f64, left: Left, given: Option<f64>| given.unwrap_or(before.min(left.deviation));
    with_noise(bench, study, findings, least);
}

/// Sets the noise of each sensor from the old value, the residuals and the study, and rescales
/// everything in units of it.
fn with_noise(
    bench: &mut Bench,
    study: &Study,
    findings: &mut Findings,
    of: impl Fn(f64, Left, Option<f64>) -> f64,
) {
    let before = bench.train.logs.entry_noise();
    let sensors = bench.train.logs.sensors.iter();
    let noise: Vec<f64> = (sensors.zip(left(&bench.train.logs, findings)))
        .map(|(s, left)| of(s.noise, left, study.noise.get(&s.name).copied()))
        .collect();
    bench.set_noise(&noise);
    let pairs = bench.train.logs.entry_noise().into_iter().zip(before);
    let factors: Vec<f64> = pairs.map(|(after, before)| after / before).collect();
    rescale(&mut findings.none.fit, &factors);
    for found in &mut findings.found {
        rescale(&mut found.explanation.fit, &factors);
    }
}

/// Estimates the noise of each sensor from the residuals of the best explanation.
fn left(logs: &Logs, findings: &Findings) -> Vec<Left> {
    let found = findings.found.iter().map(|f| &f.explanation.fit);
    let best = found.fold(&findings.none.fit, |best, fit| {
        if fit.cost < best.cost { fit } else { best }
    });
    let estimated = estimate(logs, &in_units(logs, &best.residuals)).into_iter();
    let each = estimated.zip(reading_noise(logs)).enumerate();
    each.map(|(sensor, (deviation, readings))| Left {
        deviation,
        most: if step(logs, sensor) > 0.0 {
            readings.deviation
        } else {
            readings.most
        },
    })
    .collect()
}

/// Returns the residuals in the sensors' units, one array per episode; NaN where a reading is
/// missing.
fn in_units(logs: &Logs, residuals: &[f64]) -> Vec<Vec<f64>> {
    let noise = logs.entry_noise();
    let of_episode = |e: usize| {
        let own = &residuals[logs.offset(e)..logs.offset(e + 1)];
        let mut out = vec![0.0; own.len()];
        // Zero where there is a reading, NaN where there is none.
        logs.difference(e, &logs.episodes[e].readings, &mut out);
        for (k, (out, r)) in out.iter_mut().zip(own).enumerate() {
            *out += r * noise[k % noise.len()];
        }
        out
    };
    (0..logs.episodes.len()).map(of_episode).collect()
}

/// Converts a fit to the units of another noise, `factors` times as large, one per entry.
fn rescale(fit: &mut Fit, factors: &[f64]) {
    let factor = |k: usize| factors[k % factors.len()];
    for (k, r) in fit.residuals.iter_mut().enumerate() {
        *r /= factor(k);
    }
    fit.cost = cost(&fit.residuals);
    if fit.gains.ncols() != fit.residuals.len() {
        return;
    }
    let lengths = |fit: &Fit| -> Vec<f64> { fit.gains.row_iter().map(|row| row.norm()).collect() };
    let before = lengths(fit);
    for (k, mut column) in fit.gains.column_iter_mut().enumerate() {
        column *= factor(k);
    }
    let pairs = lengths(fit).into_iter().zip(before);
    let ratio = |(after, before): (f64, f64)| if before > 0.0 { after / before } else { 1.0 };
    let ratios: Vec<f64> = pairs.map(ratio).collect();
    // A column shows the less, the larger the deviation is that it leaves. This is exact if all
    // factors are the same.
    let shows = fit.shows.iter_mut().zip(&ratios);
    shows.for_each(|(shows, ratio)| *shows /= ratio);
    fit.covariance = (fit.covariance).map_with_location(|i, j, c| c * ratios[i] * ratios[j]);
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::DMatrix;

    use super::*;
    use crate::fit::StartSlopes;
    use crate::predict::Point;

    /// A value that is the mean of two readings, the second of a sensor with twice the noise.
    fn fit() -> Fit {
        let gains = DMatrix::from_row_slice(1, 2, &[0.5, 1.0]);
        Fit {
            point: Point {
                theta: vec![0.0],
                starts: Vec::new(),
            },
            cost: 20.0,
            residuals: vec![2.0, 4.0],
            shows: vec![1.0],
            covariance: &gains * gains.transpose(),
            gains,
            unresolved: vec![false],
            free: vec![0],
            starts: Arc::new(StartSlopes::default()),
        }
    }

    #[test]
    fn a_fit_is_told_in_units_of_another_noise() {
        let mut fit = fit();
        let answer = fit.answer(&fit.residuals);
        rescale(&mut fit, &[2.0, 1.0]);
        assert_eq!(fit.residuals, [1.0, 4.0]);
        assert_eq!(fit.cost, 17.0);
        // The same readings move the value as far, and now both have the same uncertainty.
        assert_eq!(fit.answer(&fit.residuals), answer);
        assert!((fit.covariance[(0, 0)] - 2.0).abs() < 1e-12);
    }

    /// Symptom: the check `excitation` failed, and the sentence ended with it, for parameters that
    /// the logs of a coarse encoder determine well. Cause: how much a parameter shows stayed in
    /// units of the encoder's steps.
    #[test]
    fn a_parameter_shows_half_as_much_in_twice_the_noise() {
        let mut fit = fit();
        let information = |fit: &Fit| fit.shows[0].powi(2) * fit.covariance[(0, 0)];
        let before = information(&fit);
        rescale(&mut fit, &[2.0, 2.0]);
        assert!((fit.shows[0] - 0.5).abs() < 1e-12, "{:?}", fit.shows);
        assert!((information(&fit) - before).abs() < 1e-12);
    }
}
