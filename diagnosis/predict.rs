//! Open-loop rollouts of logs in a model: many parameter values and all episodes in one batch.

use asid_core::layout::{JointKind, Layout, Recording};
use asid_core::simulator::{BatchConfig, Control, Rollout, Simulator};
use asid_core::{Model, Parameter, Result};
use asid_readings::replay::quaternions;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::batch_columns::BatchColumns;
use crate::data::Logs;

/// State at the start of an episode.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Positions, `nq`.
    pub qpos: Vec<f64>,
    /// Velocities, `nv`.
    pub qvel: Vec<f64>,
}

impl State {
    /// Moves the state along a coordinate: one of the `nv` positions (`< nv`), or one of the `nv`
    /// velocities after them.
    ///
    /// Orientations rotate about the body's own axes.
    pub fn shift(&mut self, layout: &Layout, coordinate: usize, by: f64) {
        if coordinate >= layout.nv {
            self.qvel[coordinate - layout.nv] += by;
            return;
        }
        for joint in &layout.joints {
            let local = coordinate.wrapping_sub(joint.qvel);
            if local >= joint.kind.qvel_len() {
                continue;
            }
            let (first, axis) = match (joint.kind, local) {
                (JointKind::Hinge | JointKind::Slide, _) => (joint.qpos, None),
                (JointKind::Free, 0..3) => (joint.qpos + local, None),
                (JointKind::Free, _) => (joint.qpos + 3, Some(local - 3)),
                (JointKind::Ball, _) => (joint.qpos, Some(local)),
            };
            match axis {
                None => self.qpos[first] += by,
                Some(axis) => {
                    let q = &mut self.qpos[first..first + 4];
                    let turn = UnitQuaternion::from_scaled_axis(Vector3::ith(axis, by));
                    let old =
                        UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]));
                    let new = old * turn;
                    q.copy_from_slice(&[new.w, new.i, new.j, new.k]);
                }
            }
            return;
        }
    }
}

/// Values of all parameters, and the initial state of each episode.
#[derive(Clone, Debug)]
pub struct Point {
    /// Values, in the parameters' units.
    pub theta: Vec<f64>,
    /// Initial states, one per episode; further ones are ignored.
    pub starts: Vec<State>,
}

/// Episodes that are rolled out together: equal physics steps per frame, and similar lengths.
struct Group {
    episodes: Vec<usize>,
    frames: usize,
    substeps: usize,
    control: Vec<f64>,
}

/// Predicts the readings of some logs for several points at once.
pub struct Predictor<'a> {
    logs: &'a Logs,
    columns: BatchColumns,
    simulator: Box<dyn Simulator>,
    recording: Recording,
    quaternions: Vec<usize>,
    groups: Vec<Group>,
    capacity: usize,
    present: Vec<bool>,
}

impl<'a> Predictor<'a> {
    /// Makes a batch of `model` for the logs, with the unknowns `parameters`, that takes `capacity`
    /// points at once.
    ///
    /// # Errors
    /// When the engine cannot set a target or does not know a sensor.
    pub fn new(
        model: &dyn Model,
        parameters: &[Parameter],
        logs: &'a Logs,
        capacity: usize,
        threads: usize,
    ) -> Result<Self> {
        let layout = model.layout();
        let channels = logs.channels();
        let recording = layout.recording(&channels)?;
        let columns = BatchColumns::new(model, parameters);
        let simulator = model.simulator(&BatchConfig {
            size: capacity * logs.episodes.len(),
            threads,
            targets: columns.targets(),
        })?;
        Ok(Self {
            columns,
            quaternions: quaternions(layout, &recording, &channels),
            groups: groups(logs, layout.nu(), capacity),
            present: logs.present(),
            logs,
            simulator,
            recording,
            capacity,
        })
    }

