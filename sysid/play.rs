//! Simulates motions in batches, at several values of the unknowns, and checks all limits.

use asid_core::error::Result;
use asid_core::layout::Recording;
use asid_core::problem::home;
use asid_core::signal::Signal;
use asid_core::simulator::{BatchConfig, Simulator};
use asid_core::{Control, Error, Model, Parameter, Rollout};
use asid_mjcf::Plant;
use asid_readings::SignalSet;

use crate::limits::{Excess, Limits};
use crate::{columns, targets};

/// Most simulations in a batch.
const BATCH: usize = 256;

/// Normal force between bodies (N) above which they count as touching.
///
/// It exceeds the rounding of a soft contact.
pub(crate) const TOUCH: f64 = 1e-6;

/// A motion simulated at one point.
#[derive(Clone, Debug)]
pub struct Played {
    /// Readings of the sensors at the ends of the frames, `frames x width`; empty where it
    /// diverged.
    pub readings: Vec<f64>,
    /// Positions, `frames x nq`.
    pub qpos: Vec<f64>,
    /// Violations of limits.
    pub excess: Excess,
}

/// A column of the batch that is a parameter of a drive.
pub(crate) struct DriveColumn {
    pub(crate) column: usize,
    pub(crate) actuator: usize,
    pub(crate) attribute: String,
    pub(crate) index: usize,
    pub(crate) nominal: f64,
}

/// Simulates motions of a machine.
pub struct Player<'a> {
    /// The machine.
    pub(crate) plant: &'a Plant,
    pub(crate) limits: Limits,
    pub(crate) parameters: Vec<Parameter>,
    pub(crate) drives: Vec<DriveColumn>,
    pub(crate) simulator: Box<dyn Simulator>,
    pub(crate) record: Recording,
    /// Sensors that count, with their noise.
    pub signals: Vec<Signal>,
    /// Differences of readings in units of the noise.
    pub differences: SignalSet,
    pub(crate) readings: usize,
    /// Whether each pair of `limits.apart` already touches at rest, and therefore may.
    pub(crate) touching: Vec<bool>,
    /// Commands at rest.
    pub(crate) base: Vec<f64>,
    /// Time that the machine settles under the commands at rest before a motion, s.
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
        names.extend(layout.state_channels());
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

    /// Number of velocity coordinates, `nv`.
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

    /// Brings simulations to rest at parameter values.
    ///
    /// Returns the largest speed that remains (rad/s or m/s).
    pub(crate) fn begin(&mut self, points: &[&[f64]]) -> Result<f64> {
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

    /// The largest speed (rad/s or m/s) that remains after settling, over some points.
    ///
    /// # Errors
    /// As [`Player::play`].
    pub fn unrest(&mut self, points: &[Vec<f64>]) -> Result<f64> {
        let points: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
        points
            .chunks(BATCH)
            .try_fold(0.0, |worst: f64, chunk| Ok(worst.max(self.begin(chunk)?)))
    }

    /// Allows contacts that exist at rest, as of feet on the ground; returns the names of the
    /// bodies.
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

    /// Turns settling off.
    pub fn skip_settling(&mut self) {
        self.settle = 0.0;
    }

    /// Simulates jobs of commands and parameter values.
    ///
    /// Commands are `frames x nu`, with frames of `substeps` physics steps.
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
            // A frame's command begins to act at the state before the frame.
            let mut first = vec![0.0; chunk.len() * width];
            self.simulator.read(&sims, &self.record, &mut first)?;
            let mut out = vec![0.0; chunk.len() * frames * width];
            let rollout = Rollout::new(
                &sims,
                frames,
                substeps,
                Control::PerSimulation(&control),
                &self.record,
            );
            self.simulator.rollout(&rollout, &mut out)?;
            let each = out.chunks_exact((frames * width).max(1));
            for ((rows, first), (commands, point)) in each.zip(first.chunks(width)).zip(chunk) {
                let drives = self.drives_at(point);
                all.push(self.look((first, rows), (commands, &drives), (frames, substeps)));
            }
        }
        Ok(all)
    }
}

/// The number of physics steps of a frame of about `period` seconds.
///
/// # Errors
/// When the period is shorter than a time step, or not a finite number.
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
