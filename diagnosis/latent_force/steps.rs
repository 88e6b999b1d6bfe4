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
use super::search::{Outcome, Round, Set, Sight};

/// Deviation of the rounding, relative to the noise of the sensor, from which on steps are an effect. Smaller: steps that the
/// noise hides are named too. A study whose noise is that of its encoder (`step / sqrt(12)`) has no such effect.
const SHOWS: f64 = 1.2;

/// How a sensor rounds.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rounding {
    /// Width of a step, in the unit of the reading.
    step: f64,
    /// Rows that a reading stays the same for, as a mean.
    run: f64,
}

impl Rounding {
    /// Variance of a uniform error over a step.
    fn variance(self) -> f64 {
        self.step * self.step / 12.0
    }
}

/// How a sensor rounds, where that is more than its noise.
fn rounding(logs: &Logs, sensor: usize) -> Option<Rounding> {
    let step = noise::step(logs, sensor);
    let (mut rows, mut changes) = (0, 0);
    for values in noise::readings(logs, sensor) {
        rows += values.len();
        changes += 1 + values.windows(2).filter(|w| w[0] != w[1]).count();
    }
    let found = Rounding {
        step,
        run: rows as f64 / changes.max(1) as f64,
    };
    let shows = found.variance().sqrt() > SHOWS * logs.sensors[sensor].noise;
    shows.then_some(found)
}

/// Deviation of the readings of each sensor: that of its noise, or of its steps. The errors of a run of equal readings are one
/// error, and tell as little as one.
#[must_use]
pub fn noise_with_steps(logs: &Logs) -> Vec<f64> {
    let sensors = logs.sensors.iter().enumerate();
    sensors
        .map(|(s, sensor)| {
            rounding(logs, s).map_or(sensor.noise, |r| (r.variance() * r.run).sqrt())
        })
        .collect()
}

/// Steps of a sensor that its logs show.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    sensor: String,
    /// Width of a step, in the unit of the reading.
    step: f64,
    /// Logarithm of the likelihood of the readings with the rounding's variance over that with the noise's alone.
    gain: f64,
}

/// The steps that logs show, whose noise is that of the sensors alone.
#[must_use]
pub fn shown(logs: &Logs) -> Vec<Shown> {
    let sensors = logs.sensors.iter().enumerate();
    sensors
        .filter_map(|(s, sensor)| {
            let rounding = rounding(logs, s)?;
            let readings: usize = noise::readings(logs, s).iter().map(Vec::len).sum();
            let ratio = rounding.variance() / sensor.noise.powi(2);
            Some(Shown {
                sensor: sensor.name.clone(),
                step: rounding.step,
                gain: 0.5 * readings as f64 * (ratio - 1.0 - ratio.ln()),
            })
        })
        .collect()
}

/// Steps that logs show, as a candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// The candidate that rounds so.
    pub candidate: usize,
    step: f64,
    gain: f64,
}

/// The candidates that stand for the steps shown.
#[must_use]
pub fn known(shown: &[Shown], candidates: &[Candidate]) -> Vec<Known> {
    let of = |shown: &Shown| {
        let rounds = |c: &Candidate| c.effect.rounds() && c.spec.site == shown.sensor;
        let candidate = candidates.iter().position(rounds)?;
        Some(Known {
            candidate,
            step: shown.step,
            gain: shown.gain,
        })
    };
    shown.iter().filter_map(of).collect()
}

/// Puts the steps that logs show beside every set that a search found, and alone.
#[must_use]
pub fn beside(mut outcome: Outcome, known: &[Known], candidates: &[Candidate]) -> Outcome {
    if known.is_empty() {
        return outcome;
    }
    let with = |set: &Set| -> Set {
        let mut set = set.clone();
        for one in known {
            let candidate = &candidates[one.candidate];
            let form = Form {
                candidate: one.candidate,
                begin: vec![one.step],
                slopes: Vec::new(),
                first: 0,
            };
            let unknowns = form.unknowns(candidate).into_iter();
            // The log has told it.
            let given = unknowns.map(|u| super::fitted_value::Unknown { free: false, ..u });
            let fitted = &mut set.fitted;
            fitted.hypothesis.unknowns.extend(given);
            fitted.hypothesis.specs.push(candidate.spec.clone());
            fitted.theta.push(one.step);
            fitted.evidence += one.gain;
            set.candidates.push(one.candidate);
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
            sight: Sight::default(),
            raced: Vec::new(),
            confirmed: vec![alone.clone()],
            tolerances: None,
        }),
    }
    outcome.best = if outcome.best.candidates.is_empty() {
        alone
    } else {
        with(&outcome.best)
    };
    outcome
}
