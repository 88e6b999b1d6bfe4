//! What the model does in the logs' episodes: states, drive forces, contacts.
//!
//! Logs contain some sensors only. Candidates and regimes of motion need the whole state, which the
//! model replays from the same commands.

mod contact;
mod envelope;

use asid_core::{BatchConfig, Control, Model, Parameter, Result, Rollout, Simulator};
use asid_mjcf::Plant;
use asid_readings::replay::ReplayPlan;

use crate::batch_columns::BatchColumns;
use crate::data::Logs;
use crate::predict::Point;

use contact::{contact_channel, look_for_touches, pairs_of};
use envelope::spreads;

/// States of all episodes at their rows.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// Names of the sensors that the logs have.
    pub sensors: Vec<String>,
    /// Number of logs; an episode may be a part of one.
    pub logs: usize,
    /// One path per episode.
    pub episodes: Vec<Path>,
    /// Pairs of bodies that can touch.
    pub pairs: Vec<[usize; 2]>,
    /// Whether each pair touches after any physics step of any episode.
    touched: Vec<bool>,
    readings: Vec<(String, f64)>,
}

/// States, commands and contacts of one episode.
#[derive(Clone, Debug)]
pub struct Path {
    /// Positions, `rows x nq`.
    pub qpos: Vec<f64>,
    /// Velocities, `rows x nv`.
    pub qvel: Vec<f64>,
    /// Commands, `rows x nu`.
    pub ctrl: Vec<f64>,
    /// Normal forces of the pairs, N, `rows x pairs`.
    pub contact: Vec<f64>,
}

impl Trajectory {
    /// Replays all episodes at a point, and records states and contacts at the times of the rows.
    ///
    /// # Errors
    /// When a value is not physical or the engine fails.
    pub fn of(
        model: &dyn Model,
        plant: &Plant,
        parameters: &[Parameter],
        logs: &Logs,
        point: &Point,
        threads: usize,
    ) -> Result<Self> {
        let layout = model.layout();
        let pairs = pairs_of(plant);
        let mut names = layout.state_channels();
        names.extend(pairs.iter().map(|p| contact_channel(layout, *p)));
        let recording = layout.recording(&names)?;
        let width = recording.width();
        let (nq, nv, nu) = (layout.nq, layout.nv, layout.nu());
        let columns = BatchColumns::new(model, parameters);
        let mut simulator = model.simulator(&BatchConfig {
            size: 1,
            threads,
            targets: columns.targets(),
        })?;
        let touches = layout.recording(&names[names.len() - pairs.len()..])?;
        let mut touched = vec![false; pairs.len()];
        let mut episodes = Vec::with_capacity(logs.episodes.len());
        for (e, start) in logs.episodes.iter().zip(&point.starts) {
            let begin = |simulator: &mut dyn Simulator| -> Result<()> {
                simulator.reset(&[0])?;
                simulator.set_parameters(&[0], &columns.row(&point.theta, e.number))?;
                simulator.set_state(&[0], &start.qpos, &start.qvel)
            };
            begin(&mut *simulator)?;
            if !pairs.is_empty() {
                look_for_touches(&mut *simulator, &e.plan, nu, &touches, &mut touched)?;
                begin(&mut *simulator)?;
            }
            let mut first = vec![0.0; width];
            simulator.read(&[0], &recording, &mut first)?;
            let plan = &e.plan;
            let mut out = vec![0.0; plan.frames * width];
            let control = Control::Shared(&plan.ctrl);
            let rollout = Rollout::new(&[0], plan.frames, plan.substeps, control, &recording);
            simulator.rollout(&rollout, &mut out)?;
            let mut rows = vec![0.0; plan.rows() * width];
            plan.resample(&first, &out, &[], &mut rows);
            let part = |from: usize, len: usize| -> Vec<f64> {
                rows.chunks_exact(width)
                    .flat_map(|r| r[from..from + len].to_vec())
                    .collect()
            };
            episodes.push(Path {
                qpos: part(0, nq),
                qvel: part(nq, nv),
                contact: part(nq + nv, pairs.len()),
                ctrl: e.episode.ctrl[..plan.rows() * nu].to_vec(),
            });
        }
        Ok(Self {
            sensors: logs.channels(),
            logs: logs.episodes.len(),
            readings: spreads(logs),
            episodes,
            pairs,
            touched,
        })
    }

