//! First trajectory from the readings, and priors of the initial states.

mod of_state;

use std::ops::Range;

use asid_core::signal::{orientation, rotation_difference, unit_quaternion};
use asid_mjcf::Plant;
use nalgebra::Vector3;

use crate::data::Logs;
use crate::predict::State;

use super::smoother::Start;
use super::tangent::{difference, rotation};
use super::walk::Walk;

use of_state::OfState;

/// Half the number of rows over which a speed is taken.
const HALF_WINDOW: usize = 2;
/// Standard deviation of an initial state that the log gives, relative to the coordinate's largest
/// value.
const GIVEN: f64 = 1e-4;
/// Standard deviation of an initial state that the log does not give, relative to the coordinate's
/// largest value.
const OPEN: f64 = 2.0;

/// Standard deviation of a segment's initial position, in standard deviations of its reading.
const READ: f64 = 5.0;
/// Time over which that gives the standard deviation of its speed, s.
///
/// It is half the window over which a speed is taken at 100 Hz, so that a bounce within the window
/// is allowed for.
const READ_TIME: f64 = 0.02;

/// Fills missing values of a series linearly between their neighbours; returns false if all are
/// missing.
fn fill(time: &[f64], values: &mut [f64]) -> bool {
    let present: Vec<usize> = (0..values.len())
        .filter(|&k| values[k].is_finite())
        .collect();
    let (Some(&first), Some(&last)) = (present.first(), present.last()) else {
        return false;
    };
    let (start, end) = (values[first], values[last]);
    values[..first].fill(start);
    values[last + 1..].fill(end);
    for pair in present.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        for k in a + 1..b {
            let along = (time[k] - time[a]) / (time[b] - time[a]);
            values[k] = values[a] + along * (values[b] - values[a]);
        }
    }
    true
}

/// Gives each quaternion of a series (four components) the sign that is closer to the one before.
///
/// `q` and `-q` are the same orientation, but points between them are not orientations. One that is
/// no orientation, as of a lost tracker, becomes missing.
fn align_signs(series: &mut [Vec<f64>]) {
    let rows = series.first().map_or(0, Vec::len);
    let mut before: Option<Vec<f64>> = None;
    for k in 0..rows {
        let mut q: Vec<f64> = series.iter().map(|s| s[k]).collect();
        if orientation(&q).is_none() {
            series.iter_mut().for_each(|s| s[k] = f64::NAN);
            continue;
        }
        if let Some(before) = before
            && q.iter().zip(&before).map(|(a, b)| a * b).sum::<f64>() < 0.0
        {
            q.iter_mut().for_each(|x| *x = -*x);
            series.iter_mut().for_each(|s| s[k] = -s[k]);
        }
        before = Some(q);
    }
}

/// Returns trajectories along some walks, `rows x (nq + nv)` each.
///
/// Coordinates that sensors of joints and of free bodies read are taken from the readings. Speeds
/// that no sensor reads are differences of positions, if these are read. The rest comes from
/// `otherwise`.
#[must_use]
pub fn from_readings(
    plant: &Plant,
    logs: &Logs,
    walks: &[Walk],
    otherwise: &[Vec<f64>],
) -> Vec<Vec<f64>> {
    let layout = &plant.layout;
    let mut out = otherwise.to_vec();
    for (walk, states) in walks.iter().zip(&mut out) {
        let mut read = Read::nothing(layout.nv);
        let mut spins = Vec::new();
        let mut first = 0;
        for sensor in &logs.sensors {
            let sensors = &layout.sensors;
            let Some(index) = sensors.iter().position(|s| s.name == sensor.name) else {
                continue;
            };
            let channels = first..first + sensors[index].len;
            first = channels.end;
            let Some(of) = OfState::of(plant, index) else {
                continue;
            };
            let mut series = series(logs, walk, channels);
            if matches!(of, OfState::Turn(..)) {
                align_signs(&mut series);
            }
            if !series.iter_mut().all(|s| fill(&walk.time, s)) {
                continue;
            }
            match of {
                OfState::Spin(..) => spins.push((of, series)),
                _ => read.take((of, &series), states, layout.nq),
            }
        }
        // About a body's own axes, so once its orientation is known.
        for (of, series) in &spins {
            read.take((*of, series), states, layout.nq);
        }
        speeds(plant, walk, &read, states);
        spin(plant, walk, &read, states);
    }
    out
}

