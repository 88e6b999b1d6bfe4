//! What the model does in the logs' episodes: states, forces of drives, contacts.
//!
//! Logs show some sensors; candidates and regimes need the whole state, which the model
//! replays from the same commands.

use asid_core::layout::Recording;
use asid_core::replay::ReplayPlan;
use asid_core::{BatchConfig, Control, Model, Parameter, Result, Rollout, Simulator};
use asid_mjcf::Plant;

use crate::data::Logs;
use crate::predict::{Point, columns_of};

/// States of all episodes at the ends of their frames.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// Names of the sensors that the logs have.
    pub sensors: Vec<String>,
    /// One an episode.
    pub episodes: Vec<Path>,
    /// Pairs of bodies that can touch.
    pub pairs: Vec<[usize; 2]>,
    /// Whether each pair does, after any physics step of any episode.
    touched: Vec<bool>,
    readings: Vec<(String, f64)>,
}

/// One episode.
#[derive(Clone, Debug)]
pub struct Path {
    /// Positions, `rows x nq`.
    pub qpos: Vec<f64>,
    /// Velocities, `rows x nv`.
    pub qvel: Vec<f64>,
    /// Commands, `rows x nu`.
    pub ctrl: Vec<f64>,
    /// Normal forces, N, `rows x pairs`.
    pub contact: Vec<f64>,
}

impl Trajectory {
    /// Replays all episodes at a point and records states and contacts at the rows' times.
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
        let mut names: Vec<String> = Vec::new();
        names.extend(layout.joints.iter().map(|j| format!("qpos.{}", j.name)));
        names.extend(layout.joints.iter().map(|j| format!("qvel.{}", j.name)));
        names.extend(pairs.iter().map(|p| contact_channel(layout, *p)));
        let recording = layout.recording(&names)?;
        let width = recording.width();
        let (nq, nv, nu) = (layout.nq, layout.nv, layout.nu());
        let mut simulator = model.simulator(&BatchConfig {
            size: 1,
            threads,
            targets: parameters.iter().flat_map(|p| p.targets.clone()).collect(),
        })?;
        let touches = layout.recording(&names[names.len() - pairs.len()..])?;
        let mut touched = vec![false; pairs.len()];
        let mut episodes = Vec::with_capacity(logs.episodes.len());
        for (e, start) in logs.episodes.iter().zip(&point.starts) {
            let begin = |simulator: &mut dyn Simulator| -> Result<()> {
                simulator.reset(&[0])?;
                simulator.set_parameters(&[0], &columns_of(parameters, &point.theta))?;
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
            readings: spreads(logs),
            episodes,
            pairs,
            touched,
        })
    }

    /// Of states that are known (`rows x (nq + nv)` each, with the episode and its rows), and the contacts that the model has
    /// there.
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
        let mut simulator = model.simulator(&BatchConfig {
            size: 1,
            threads: 1,
            targets: parameters.iter().flat_map(|p| p.targets.clone()).collect(),
        })?;
        simulator.set_parameters(&[0], &columns_of(parameters, theta))?;
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
            readings: spreads(logs),
            episodes,
            pairs,
            touched,
        })
    }

    /// Whether a geom's body touches anything in these episodes.
    #[must_use]
    pub fn touches(&self, plant: &Plant, geom: &str) -> bool {
        let Ok(geom) = plant.geom(geom) else {
            return false;
        };
        let body = plant.geoms[geom].body;
        let pairs = self.pairs.iter().zip(&self.touched);
        pairs.into_iter().any(|(p, &t)| t && p.contains(&body))
    }

    /// Largest command of an actuator; about its mean where it is a position.
    #[must_use]
    pub fn command(&self, plant: &Plant, actuator: usize) -> f64 {
        let nu = plant.layout.nu();
        let all = || {
            let episodes = self.episodes.iter();
            episodes.flat_map(move |e| e.ctrl.iter().skip(actuator).step_by(nu))
        };
        let servo = plant.drives[actuator].is_some_and(|d| d.is_position_servo());
        let n = all().count().max(1) as f64;
        let mean = if servo { all().sum::<f64>() / n } else { 0.0 };
        all().map(|u| (u - mean).abs()).fold(0.0, f64::max)
    }

    /// Largest speed of a hinge or slide.
    #[must_use]
    pub fn speed(&self, plant: &Plant, joint: usize) -> f64 {
        let (nv, at) = (plant.layout.nv, plant.layout.joints[joint].qvel);
        let episodes = self.episodes.iter();
        let speeds = episodes.flat_map(|e| e.qvel.iter().skip(at).step_by(nv));
        speeds
            .filter(|v| v.is_finite())
            .fold(0.0, |a, v| a.max(v.abs()))
    }

    /// Largest force of the drives on a hinge or slide, N or N m.
    #[must_use]
    pub fn force(&self, plant: &Plant, joint: usize) -> f64 {
        let layout = &plant.layout;
        let (nq, nv, nu) = (layout.nq, layout.nv, layout.nu());
        let place = &layout.joints[joint];
        let mut largest: f64 = 0.0;
        for e in &self.episodes {
            let rows = e.qpos.chunks_exact(nq).zip(e.qvel.chunks_exact(nv));
            for (k, (q, v)) in rows.enumerate() {
                let sum: f64 = plant
                    .drives_of(joint)
                    .map(|(i, d)| d.force(e.ctrl[k * nu + i], q[place.qpos], v[place.qvel]))
                    .sum();
                if sum.is_finite() {
                    largest = largest.max(sum.abs());
                }
            }
        }
        largest
    }

    /// Spread of a sensor's readings: their deviation.
    #[must_use]
    pub fn reading(&self, sensor: &str) -> f64 {
        let found = self.readings.iter().find(|(name, _)| name == sensor);
        found.map_or(1.0, |(_, spread)| *spread)
    }

    /// Quantiles of where the bodies that meet a geom are along a world axis, m.
    #[must_use]
    pub fn places(&self, plant: &Plant, geom: &str, axis: usize, quantiles: &[f64]) -> Vec<f64> {
        let Ok(site) = plant.geom(geom) else {
            return Vec::new();
        };
        let mut values: Vec<f64> = Vec::new();
        for body in movers(plant, site) {
            let Some(joint) = plant.free_joint(body) else {
                continue;
            };
            let at = plant.layout.joints[joint].qpos + axis;
            for e in &self.episodes {
                let column = e.qpos.iter().skip(at).step_by(plant.layout.nq);
                // A body that rests for long would hide where it passed.
                let mut last = f64::NAN;
                for &x in column.filter(|x| x.is_finite()) {
                    if (x - last).abs() < 1e-3 {
                        continue;
                    }
                    last = x;
                    values.push(x);
                }
            }
        }
        if values.is_empty() {
            return Vec::new();
        }
        values.sort_by(f64::total_cmp);
        let pick = |q: f64| values[((q * (values.len() - 1) as f64).round()) as usize];
        quantiles.iter().map(|&q| pick(q)).collect()
    }
}