    /// The logs.
    #[must_use]
    pub fn logs(&self) -> &'a Logs {
        self.logs
    }

    /// Returns which residuals have a reading.
    #[must_use]
    pub fn present(&self) -> &[bool] {
        &self.present
    }

    /// Predicts the readings at some points: `rows x width` for each episode of each point.
    ///
    /// # Errors
    /// When a value is not physical or the engine fails.
    pub fn readings(&mut self, points: &[Point]) -> Result<Vec<Vec<Vec<f64>>>> {
        let mut all = Vec::with_capacity(points.len());
        for chunk in points.chunks(self.capacity) {
            self.run(chunk, &mut all)?;
        }
        Ok(all)
    }

    fn run(&mut self, points: &[Point], all: &mut Vec<Vec<Vec<f64>>>) -> Result<()> {
        let n = self.logs.episodes.len();
        let sims: Vec<usize> = (0..points.len() * n).collect();
        let mut columns: Vec<f64> = Vec::new();
        for point in points {
            for e in &self.logs.episodes {
                self.columns.push(&point.theta, e.number, &mut columns);
            }
        }
        self.simulator.reset(&sims)?;
        self.simulator.set_parameters(&sims, &columns)?;
        let states = || points.iter().flat_map(|p| &p.starts[..n]);
        let qpos: Vec<f64> = states().flat_map(|s| &s.qpos).copied().collect();
        let qvel: Vec<f64> = states().flat_map(|s| &s.qvel).copied().collect();
        self.simulator.set_state(&sims, &qpos, &qvel)?;
        let width = self.recording.width();
        let mut first = vec![0.0; sims.len() * width];
        self.simulator.read(&sims, &self.recording, &mut first)?;
        let base = all.len();
        for _ in points {
            let rows = self.logs.episodes.iter().map(|e| e.plan.rows());
            all.push(rows.map(|r| vec![0.0; r * width]).collect());
        }
        for group in &self.groups {
            let m = group.episodes.len();
            let sims: Vec<usize> = (0..points.len())
                .flat_map(|k| group.episodes.iter().map(move |e| k * n + e))
                .collect();
            let per_point = group.control.len() / self.capacity;
            let control = &group.control[..per_point * points.len()];
            let rollout = Rollout::new(
                &sims,
                group.frames,
                group.substeps,
                Control::PerSimulation(control),
                &self.recording,
            );
            let row = group.frames * width;
            let mut out = vec![0.0; sims.len() * row];
            self.simulator.rollout(&rollout, &mut out)?;
            for (i, &sim) in sims.iter().enumerate() {
                let (k, e) = (i / m, group.episodes[i % m]);
                let plan = &self.logs.episodes[e].plan;
                plan.resample(
                    &first[sim * width..(sim + 1) * width],
                    &out[i * row..(i + 1) * row],
                    &self.quaternions,
                    &mut all[base + k][e],
                );
            }
        }
        Ok(())
    }

    /// Computes the residuals `(logged - predicted) / noise` at some points, one vector per point
    /// over all episodes, rows and entries.
    ///
    /// They are 0 where a reading is missing, and infinite where the simulation diverged.
    ///
    /// # Errors
    /// As [`Predictor::readings`].
    pub fn residuals(&mut self, points: &[Point]) -> Result<Vec<Vec<f64>>> {
        let readings = self.readings(points)?;
        let noise = self.logs.entry_noise();
        let n = noise.len();
        Ok(readings
            .iter()
            .map(|episodes| {
                let mut all = vec![0.0; self.logs.len()];
                for (e, predicted) in episodes.iter().enumerate() {
                    let offset = self.logs.offset(e);
                    let rows = self.logs.episodes[e].plan.rows();
                    let out = &mut all[offset..offset + rows * n];
                    self.logs.difference(e, predicted, out);
                }
                for (k, r) in all.iter_mut().enumerate() {
                    *r = match (self.present[k], r.is_finite()) {
                        (false, _) => 0.0,
                        (true, true) => *r / noise[k % n],
                        (true, false) => f64::INFINITY,
                    };
                }
                all
            })
            .collect())
    }
}

/// Groups the episodes, and repeats their commands for every point of a batch.
fn groups(logs: &Logs, nu: usize, capacity: usize) -> Vec<Group> {
    let mut order: Vec<usize> = (0..logs.episodes.len()).collect();
    let plan = |e: usize| &logs.episodes[e].plan;
    order.sort_by_key(|&e| (plan(e).substeps, plan(e).frames));
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for e in order {
        // The longest of a group has at most 6/5 of the frames of the shortest, so that little is
        // wasted.
        let fits = groups.last().and_then(|g| g.first()).is_some_and(|&first| {
            plan(first).substeps == plan(e).substeps && 5 * plan(e).frames <= 6 * plan(first).frames
        });
        match groups.last_mut() {
            Some(group) if fits => group.push(e),
            _ => groups.push(vec![e]),
        }
    }
    groups
        .into_iter()
        .map(|mut episodes| {
            episodes.sort_unstable();
            let frames = episodes.iter().map(|&e| plan(e).frames).max().unwrap_or(0);
            let mut control = Vec::with_capacity(capacity * episodes.len() * frames * nu);
            for &e in &episodes {
                let ctrl = &plan(e).ctrl;
                control.extend_from_slice(ctrl);
                let last = ctrl[ctrl.len() - nu..].to_vec();
                for _ in plan(e).frames..frames {
                    control.extend_from_slice(&last);
                }
            }
            Group {
                frames,
                substeps: plan(episodes[0]).substeps,
                control: control.repeat(capacity),
                episodes,
            }
        })
        .collect()
}