/// Returns some channels of the readings along a walk, one after the other.
fn series(logs: &Logs, walk: &Walk, channels: Range<usize>) -> Vec<Vec<f64>> {
    let channel = |c: usize| {
        let row = |k: usize| walk.readings(logs, k)[c];
        (0..walk.len()).map(row).collect()
    };
    channels.map(channel).collect()
}

/// Degrees of freedom that sensors of joints and of free bodies read.
struct Read {
    /// Whether each position is read, `nv`.
    places: Vec<bool>,
    /// Whether each speed is read, `nv`.
    speeds: Vec<bool>,
}

impl Read {
    fn nothing(nv: usize) -> Self {
        Self {
            places: vec![false; nv],
            speeds: vec![false; nv],
        }
    }

    /// Writes the readings of a sensor into the states of a walk, whose speeds begin at `nq`.
    fn take(&mut self, (of, series): (OfState, &[Vec<f64>]), states: &mut [f64], nq: usize) {
        let nv = self.places.len();
        for (k, row) in states.chunks_exact_mut(nq + nv).enumerate() {
            let values: Vec<f64> = series.iter().map(|s| s[k]).collect();
            let (at, values) = match of {
                OfState::Places(place, _) => (place, values),
                OfState::Turn(place, _) => {
                    let q = unit_quaternion(&values);
                    (place, vec![q.w, q.i, q.j, q.k])
                }
                OfState::Speeds(dof) => (nq + dof, values),
                OfState::Spin(place, dof) => {
                    let turn = unit_quaternion(&row[place..place + 4]);
                    let own = turn.inverse() * Vector3::from_column_slice(&values);
                    (nq + dof, own.as_slice().to_vec())
                }
            };
            row[at..at + values.len()].copy_from_slice(&values);
        }
        let read = match of {
            OfState::Places(_, dof) => &mut self.places[dof..dof + series.len()],
            OfState::Turn(_, dof) => &mut self.places[dof..dof + 3],
            OfState::Speeds(dof) | OfState::Spin(_, dof) => {
                &mut self.speeds[dof..dof + series.len()]
            }
        };
        read.fill(true);
    }
}

/// Fills in speeds that no sensor reads, from differences of positions.
fn speeds(plant: &Plant, walk: &Walk, read: &Read, states: &mut [f64]) {
    let layout = &plant.layout;
    let (nq, nv, n) = (layout.nq, layout.nv, walk.len());
    let width = nq + nv;
    let places = states.to_vec();
    let mut change = vec![0.0; 2 * nv];
    for k in 0..n {
        let (a, b) = (k.saturating_sub(HALF_WINDOW), (k + HALF_WINDOW).min(n - 1));
        let dt = walk.time[b] - walk.time[a];
        if dt <= 0.0 {
            continue;
        }
        let state = |k: usize| &places[k * width..(k + 1) * width];
        difference(layout, state(b), state(a), &mut change);
        for d in (0..nv).filter(|&d| read.places[d] && !read.speeds[d]) {
            states[k * width + nq + d] = change[d] / dt;
        }
    }
}

/// Fills in angular speeds that no sensor reads, of free bodies and ball joints about their own
/// axes, from their orientations.
fn spin(plant: &Plant, walk: &Walk, read: &Read, states: &mut [f64]) {
    let layout = &plant.layout;
    let width = layout.nq + layout.nv;
    let n = walk.len();
    let places = states.to_vec();
    for (place, dof) in layout.joints.iter().filter_map(rotation) {
        if !read.places[dof] || read.speeds[dof] {
            continue;
        }
        for k in 0..n {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(n - 1));
            let dt = walk.time[b] - walk.time[a];
            if dt <= 0.0 {
                continue;
            }
            let q = |k: usize| &places[k * width + place..k * width + place + 4];
            let turn = Vector3::from(rotation_difference(q(b), q(a)));
            let own = unit_quaternion(q(k)).inverse() * turn / dt;
            let at = k * width + layout.nq + dof;
            states[at..at + 3].copy_from_slice(own.as_slice());
        }
    }
}

/// Returns the largest magnitude of each tangent coordinate along some trajectories; positions
/// count relative to the first row.
#[must_use]
pub fn scales(plant: &Plant, trajectory: &[Vec<f64>]) -> Vec<f64> {
    let layout = &plant.layout;
    let (nq, nv) = (layout.nq, layout.nv);
    let width = nq + nv;
    let mut scale = vec![1e-6_f64; 2 * nv];
    let mut change = vec![0.0; 2 * nv];
    for states in trajectory {
        let first = states[..width].to_vec();
        for state in states.chunks_exact(width) {
            difference(layout, state, &first, &mut change);
            for i in 0..nv {
                scale[i] = scale[i].max(change[i].abs());
                scale[nv + i] = scale[nv + i].max(state[nq + i].abs());
            }
        }
    }
    scale
}

