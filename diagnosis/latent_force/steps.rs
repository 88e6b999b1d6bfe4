//! Encoder steps that a log shows by itself.
//!
//! Readings on one grid, wider than the sensor's noise, need no search: the log says that they come in steps, and how wide these
//! are. Rounding has no slope either, by which a regression could find it. So the smoother takes such readings as noisy as
//! their steps make them (a uniform error has the variance `step² / 12`), and the rounding is named beside whatever else is found.

use nalgebra::DMatrix;

use crate::candidate::Candidate;
use crate::data::Logs;
use crate::noise;

use super::columns::Form;
use super::search::{Outcome, Round, Set};

/// Deviation of the rounding, relative to the noise of the sensor, from which on steps are an effect. Smaller: steps that the
/// noise hides are named too. A study whose noise is that of its encoder (`step / sqrt(12)`) has no such effect.
const SHOWS: f64 = 1.2;

/// Deviation of the rounding of each sensor's readings, where it is more than their noise; else 0.
#[must_use]
pub fn roundings(logs: &Logs) -> Vec<f64> {
    let sensors = logs.sensors.iter().enumerate();
    sensors
        .map(|(s, sensor)| {
            let deviation = noise::step(logs, s) / 12.0_f64.sqrt();
            if deviation > SHOWS * sensor.noise {
                deviation
            } else {
                0.0
            }
        })
        .collect()
}

/// Steps that a log shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// The candidate that rounds so.
    pub candidate: usize,
    /// Width of a step, in the unit of the reading.
    pub step: f64,
    /// Logarithm of the likelihood of the readings with the rounding's variance over that with the noise's alone.
    pub gain: f64,
}

/// The steps that logs show, by the candidates for them.
#[must_use]
pub fn seen(logs: &Logs, candidates: &[Candidate]) -> Vec<Seen> {
    let roundings = roundings(logs);
    let mut all = Vec::new();
    for (candidate, c) in candidates.iter().enumerate() {
        let sensor = logs.sensors.iter().position(|s| s.name == c.spec.site);
        let Some(s) = sensor.filter(|&s| c.effect.rounds() && roundings[s] > 0.0) else {
            continue;
        };
        let readings: usize = noise::readings(logs, s).iter().map(Vec::len).sum();
        let ratio = (roundings[s] / logs.sensors[s].noise).powi(2);
        all.push(Seen {
            candidate,
            step: roundings[s] * 12.0_f64.sqrt(),
            gain: 0.5 * readings as f64 * (ratio - 1.0 - ratio.ln()),
        });
    }
    all
}

/// Puts the steps that logs show beside every set that a search found, and alone.
#[must_use]
pub fn beside(mut outcome: Outcome, seen: &[Seen], candidates: &[Candidate]) -> Outcome {
    if seen.is_empty() {
        return outcome;
    }
    let with = |set: &Set| -> Set {
        let mut set = set.clone();
        for seen in seen {
            let candidate = &candidates[seen.candidate];
            let form = Form {
                candidate: seen.candidate,
                begin: vec![seen.step],
                slopes: Vec::new(),
                first: 0,
            };
            let unknowns = form.unknowns(candidate).into_iter();
            // The log has told it.
            let given = unknowns.map(|u| super::fitted_value::Unknown { free: false, ..u });
            let fitted = &mut set.fitted;
            fitted.hypothesis.unknowns.extend(given);
            fitted.hypothesis.specs.push(candidate.spec.clone());
            fitted.theta.push(seen.step);
            fitted.evidence += seen.gain;
            set.candidates.push(seen.candidate);
            set.names += 1;
        }
        set
    };
    let alone = with(&Set {
        candidates: Vec::new(),
        fitted: outcome.none.clone(),
        names: 0,
    });
    for set in outcome.rounds.iter_mut().flat_map(|r| &mut r.confirmed) {
        *set = with(set);
    }
    match outcome.rounds.first_mut() {
        Some(first) => first.confirmed.push(alone.clone()),
        None => outcome.rounds.push(Round {
            base: Vec::new(),
            screened: Vec::new(),
            alike: (Vec::new(), DMatrix::zeros(0, 0)),
            confirmed: vec![alone.clone()],
        }),
    }
    outcome.best = if outcome.best.candidates.is_empty() {
        alone
    } else {
        with(&outcome.best)
    };
    outcome
}
