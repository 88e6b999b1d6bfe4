//! From a study to the bench: logs prepared, and their noise estimated.

use std::collections::BTreeMap;

use asid_core::episode::InitialState;
use asid_core::{Episode, Error, Layout, Result};
use asid_readings::first_row::Followers;

use crate::bench::Bench;
use crate::data::{LoggedSensor, Logs};
use crate::fit::cost;
use crate::home::at_rest;
use crate::machine::Machine;
use crate::noise::{self, Noise};
use crate::predict::{Point, State};
use crate::record::Record;
use crate::starts::reach::reach;
use crate::starts::{given_start, open_coordinates};
use crate::study::Study;

/// Share of a held-out episode on which an unknown initial state is fitted.
const HEAD: f64 = 0.1;

/// Whether a log has a reading of a sensor.
fn reads(episode: &Episode, sensor: &str) -> bool {
    let is_read = |columns: std::ops::Range<usize>| {
        let mut rows = 0..episode.rows();
        rows.any(|k| {
            let mut reading = episode.reading(k)[columns.clone()].iter();
            reading.any(|x| x.is_finite())
        })
    };
    episode.channel(sensor).is_some_and(is_read)
}

/// Returns the sensors that are compared, in the scene's order.
///
/// They have readings in at least one log, and a known noise: a log to fit to shows it, or the
/// study gives it.
fn compared_sensors(layout: &Layout, study: &Study) -> Vec<String> {
    let is_compared = |name: &str| {
        let any = |logs: &[(String, Episode)]| logs.iter().any(|(_, e)| reads(e, name));
        any(&study.train) || (study.noise.contains_key(name) && any(&study.test))
    };
    let sensors = layout.sensors.iter().filter(|s| is_compared(&s.name));
    sensors.map(|s| s.name.clone()).collect()
}

