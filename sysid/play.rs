//! Motions simulated in batches, at several values of the unknowns, with all limits looked at.

use asid_core::error::Result;
use asid_core::layout::Recording;
use asid_core::problem::home;
use asid_core::signal::{Signal, SignalSet};
use asid_core::simulator::{BatchConfig, Simulator};
use asid_core::{Control, Error, Model, Parameter, Rollout};
use asid_mjcf::Plant;
use asid_mjcf::plant::Drive;

use crate::limits::{DIVERGED, Excess, Limits, STOP};
use crate::{columns, targets};

/// Simulations of a batch at most.
const BATCH: usize = 256;

/// Normal force between bodies (N) from which they count as touching: above what a soft contact has at rounding.
const TOUCH: f64 = 1e-6;

/// A motion that was simulated at one point.
#[derive(Clone, Debug)]
pub struct Played {
    /// Readings of the sensors at the ends of the frames, `frames x width`; empty where it diverged.
    pub readings: Vec<f64>,
    /// Positions, `frames x nq`.
    pub qpos: Vec<f64>,
    /// By how much limits are passed.
    pub excess: Excess,
}

/// A column of the batch that is a property of a drive.
struct DriveColumn {
    column: usize,
    actuator: usize,
    attribute: String,
    index: usize,
    nominal: f64,
}

/// What plays motions.
pub struct Player<'a> {
    /// The machine.
    pub(crate) plant: &'a Plant,
    limits: Limits,
    parameters: Vec<Parameter>,
    drives: Vec<DriveColumn>,
    simulator: Box<dyn Simulator>,
    record: Recording,
    /// Sensors that tell, with their noise.
    pub signals: Vec<Signal>,
    /// Differences of readings in units of the noise.
    pub differences: SignalSet,
    readings: usize,
    /// Which of the pairs that should stay apart touch at rest already, and may.
    touching: Vec<bool>,
    /// Commands at rest.
    pub(crate) base: Vec<f64>,
    /// Seconds that the machine settles under them before a motion.
    pub(crate) settle: f64,
}

impl<'a> Player<'a> {
    /// A player of motions that begin after `settle` seconds under the commands `base`.
    ///
    /// # Errors
    /// When the engine cannot set a target, or a sensor is unknown.
    pub fn new(
        model: &dyn Model,
        plant: &'a Plant,
        limits: Limits,
        parameters: &[Parameter],
        signals: &[Signal],
        (base, settle): (&[f64], f64),
        threads: usize,
    ) -> Result<Self> {
        let layout = &plant.layout;
        let mut names: Vec<String> = signals.iter().map(|s| s.sensor.clone()).collect();
        let sensors = names.len();
        names.extend(layout.joints.iter().map(|j| format!("qpos.{}", j.name)));
        names.extend(layout.joints.iter().map(|j| format!("qvel.{}", j.name)));
        let bodies = &layout.bodies;
        names.extend(
            limits
                .apart
                .iter()
                .map(|[a, b]| format!("contact.{}/{}", bodies[*a], bodies[*b])),
        );
        let record = layout.recording(&names)?;
        let simulator = model.simulator(&BatchConfig {
            size: BATCH,
            threads,
            targets: targets(parameters),
        })?;
        let targets = targets(parameters);
        let drives = targets.iter().enumerate().filter_map(|(column, target)| {
            let of = |a: &asid_core::layout::Actuator| a.name == target.name;
            Some(DriveColumn {
                column,
                actuator: (target.element == "actuator")
                    .then(|| layout.actuators.iter().position(of))??,
                attribute: target.attribute.clone(),
                index: target.index,
                nominal: model.nominal(target).ok()?,
            })
        });
        Ok(Self {
            plant,
            drives: drives.collect(),
            parameters: parameters.to_vec(),
            simulator,
            readings: match sensors {
                0 => 0,
                n => record.range(n - 1).end,
            },
            record,
            differences: SignalSet::new(layout, signals)?,
            signals: signals.to_vec(),
            touching: vec![false; limits.apart.len()],
            limits,
            base: base.to_vec(),
            settle,
        })
    }