/// Positions `qpos` at the rows of an episode (`rows x nq`), replayed from the first start of `point`.
///
/// # Errors
/// When a value is not physical or the engine fails.
pub fn positions(
    model: &dyn Model,
    parameters: &[Parameter],
    plan: &ReplayPlan,
    point: &Point,
) -> Result<Vec<f64>> {
    let layout = model.layout();
    let joints = layout.joints.iter();
    let names: Vec<String> = joints.map(|j| format!("qpos.{}", j.name)).collect();
    let recording = layout.recording(&names)?;
    let mut simulator = model.simulator(&BatchConfig {
        size: 1,
        threads: 1,
        targets: parameters.iter().flat_map(|p| p.targets.clone()).collect(),
    })?;
    simulator.set_parameters(&[0], &columns_of(parameters, &point.theta))?;
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
    let turns = asid_core::replay::quaternions(layout, &recording, &names);
    plan.resample(&first, &out, &turns, &mut rows);
    Ok(rows)
}

/// Pairs of bodies that can touch.
fn pairs_of(plant: &Plant) -> Vec<[usize; 2]> {
    let mut pairs: Vec<[usize; 2]> = plant
        .contacts
        .iter()
        .map(|&[a, b]| {
            let (x, y) = (plant.geoms[a].body, plant.geoms[b].body);
            [x.min(y), x.max(y)]
        })
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// Channel of the normal force between two bodies.
fn contact_channel(layout: &asid_core::Layout, [a, b]: [usize; 2]) -> String {
    format!("contact.{}/{}", layout.bodies[a], layout.bodies[b])
}

/// Replays an episode and looks at the contacts after every physics step: a tap is shorter than the
/// time between two rows.
fn look_for_touches(
    simulator: &mut dyn Simulator,
    plan: &ReplayPlan,
    nu: usize,
    touches: &Recording,
    touched: &mut [bool],
) -> Result<()> {
    let width = touches.width();
    let mut out = vec![0.0; plan.substeps * width];
    for frame in 0..plan.frames {
        let ctrl = plan.ctrl[frame * nu..(frame + 1) * nu].repeat(plan.substeps);
        let control = Control::Shared(&ctrl);
        let rollout = Rollout::new(&[0], plan.substeps, 1, control, touches);
        simulator.rollout(&rollout, &mut out)?;
        for forces in out.chunks_exact(width) {
            for (t, force) in touched.iter_mut().zip(forces) {
                *t |= *force > 0.0;
            }
        }
    }
    Ok(())
}

/// Bodies that can touch a geom, and its own where it moves.
fn movers(plant: &Plant, geom: usize) -> Vec<usize> {
    let mut bodies: Vec<usize> = plant
        .contacts
        .iter()
        .filter(|pair| pair.contains(&geom))
        .flatten()
        .map(|&g| plant.geoms[g].body)
        .filter(|&b| plant.moves(b))
        .collect();
    bodies.sort_unstable();
    bodies.dedup();
    bodies
}

fn spreads(logs: &Logs) -> Vec<(String, f64)> {
    let width = logs.width();
    let mut at = 0;
    let mut out = Vec::new();
    for (i, sensor) in logs.sensors.iter().enumerate() {
        let own = logs.entries.iter().filter(|e| e.sensor == i).count();
        let len = if sensor.rotation { 4 } else { own };
        let mut values = Vec::new();
        for e in &logs.episodes {
            values.extend(
                e.readings
                    .iter()
                    .skip(at)
                    .step_by(width)
                    .filter(|x| x.is_finite()),
            );
        }
        let n = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        out.push((sensor.name.clone(), variance.sqrt()));
        at += len;
    }
    out
}
