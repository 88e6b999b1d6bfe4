//! The noise by what the best explanation leaves, which hides least of it.

use asid_core::Result;

use crate::bench::{Bench, Explanation, Trial};
use crate::candidate::Candidate;
use crate::findings::{Findings, trials};
use crate::fit::cost;
use crate::noise::{estimate, step};
use crate::prepare::{plain_residuals, reading_noise};
use crate::study::Study;

/// Deviation that is left, relative to the one that the readings alone told, from which on it is taken. Two estimates of white noise differ by a few per
/// cent, those of slow noise by a third and more.
const SLOW: f64 = 1.2;

/// Noise of a sensor by what is left, and the most that its readings allow.
struct Left {
    deviation: f64,
    most: f64,
}

/// Of each sensor.
fn left(bench: &Bench, candidates: &[Candidate], findings: &Findings) -> Result<Vec<Left>> {
    let best = findings
        .found
        .iter()
        .min_by(|a, b| a.explanation.fit.cost.total_cmp(&b.explanation.fit.cost))
        .filter(|f| f.explanation.fit.cost < findings.none.fit.cost);
    let (members, explanation) = match best {
        Some(f) => (
            trials(candidates, &f.candidates, &f.explanation),
            &f.explanation,
        ),
        None => (Vec::new(), &findings.none),
    };
    let logs = &bench.train.logs;
    let residuals = plain_residuals(bench, &bench.train, &members, &explanation.fit.point)?;
    let estimated = estimate(logs, &residuals).into_iter();
    let each = estimated.zip(reading_noise(logs)).enumerate();
    let left = each.map(|(sensor, (deviation, readings))| Left {
        deviation,
        most: if step(logs, sensor) > 0.0 {
            readings.deviation
        } else {
            readings.most
        },
    });
    Ok(left.collect())
}

/// Takes the noise of sensors from what the best explanation leaves where it is larger than the readings alone told: noise that is slow
/// beside what the machine does tells of its size only without the motion. It is no larger than the readings allow. Errors of a rounding are
/// alike from row to row too, and their size is known.
///
/// # Errors
/// When a rollout fails.
pub fn with_slow_noise(
    bench: &mut Bench,
    study: &Study,
    candidates: &[Candidate],
    findings: Findings,
) -> Result<Findings> {
    let slow = |before: f64, left: Left, given: Option<f64>| {
        let larger = left.deviation.min(left.most);
        if given.is_none() && larger > SLOW * before {
            larger
        } else {
            before
        }
    };
    let before = bench.train.logs.entry_noise();
    let mut findings = with_noise(bench, study, candidates, findings, slow)?;
    if bench.train.logs.entry_noise() != before {
        bench.hold_out(&[], &mut findings.none)?;
        for found in &mut findings.found {
            let trials = trials(candidates, &found.candidates, &found.explanation);
            bench.hold_out(&trials, &mut found.explanation)?;
        }
    }
    Ok(findings)
}

/// Takes the noise of all sensors from what the best explanation leaves. It is no larger than it was: what an explanation misses may look like noise.
///
/// # Errors
/// When a rollout fails.
pub fn with_noise_left(
    bench: &mut Bench,
    study: &Study,
    candidates: &[Candidate],
    findings: Findings,
) -> Result<Findings> {
    let least =
        |before: f64, left: Left, given: Option<f64>| given.unwrap_or(before.min(left.deviation));
    with_noise(bench, study, candidates, findings, least)
}

/// Sets the noise of each sensor, from what it was, what is left and what the study gives, and computes all sums of squares with it.
fn with_noise(
    bench: &mut Bench,
    study: &Study,
    candidates: &[Candidate],
    mut findings: Findings,
    of: impl Fn(f64, Left, Option<f64>) -> f64,
) -> Result<Findings> {
    let left = left(bench, candidates, &findings)?;
    let before = bench.train.logs.sensors.iter();
    let noise: Vec<f64> = (before.zip(left))
        .map(|(s, left)| of(s.noise, left, study.noise.get(&s.name).copied()))
        .collect();
    bench.set_noise(&noise);
    rescore(bench, &[], &mut findings.none)?;
    for found in &mut findings.found {
        let trials = trials(candidates, &found.candidates, &found.explanation);
        rescore(bench, &trials, &mut found.explanation)?;
    }
    Ok(findings)
}

/// Computes the residuals of an explanation and their sum of squares anew.
fn rescore(bench: &Bench, trials: &[Trial<'_>], of: &mut Explanation) -> Result<()> {
    let mut predictor = bench.predictor(trials, &bench.train)?;
    let mut residuals = predictor.residuals(std::slice::from_ref(&of.fit.point))?;
    of.fit.residuals = residuals.pop().unwrap_or_default();
    of.fit.cost = cost(&of.fit.residuals);
    Ok(())
}