    /// Physics steps so far.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.simulator.steps_taken()
    }

    /// Velocities of the machine, `nv`.
    #[must_use]
    pub fn coordinates(&self) -> usize {
        self.plant.layout.nv
    }

    /// The limits.
    #[must_use]
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Entries of a row of readings.
    #[must_use]
    pub fn width(&self) -> usize {
        self.readings
    }

    /// Puts simulations to rest at values of the parameters; returns the largest speed that is left (rad/s or m/s).
    fn begin(&mut self, points: &[&[f64]]) -> Result<f64> {
        let sims: Vec<usize> = (0..points.len()).collect();
        let values: Vec<f64> = points
            .iter()
            .flat_map(|p| columns(&self.parameters, p))
            .collect();
        self.simulator.reset(&sims)?;
        self.simulator.set_parameters(&sims, &values)?;
        let (qpos, qvel) = home(&self.plant.layout);
        self.simulator
            .set_state(&sims, &qpos.repeat(sims.len()), &qvel.repeat(sims.len()))?;
        let steps = (self.settle / self.plant.layout.timestep).round() as usize;
        if steps == 0 {
            return Ok(0.0);
        }
        let names: Vec<String> = self
            .plant
            .layout
            .joints
            .iter()
            .map(|j| format!("qvel.{}", j.name))
            .collect();
        let record = self.plant.layout.recording(&names)?;
        let mut out = vec![0.0; sims.len() * record.width()];
        let control = Control::Shared(&self.base);
        self.simulator
            .rollout(&Rollout::new(&sims, 1, steps, control, &record), &mut out)?;
        Ok(out.iter().fold(0.0, |worst, v| {
            if v.is_finite() {
                f64::max(worst, v.abs())
            } else {
                f64::INFINITY
            }
        }))
    }

    /// The largest speed (rad/s or m/s) that is left after settling, over some points.
    ///
    /// # Errors
    /// As [`Player::play`].
    pub fn unrest(&mut self, points: &[Vec<f64>]) -> Result<f64> {
        let points: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
        points
            .chunks(BATCH)
            .try_fold(0.0, |worst: f64, chunk| Ok(worst.max(self.begin(chunk)?)))
    }

    /// Lets bodies touch that do so at rest, as feet do the ground; their names.
    ///
    /// # Errors
    /// As [`Player::play`].
    pub fn allow_present_contacts(&mut self, point: &[f64]) -> Result<Vec<[String; 2]>> {
        self.begin(&[point])?;
        let mut row = vec![0.0; self.record.width()];
        self.simulator.read(&[0], &self.record, &mut row)?;
        let pairs = self.limits.apart.len();
        let forces = &row[row.len() - pairs..];
        for (touching, force) in self.touching.iter_mut().zip(forces) {
            *touching = force.abs() > TOUCH;
        }
        let bodies = &self.plant.layout.bodies;
        let present = self
            .limits
            .apart
            .iter()
            .zip(&self.touching)
            .filter(|(_, t)| **t);
        Ok(present
            .map(|(pair, _)| pair.map(|b| bodies[b].clone()))
            .collect())
    }

    /// Looks at the posture that motions begin in, at values of the parameters. A joint that rests at the end of its range there, a hair
    /// within it or beyond it as a stop gives way, may go on doing so: the names of such joints, and by how much other limits are passed.
    ///
    /// # Errors
    /// As [`Player::play`].
    pub fn look_at_begin(&mut self, point: &[f64]) -> Result<(Vec<String>, Excess)> {
        self.begin(&[point])?;
        let layout = &self.plant.layout;
        let (nq, nv) = (layout.nq, layout.nv);
        let mut row = vec![0.0; self.record.width()];
        self.simulator.read(&[0], &self.record, &mut row)?;
        let state = &row[self.readings..self.readings + nq + nv];
        let at_stop = self.limits.joints.iter_mut().filter_map(|joint| {
            let [low, high] = joint.position.as_mut()?;
            let (at, hair) = (state[joint.qpos], STOP * (*high - *low));
            let is_low = (at - *low).abs() <= hair;
            let is_high = (at - *high).abs() <= hair;
            if is_low {
                *low -= hair;
            }
            if is_high {
                *high += hair;
            }
            (is_low || is_high).then(|| joint.name.clone())
        });
        let at_stop = at_stop.collect();
        let mut excess = Excess::default();
        let drives = self.drives_at(point);
        self.look_at_joints(&state[..nq], &state[nq..], 1, &mut excess);
        self.look_at_drives(
            &drives,
            &self.base,
            (&state[..nq], &state[nq..], 1),
            &mut excess,
        );
        self.look_at_boxes(&state[..nq], 1, &mut excess);
        Ok((at_stop, excess))
    }

    /// The drives at values of the parameters.
    fn drives_at(&self, point: &[f64]) -> Vec<Option<Drive>> {
        let values = columns(&self.parameters, point);
        let mut drives = self.plant.drives.clone();
        for d in &self.drives {
            let drive = &mut drives[d.actuator];
            let at = [d.nominal, values[d.column]];
            *drive = drive.map(|law| law.with(&d.attribute, d.index, at));
        }
        drives
    }

    /// Does without settling.
    pub fn skip_settling(&mut self) {
        self.settle = 0.0;
    }

    /// Plays motions (commands `frames x nu` of frames of `substeps` physics steps), each at a point.
    ///
    /// # Errors
    /// When a value is not physical or the engine fails.
    pub fn play(&mut self, jobs: &[(&[f64], &[f64])], substeps: usize) -> Result<Vec<Played>> {
        let nu = self.plant.layout.nu();
        let mut all = Vec::with_capacity(jobs.len());
        for chunk in jobs.chunks(BATCH) {
            let points: Vec<&[f64]> = chunk.iter().map(|(_, p)| *p).collect();
            self.begin(&points)?;
            let sims: Vec<usize> = (0..chunk.len()).collect();
            let control: Vec<f64> = chunk.iter().flat_map(|(c, _)| c.iter().copied()).collect();
            let frames = chunk.first().map_or(0, |(c, _)| c.len()) / nu.max(1);
            let width = self.record.width();
            let mut out = vec![0.0; chunk.len() * frames * width];
            let rollout = Rollout::new(
                &sims,
                frames,
                substeps,
                Control::PerSimulation(&control),
                &self.record,
            );
            self.simulator.rollout(&rollout, &mut out)?;
            for (rows, (commands, point)) in out.chunks_exact((frames * width).max(1)).zip(chunk) {
                all.push(self.look(rows, (commands, &self.drives_at(point)), frames));
            }
        }
        Ok(all)
    }

    /// One trajectory beside the limits.
    fn look(
        &self,
        rows: &[f64],
        (commands, drives): (&[f64], &[Option<Drive>]),
        frames: usize,
    ) -> Played {
        let layout = &self.plant.layout;
        let (nq, nv, nu) = (layout.nq, layout.nv, layout.nu());
        let width = self.record.width();
        let mut excess = Excess::default();
        let mut played = Played {
            readings: Vec::with_capacity(frames * self.readings),
            qpos: Vec::with_capacity(frames * nq),
            excess: Excess::default(),
        };
        if rows.iter().any(|x| !x.is_finite()) {
            excess.add(DIVERGED, 1, || "the simulation diverges".into());
            played.excess = excess;
            return played;
        }
        for (k, row) in rows.chunks_exact(width).enumerate() {
            let q = &row[self.readings..self.readings + nq];
            let v = &row[self.readings + nq..self.readings + nq + nv];
            let contact = &row[self.readings + nq + nv..];
            self.look_at_joints(q, v, frames, &mut excess);
            let command = &commands[k * nu..(k + 1) * nu];
            self.look_at_drives(drives, command, (q, v, frames), &mut excess);
            let pairs = self.limits.apart.iter().zip(&self.touching);
            for ((pair, touching), force) in pairs.zip(contact) {
                if !touching && force.abs() > TOUCH {
                    excess.add(1.0, frames, || {
                        let [a, b] = pair.map(|b| &layout.bodies[b]);
                        format!("`{a}` touches `{b}`")
                    });
                }
            }
            self.look_at_boxes(q, frames, &mut excess);
            played.readings.extend_from_slice(&row[..self.readings]);
            played.qpos.extend_from_slice(q);
        }
        if let (Some(rest), Some(last)) = (self.limits.rest, rows.chunks_exact(width).last()) {
            let v = &last[self.readings + nq..self.readings + nq + nv];
            let fastest = v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            excess.add(fastest / rest - 1.0, 1, || {
                format!("speed at the end {fastest:.3}")
            });
        }
        played.excess = excess;
        played
    }

    fn look_at_joints(&self, q: &[f64], v: &[f64], frames: usize, excess: &mut Excess) {
        for joint in &self.limits.joints {
            if let Some([low, high]) = joint.position {
                let at = q[joint.qpos];
                let beyond = (low - at).max(at - high) / (high - low);
                excess.add(beyond, frames, || {
                    format!("position of `{}` {at:.3}", joint.name)
                });
            }
            if let Some(limit) = joint.speed {
                let speed = v[joint.dof].abs();
                excess.add(speed / limit - 1.0, frames, || {
                    format!("speed of `{}` {speed:.3}", joint.name)
                });
            }
        }
    }

    /// Forces of the drives under a row of commands.
    fn look_at_drives(
        &self,
        drives: &[Option<Drive>],
        command: &[f64],
        (q, v, frames): (&[f64], &[f64], usize),
        excess: &mut Excess,
    ) {
        let layout = &self.plant.layout;
        for limit in &self.limits.drives {
            let Some(drive) = drives[limit.actuator] else {
                continue;
            };
            let joint = &layout.joints[drive.joint];
            let command = command[limit.actuator];
            let force = drive.force(command, q[joint.qpos], v[joint.qvel]).abs();
            excess.add(force / limit.force - 1.0, frames, || {
                format!(
                    "force of `{}` {force:.3}",
                    layout.actuators[limit.actuator].name
                )
            });
        }
    }

    fn look_at_boxes(&self, q: &[f64], frames: usize, excess: &mut Excess) {
        if self.limits.boxes.is_empty() {
            return;
        }
        let mut jacobian = vec![0.0; 6 * self.plant.layout.nv];
        for limit in &self.limits.boxes {
            let pose = self
                .plant
                .point_jacobian(q, limit.body, [0.0; 3], &mut jacobian);
            let place = pose.translation.vector;
            let [low, high] = limit.corners;
            for k in 0..3 {
                let beyond = (low[k] - place[k]).max(place[k] - high[k]) / (high[k] - low[k]);
                excess.add(beyond, frames, || {
                    format!(
                        "`{}` at {:.3} m along {}",
                        limit.name,
                        place[k],
                        ["x", "y", "z"][k]
                    )
                });
            }
        }
    }
}

/// The number of physics steps of a frame of about `period` seconds.
///
/// # Errors
/// When the period is no positive number of seconds.
pub fn substeps(plant: &Plant, period: f64) -> Result<usize> {
    let steps = (period / plant.layout.timestep).round();
    if steps >= 1.0 && steps.is_finite() {
        return Ok(steps as usize);
    }
    Err(Error::Config {
        key: "period".into(),
        message: format!(
            "{period} s is shorter than the time step of the model, {} s",
            plant.layout.timestep
        ),
    })
}
