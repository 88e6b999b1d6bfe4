//! Encoder steps that a log shows directly.
//!
//! Readings on a grid that is wider than the sensor's noise need no search: the log itself shows
//! the steps and their width. Rounding also has no derivative that a regression could use. So the
//! smoother gives such readings the noise of their steps: a uniform error has the variance
//! `step² / 12`. The rounding is named next to whatever else is found.

use nalgebra::DMatrix;

use crate::candidate::Candidate;
use crate::data::Logs;
use crate::noise;

use super::columns::Form;
use super::search::{Names, Outcome, Round, Set, Sight};

/// Steps are an effect if the standard deviation of the rounding is this multiple of the sensor's
/// noise.
///
/// With a smaller factor, steps hidden by the noise would be named too. A study whose stated noise
/// is that of its encoder (`step / sqrt(12)`) has no such effect.
const SHOWS: f64 = 1.2;

/// Rounding of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rounding {
    /// Width of a step, in the unit of the reading.
    step: f64,
    /// Mean number of rows over which a reading stays the same.
    run: f64,
}

impl Rounding {
    /// Variance of a uniform error over a step.
    fn variance(self) -> f64 {
        self.step * self.step / 12.0
    }
}

/// Rounding of a sensor, if it exceeds the sensor's noise.
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

/// Standard deviation of the readings of each sensor: that of its noise, or that of its steps.
///
/// The errors of a run of equal readings are one error, and carry the information of one reading.
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
    /// Log-likelihood of the readings with the rounding's variance, less that with the noise's
    /// variance.
    gain: f64,
}

/// The steps that logs show; the noise of the logs is that of the sensors alone.
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
    /// The candidate that rounds in these steps.
    pub candidate: usize,
    step: f64,
    gain: f64,
}

/// The candidates that correspond to the steps shown.
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

/// Adds the steps that logs show to every set that the search found, and as a set of their own.
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
            // The log gives this value, so it is not fitted.
            let given = unknowns.map(|u| super::fitted_value::Unknown { free: false, ..u });
            let fitted = &mut set.fitted;
            fitted.hypothesis.unknowns.extend(given);
            fitted.hypothesis.specs.push(candidate.spec.clone());
            fitted.theta.push(one.step);
            fitted.evidence += one.gain;
            set.candidates.push(one.candidate);
            set.names.add(vec![one.candidate]);
        }
        set
    };
    let alone = with(&Set {
        candidates: Vec::new(),
        fitted: outcome.none.clone(),
        names: Names::default(),
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