/// Returns the residuals `logged - predicted` without whitening, in the sensors' units, one array
/// per episode.
///
/// # Errors
/// When a rollout fails.
pub fn plain_residuals(
    bench: &Bench,
    record: &Record,
    trials: &[crate::bench::Trial<'_>],
    point: &Point,
) -> Result<Vec<Vec<f64>>> {
    let mut predictor = bench.predictor(trials, record)?;
    let mut readings = predictor.readings(std::slice::from_ref(point))?;
    let predicted = readings.pop().unwrap_or_default();
    let logs = &record.logs;
    Ok((0..logs.episodes.len())
        .map(|e| {
            let mut out = vec![0.0; logs.episodes[e].plan.rows() * logs.entries.len()];
            logs.difference(e, &predicted[e], &mut out);
            out
        })
        .collect())
}

/// Returns the sensors whose reading in the first row of a log follows an earlier command, so that
/// no model can predict it.
fn followers(machine: &Machine, study: &Study) -> Result<Followers> {
    let logs = study.train.iter().chain(&study.test);
    let logs: Vec<&Episode> = logs.map(|(_, episode)| episode).collect();
    let Some(first) = logs.first() else {
        return Ok(Followers::default());
    };
    let State { qpos, qvel } = given_start(&machine.plant, first);
    let start = InitialState { qpos, qvel };
    Followers::of(&*machine.with(&[])?, &start, &logs)
}

/// Returns the bench of a study, with its noise not yet estimated, and the values of its parameters
/// in the model as given.
///
/// Where a log gives no initial state, the machine begins at its home. It begins where it comes to
/// rest from there if replays of the first rows then leave less.
///
/// # Errors
/// When no log has a reading, or a parameter cannot be set.
pub fn dataset(study: &Study, machine: Machine) -> Result<(Bench, Vec<f64>)> {
    let settled = settled(study, &machine)?;
    let (bench, nominal) = dataset_of(study, machine)?;
    let Some(machine) = settled else {
        return Ok((bench, nominal));
    };
    let (other, _) = dataset_of(study, machine)?;
    let [before, after] = [&bench, &other].map(|b| left_of_first_rows(b, &nominal));
    // Replays that diverge are never better.
    let bench = if after? < before? { other } else { bench };
    Ok((bench, nominal))
}

/// Returns the machine at rest under the first command of the first log, if it comes to rest and a
/// log gives no complete initial state.
fn settled(study: &Study, machine: &Machine) -> Result<Option<Machine>> {
    let logs = || study.train.iter().chain(&study.test);
    let (Some((_, first)), Some(home)) =
        (study.train.first(), machine.plant.layout.keyframes.first())
    else {
        return Ok(None);
    };
    let is_open = |(_, e): &(String, Episode)| e.initial.as_ref().is_none_or(|s| !s.is_complete());
    if !logs().any(is_open) {
        return Ok(None);
    }
    let command = &first.ctrl[..machine.plant.layout.nu()];
    let found = at_rest(&*machine.with(&[])?, home, command)?;
    Ok(found.map(|home| machine.beginning_at(home)))
}

/// Returns the squared residuals of replays of the training logs' first rows; infinite where one
/// diverges.
///
/// They are in units of the noise that the readings alone show.
fn left_of_first_rows(bench: &Bench, nominal: &[f64]) -> Result<f64> {
    let mut head = bench.train.cut(bench.layout(), HEAD);
    let noise: Vec<f64> = reading_noise(&bench.train.logs)
        .iter()
        .map(|n| n.deviation)
        .collect();
    head.logs.set_noise(&noise);
    let point = Point {
        theta: nominal.to_vec(),
        starts: head.starts.clone(),
    };
    let residuals = bench.predictor(&[], &head)?.residuals(&[point])?.pop();
    let left = cost(&residuals.unwrap_or_default());
    Ok(if left.is_nan() { f64::INFINITY } else { left })
}

/// Returns the bench of a study and the values of its parameters, for a machine with a given home.
fn dataset_of(study: &Study, machine: Machine) -> Result<(Bench, Vec<f64>)> {
    let layout = machine.plant.layout.clone();
    let sensors = compared_sensors(&layout, study);
    if sensors.is_empty() {
        return Err(Error::Failed(format!(
            "study {}: no log to fit to has a reading that is left, once late columns are moved and outliers left out: log longer episodes",
            study.name
        )));
    }
    let followers = followers(&machine, study)?;
    let record = |logs: &[(String, asid_core::Episode)], first: usize| -> Result<Record> {
        let starts = logs
            .iter()
            .map(|(_, e)| given_start(&machine.plant, e))
            .collect();
        let mut logs = logs.to_vec();
        logs.iter_mut()
            .for_each(|(_, episode)| followers.open(episode));
        let logs = Logs::new(&machine.plant, &sensors, logs)?;
        Ok(Record::new(logs.counted_from(first), starts))
    };
    let (train, test) = (
        record(&study.train, 0)?,
        record(&study.test, study.train.len())?,
    );
    let model = machine.with(&[])?;
    let nominal = study
        .parameters
        .iter()
        .map(|p| Ok(p.value_of(model.nominal(&p.targets[0])?)))
        .collect::<Result<Vec<_>>>()?;
    let open = open_coordinates(&layout, study);
    let point = Point {
        theta: nominal.clone(),
        starts: train.starts.clone(),
    };
    let bench = Bench {
        reach: reach(&machine, &study.parameters, (&train.logs, &point), &open)?,
        machine,
        train,
        parameters: study.parameters.clone(),
        open,
        head: test.cut(&layout, HEAD),
        test,
    };
    if !study.test.is_empty() && bench.held_readings() < 1.0 {
        return Err(Error::Failed(format!(
            "study {}: the logs held out are too short for a gap: no reading is left behind the first rows, to which their initial states are fitted",
            study.name
        )));
    }
    Ok((bench, nominal))
}

/// Estimates the noise of each sensor from the readings alone, without a model.
#[must_use]
pub fn reading_noise(logs: &Logs) -> Vec<Noise> {
    let n = logs.entries.len();
    let width = logs.width();
    let series: Vec<Vec<f64>> = logs
        .episodes
        .iter()
        .map(|e| {
            let rows = e.plan.rows();
            let mut out = vec![0.0; rows * n];
            // The first valid reading of each column: any fixed reading can take the place of the
            // initial one.
            let first: Vec<f64> = (0..width)
                .map(|c| {
                    let mut column = e.readings.iter().skip(c).step_by(width);
                    column.find(|x| x.is_finite()).copied().unwrap_or(0.0)
                })
                .collect();
            for (row, out) in e.readings.chunks_exact(width).zip(out.chunks_exact_mut(n)) {
                logs.reading_difference(row, &first, out);
            }
            out
        })
        .collect();
    noise::describe(logs, &series)
}

/// Estimates the noise from the readings alone; where the study gives it, that value is used and
/// counts as white.
pub fn set_reading_noise(bench: &mut Bench, given: &BTreeMap<String, f64>) {
    let logs = &bench.train.logs;
    let estimated = reading_noise(logs);
    let each = logs.sensors.iter().zip(&estimated);
    let noise: Vec<f64> = each
        .map(|(s, x)| given.get(&s.name).copied().unwrap_or(x.deviation))
        .collect();
    bench.set_noise(&noise);
    // The noise that a study gives for a sensor is all of its noise.
    let alike = |(sensor, x): (&LoggedSensor, &Noise)| {
        if given.contains_key(&sensor.name) {
            1.0
        } else {
            x.alike()
        }
    };
    let each = bench.train.logs.sensors.iter().zip(&estimated);
    let alike: Vec<f64> = each.map(alike).collect();
    bench.set_alike(&alike);
}