/// Returns the noise (standard deviation) of each position that a sensor reads directly, else 0;
/// `nv`.
#[must_use]
pub fn position_noise(plant: &Plant, logs: &Logs) -> Vec<f64> {
    let mut noise = vec![0.0; plant.layout.nv];
    for sensor in &logs.sensors {
        noise[positions_read(plant, &sensor.name)].fill(sensor.noise);
    }
    noise
}

/// Returns the entry of a reading that reads each position directly, where there is one; `nv`.
#[must_use]
pub fn position_entries(plant: &Plant, logs: &Logs) -> Vec<Option<usize>> {
    let mut entries = vec![None; plant.layout.nv];
    for (s, sensor) in logs.sensors.iter().enumerate() {
        let first = logs.entries.iter().position(|e| e.sensor == s);
        for (i, dof) in positions_read(plant, &sensor.name).enumerate() {
            entries[dof] = first.map(|first| first + i);
        }
    }
    entries
}

/// Returns the degrees of freedom whose positions a sensor reads directly.
fn positions_read(plant: &Plant, sensor: &str) -> Range<usize> {
    let sensors = &plant.layout.sensors;
    let Some(index) = sensors.iter().position(|s| s.name == sensor) else {
        return 0..0;
    };
    match OfState::of(plant, index) {
        Some(OfState::Places(_, dof)) => dof..dof + sensors[index].len,
        Some(OfState::Turn(_, dof)) => dof..dof + 3,
        _ => 0..0,
    }
}

/// Returns the prior of a walk's initial state: about the log's own initial state where `given`,
/// else about the trajectory's first state.
///
/// `noise` is the standard deviation of the reading of each position that a sensor reads directly.
#[must_use]
pub fn start(
    plant: &Plant,
    given: Option<(&State, &[usize])>,
    first: &[f64],
    (scale, noise): (&[f64], &[f64]),
) -> Start {
    let layout = &plant.layout;
    let nx = 2 * layout.nv;
    let wide = |i: usize| {
        let position = if i < layout.nv { noise[i] } else { 0.0 };
        (OPEN * scale[i]).max(10.0 * position).powi(2)
    };
    let unknown: Vec<f64> = (0..nx).map(wide).collect();
    let mut start = Start {
        mean: vec![0.0; nx],
        variance: unknown.clone(),
        unknown,
    };
    if let Some((state, open)) = given {
        let state = [&state.qpos[..], &state.qvel[..]].concat();
        difference(layout, &state, first, &mut start.mean);
        for i in 0..nx {
            if open.contains(&i) {
                start.mean[i] = 0.0;
            } else {
                start.variance[i] = (GIVEN * scale[i]).powi(2);
            }
        }
    }
    start
}

/// Returns the uncertainty (standard deviation) of a tangent coordinate that the readings about a
/// row leave.
///
/// For positions it is a few standard deviations of their reading. For speeds it is the same,
/// divided by half the window over which they are taken. If no sensor reads the coordinate, it is
/// twice the coordinate's largest value.
#[must_use]
pub fn open_by_reading(i: usize, (scale, noise): (&[f64], &[f64])) -> f64 {
    let nv = noise.len();
    let least = GIVEN * scale[i];
    match noise[i % nv] {
        0.0 => OPEN * scale[i],
        noise if i < nv => (READ * noise).max(least),
        noise => (READ * noise / READ_TIME).max(least),
    }
}

/// Returns the prior of a segment's initial state: about its readings, as uncertain as these leave
/// it.
#[must_use]
pub fn start_of_segment(
    plant: &Plant,
    read: &[f64],
    first: &[f64],
    scales: (&[f64], &[f64]),
) -> Start {
    let nx = 2 * plant.layout.nv;
    let open = (0..nx).map(|i| open_by_reading(i, scales).powi(2));
    let unknown: Vec<f64> = open.collect();
    let mut start = Start {
        mean: vec![0.0; nx],
        variance: unknown.clone(),
        unknown,
    };
    difference(&plant.layout, read, first, &mut start.mean);
    start
}

#[cfg(test)]
mod tests;