    /// Makes a trajectory of known states, with the contacts that the model has there.
    ///
    /// `states` has `rows x (nq + nv)` values for each part of a log, `rows` its episode and rows.
    ///
    /// # Errors
    /// When a value is not physical or the engine fails.
    pub fn along(
        model: &dyn Model,
        plant: &Plant,
        (parameters, theta): (&[Parameter], &[f64]),
        logs: &Logs,
        states: &[Vec<f64>],
        rows: &[(usize, &[usize])],
    ) -> Result<Self> {
        let layout = model.layout();
        let (nq, nv, nu) = (layout.nq, layout.nv, layout.nu());
        let width = nq + nv;
        let pairs = pairs_of(plant);
        let names: Vec<String> = pairs.iter().map(|p| contact_channel(layout, *p)).collect();
        let recording = layout.recording(&names)?;
        let columns = BatchColumns::new(model, parameters);
        let mut simulator = model.simulator(&BatchConfig {
            size: 1,
            threads: 1,
            targets: columns.targets(),
        })?;
        simulator.set_parameters(&[0], &columns.row(theta, 0))?;
        let mut touched = vec![false; pairs.len()];
        let mut episodes = Vec::with_capacity(states.len());
        for (states, &(episode, rows)) in states.iter().zip(rows) {
            let e = &logs.episodes[episode];
            let mut contact = vec![0.0; rows.len() * pairs.len()];
            if !pairs.is_empty() {
                let each = states
                    .chunks_exact(width)
                    .zip(contact.chunks_exact_mut(pairs.len()));
                for (state, forces) in each {
                    simulator.reset(&[0])?;
                    simulator.set_state(&[0], &state[..nq], &state[nq..])?;
                    simulator.read(&[0], &recording, forces)?;
                    for (t, force) in touched.iter_mut().zip(&*forces) {
                        *t |= *force > 0.0;
                    }
                }
            }
            let part = |from: usize, len: usize| -> Vec<f64> {
                let rows = states.chunks_exact(width);
                rows.flat_map(|r| r[from..from + len].to_vec()).collect()
            };
            let ctrl = rows
                .iter()
                .flat_map(|&k| &e.episode.ctrl[k * nu..(k + 1) * nu]);
            episodes.push(Path {
                qpos: part(0, nq),
                qvel: part(nq, nv),
                ctrl: ctrl.copied().collect(),
                contact,
            });
        }
        Ok(Self {
            sensors: logs.channels(),
            logs: logs.episodes.len(),
            readings: spreads(logs),
            episodes,
            pairs,
            touched,
        })
    }
}

/// Returns the positions at the rows of an episode (`rows x nq`), replayed from the first initial
/// state of `point`.
///
/// `number` is the episode's among all logs of the study.
///
/// # Errors
/// When a value is not physical or the engine fails.
pub fn positions(
    model: &dyn Model,
    parameters: &[Parameter],
    (plan, number): (&ReplayPlan, usize),
    point: &Point,
) -> Result<Vec<f64>> {
    let layout = model.layout();
    let joints = layout.joints.iter();
    let names: Vec<String> = joints.map(|j| format!("qpos.{}", j.name)).collect();
    let recording = layout.recording(&names)?;
    let columns = BatchColumns::new(model, parameters);
    let mut simulator = model.simulator(&BatchConfig {
        size: 1,
        threads: 1,
        targets: columns.targets(),
    })?;
    simulator.set_parameters(&[0], &columns.row(&point.theta, number))?;
    for start in point.starts.iter().take(1) {
        simulator.set_state(&[0], &start.qpos, &start.qvel)?;
    }
    let width = recording.width();
    let mut first = vec![0.0; width];
    simulator.read(&[0], &recording, &mut first)?;
    let mut out = vec![0.0; plan.frames * width];
    let control = Control::Shared(&plan.ctrl);
    let rollout = Rollout::new(&[0], plan.frames, plan.substeps, control, &recording);
    simulator.rollout(&rollout, &mut out)?;
    let mut rows = vec![0.0; plan.rows() * width];
    let turns = asid_readings::replay::quaternions(layout, &recording, &names);
    plan.resample(&first, &out, &turns, &mut rows);
    Ok(rows)
}
