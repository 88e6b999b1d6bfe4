//! The data of a diagnosis: logs as walks, and a first estimate of the model along them.

use asid_core::layout::{JointKind, Layout};
use asid_core::{Parameter, Result};
use asid_effects::{EffectSpec, Reach};
use asid_mjcf::Plant;

use crate::data::Logs;
use crate::machine::Machine;
use crate::predict::State;

use super::estimate::Estimate;
use super::initial::{open_by_reading, position_noise, start, start_of_segment};
use super::islands::Islands;
use super::one_step::both_ways;
use super::smoother::{NoiseModel, Start};
use super::step_error::StepError;
use super::step_map::{Derivatives, StepMap};
use super::walk::Walk;

/// Finite-difference step of a segment's initial state, as a share of what its readings leave open.
///
/// It is small against the prior, yet large enough to average over contact points that come and go.
const START_SHARE: f64 = 0.02;
/// Correlation of the missing force from row to row with which the search begins.
const FIRST_CORRELATION: f64 = 0.9;
/// Standard deviation of the white part with which the search begins, relative to the whole force.
const FIRST_WHITE: f64 = 0.1;
/// Finite-difference step of a force, N or N m: doubles resolve the motion of inertias from 1e-5 to
/// 1e3.
pub(super) const PUSH: f64 = 1e-4;

/// The data of a diagnosis: logs of a machine, walked row by row.
pub struct Context<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// The logs.
    pub logs: &'a Logs,
    /// The rows of the logs.
    pub walks: Vec<Walk>,
    /// Initial states that logs give, one a walk; `None` where a walk begins within a log.
    pub given: Vec<Option<State>>,
    /// Initial states of the walks by their readings, `nq + nv`, in the model without further
    /// effects.
    pub read: Vec<Vec<f64>>,
    /// Readings of that model there, in the order of the logs' channels.
    pub as_read: Vec<Vec<f64>>,
    /// Tangent coordinates of the initial states that logs leave open.
    pub open: Vec<usize>,
    /// Largest magnitude of each tangent coordinate.
    pub scale: Vec<f64>,
    /// Standard deviation of the reading of each position that a sensor reads directly, else 0;
    /// `nv`.
    pub position_noise: Vec<f64>,
    /// Variance of each entry of a reading, as given or first estimated, times its entry in
    /// `alike`.
    pub reading_variance: Vec<f64>,
    /// Number of successive readings over which the noise of each entry counts as one error.
    ///
    /// For anything slow, correlated noise is as informative as white noise of that many times its
    /// variance.
    pub alike: Vec<f64>,
    /// Typical inertial force at each degree of freedom, N or N m.
    ///
    /// It is 1 if all walks are segments: no force is missing along them.
    pub inertial: Vec<f64>,
    /// Sets of degrees of freedom that nothing couples, in the model without further effects.
    pub islands: Islands,
    /// Whether the state derivatives of one physics step represent the row, in the model without
    /// further effects.
    pub one_step: bool,
    /// The engine's own error over the rows; empty before the first trajectory, and for an engine
    /// that takes no other time step.
    pub step_error: StepError,
}

/// Rows, initial states and states that a context begins from.
pub struct Taken {
    /// Rows.
    pub walks: Vec<Walk>,
    /// Initial states that logs give, one a walk; `None` where a walk begins within a log.
    pub given: Vec<Option<State>>,
    /// Tangent coordinates of the initial states that logs leave open.
    pub open: Vec<usize>,
    /// States by the readings of the whole logs, `rows x (nq + nv)`, one a walk.
    pub states: Vec<Vec<f64>>,
    /// Largest magnitude of each tangent coordinate.
    pub scale: Vec<f64>,
    /// Pairs of bodies that touch in some row.
    pub touching: Vec<[usize; 2]>,
}

impl Context<'_> {
    /// The machine's structure.
    #[must_use]
    pub fn plant(&self) -> &Plant {
        &self.machine.plant
    }

    /// Whether some walks are segments.
    #[must_use]
    pub fn has_segments(&self) -> bool {
        self.walks.iter().any(|w| w.segment.is_some())
    }

    /// Returns the context restricted to some of the walks.
    #[must_use]
    pub fn of_walks(&self, which: &[usize]) -> Context<'_> {
        Context {
            machine: self.machine,
            logs: self.logs,
            walks: which.iter().map(|&w| self.walks[w].clone()).collect(),
            given: which.iter().map(|&w| self.given[w].clone()).collect(),
            read: which.iter().map(|&w| self.read[w].clone()).collect(),
            as_read: which.iter().map(|&w| self.as_read[w].clone()).collect(),
            open: self.open.clone(),
            scale: self.scale.clone(),
            position_noise: self.position_noise.clone(),
            reading_variance: self.reading_variance.clone(),
            alike: self.alike.clone(),
            inertial: self.inertial.clone(),
            islands: self.islands.clone(),
            one_step: self.one_step,
            step_error: self.step_error.of_walks(which),
        }
    }

    /// Returns a step map of the machine with more effects; `roles` as in [`StepMap::new`].
    ///
    /// # Errors
    /// As [`StepMap::new`].
    pub fn map(
        &self,
        specs: &[EffectSpec],
        parameters: &[Parameter],
        roles: usize,
    ) -> Result<StepMap<'_>> {
        let rows = (self.logs, &self.walks[..]);
        let mut map = StepMap::new(self.machine, specs, parameters, rows, roles)?;
        map.by_one_step(self.one_step);
        if !self.has_segments() && self.within_islands(specs)? {
            map.apart(&self.islands);
        }
        Ok(map)
    }

    /// Whether no effect couples separate islands.
    fn within_islands(&self, specs: &[EffectSpec]) -> Result<bool> {
        for spec in specs {
            let reach = spec.find(self.plant())?.reach(self.plant(), &spec.site);
            let of_a_sensor = matches!(reach, Reach::Sensor(_));
            if !of_a_sensor && self.islands.reached(&reach).is_none() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The sensor of each entry of a reading, by index in the layout; the number of sensors if the
    /// layout lacks it.
    #[must_use]
    pub fn entry_sensors(&self) -> Vec<usize> {
        let layout = &self.plant().layout.sensors;
        let entries = self.logs.entries.iter();
        let name = entries.map(|e| &self.logs.sensors[e.sensor].name);
        let place = |name: &String| layout.iter().position(|s| s.name == *name);
        name.map(|n| place(n).unwrap_or(layout.len())).collect()
    }

    /// Finite-difference steps of the initial state of a segment.
    ///
    /// Each is a share of what the first readings leave open, so that points of contact that come
    /// and go average out.
    #[must_use]
    pub fn start_steps(&self) -> Vec<f64> {
        let scales = (&self.scale[..], &self.position_noise[..]);
        let open = (0..self.scale.len()).map(|i| open_by_reading(i, scales));
        open.map(|d| START_SHARE * d).collect()
    }

    /// Returns the priors of the walks' initial states, relative to a trajectory.
    ///
    /// `read` holds the initial states of segments by their readings.
    #[must_use]
    pub fn starts(&self, trajectory: &[Vec<f64>], read: &[Vec<f64>]) -> Vec<Start> {
        let width = self.plant().layout.nq + self.plant().layout.nv;
        let scales = (&self.scale[..], &self.position_noise[..]);
        let each = self.given.iter().zip(&self.walks).zip(read);
        each.zip(trajectory)
            .map(|(((given, walk), read), states)| {
                let first = &states[..width];
                let given = given.as_ref().map(|s| (s, &self.open[..]));
                if given.is_none() && walk.segment.is_some() {
                    return start_of_segment(self.plant(), read, first, scales);
                }
                start(self.plant(), given, first, scales)
            })
            .collect()
    }
}

/// Mean duration of a row over all walks, s.
fn row_seconds(walks: &[Walk]) -> f64 {
    let seconds: f64 = walks.iter().map(|w| w.time[w.len() - 1] - w.time[0]).sum();
    let rows: usize = walks.iter().map(|w| w.len() - 1).sum();
    seconds / rows.max(1) as f64
}

/// Raises the largest speeds per unit of each force over a row, `free`, to those of the rows in `b`
/// (`rows x nx x nv`).
pub(super) fn raise_free(free: &mut [f64], b: &[f64], rows: usize) {
    let nv = free.len();
    for k in 0..rows {
        for (d, free) in free.iter_mut().enumerate() {
            *free = free.max(b[(k * 2 * nv + nv + d) * nv + d]);
        }
    }
}

/// Gives all directions of a free body its largest force, and all its rotations its largest torque.
///
/// A body hardly moves along the direction that a contact blocks, but the forces along it are no
/// smaller.
fn level_blocks(layout: &Layout, forces: &mut [f64]) {
    for joint in &layout.joints {
        let first = joint.qvel;
        let blocks = match joint.kind {
            JointKind::Free => 2,
            JointKind::Ball => 1,
            JointKind::Hinge | JointKind::Slide => 0,
        };
        for block in forces[first..].chunks_exact_mut(3).take(blocks) {
            let largest = block.iter().copied().fold(0.0, f64::max);
            block.fill(largest);
        }
    }
}

/// Typical inertial force at each degree of freedom along some states, N or N m.
///
/// It is the mean acceleration seen, times the inertia. The inertia follows from the speed that a
/// force produces over a row (`b`); in segments, from the row where no contact takes the force up.
fn inertial(context: &Context<'_>, trajectory: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<f64> {
    let layout = &context.plant().layout;
    let (nv, width) = (layout.nv, layout.nq + layout.nv);
    let mut free = vec![0.0; nv];
    for (walk, b) in context.walks.iter().zip(b) {
        raise_free(&mut free, b, walk.len() - 1);
    }
    let mut sums = vec![(0.0, 0.0); nv];
    for ((walk, states), b) in context.walks.iter().zip(trajectory).zip(b) {
        for k in 0..walk.len() - 1 {
            for (d, sum) in sums.iter_mut().enumerate() {
                let own = b[(k * 2 * nv + nv + d) * nv + d];
                let gained = if walk.segment.is_some() { free[d] } else { own };
                let speed = |k: usize| states[k * width + layout.nq + d];
                if gained > 0.0 {
                    sum.0 += ((speed(k + 1) - speed(k)) / gained).abs();
                    sum.1 += 1.0;
                }
            }
        }
    }
    let mean = |(force, n): &(f64, f64)| (force / f64::max(*n, 1.0)).max(1e-9);
    let mut forces: Vec<f64> = sums.iter().map(mean).collect();
    if context.has_segments() {
        level_blocks(layout, &mut forces);
    }
    forces
}

/// Creates a context for some walks, and a first estimate of the model at `theta`, not yet
/// smoothed.
///
/// # Errors
/// When the engine fails.
pub fn begin<'a>(
    machine: &'a Machine,
    logs: &'a Logs,
    taken: Taken,
    (parameters, theta): (&[Parameter], &[f64]),
) -> Result<(Context<'a>, Estimate)> {
    let plant = &machine.plant;
    let layout = &plant.layout;
    let (nv, width) = (layout.nv, layout.nq + layout.nv);
    let mut trajectory = taken.states;
    let read: Vec<Vec<f64>> = trajectory.iter().map(|s| s[..width].to_vec()).collect();
    let (noise, alike) = (logs.entry_noise(), logs.entry_alike());
    let mut context = Context {
        machine,
        logs,
        given: taken.given,
        read,
        as_read: Vec::new(),
        open: taken.open,
        scale: taken.scale,
        position_noise: position_noise(plant, logs),
        reading_variance: noise.iter().zip(&alike).map(|(n, a)| n * n * a).collect(),
        alike,
        inertial: vec![1.0; nv],
        islands: Islands::one(nv, logs.entries.len()),
        walks: taken.walks,
        one_step: false,
        step_error: StepError::default(),
    };
    let ways = both_ways(&context, (&[], parameters), (theta, &trajectory))?;
    context.one_step = ways.one_step_tells(&context.scale);
    if !context.has_segments() {
        let sensors = context.entry_sensors();
        context.islands = Islands::of(plant, &sensors, &taken.touching, &ways.by_rows);
    }
    let mut map = context.map(&[], parameters, nv + 1)?;
    let as_read = map.readings_at(theta, &context.read)?;
    let all = vec![Some(f64::INFINITY); trajectory.len()];
    map.roll(theta, (&mut trajectory, &all), &context.reading_variance)?;
    let mut b = vec![Vec::new(); trajectory.len()];
    if !map.is_all_segments() {
        let want = Derivatives {
            force: true,
            ..Derivatives::default()
        };
        let push = vec![PUSH; nv];
        let linear = map.linearise(theta, &trajectory, want, &push, &[])?;
        b = linear.into_iter().map(|l| l.b).collect();
        context.inertial = inertial(&context, &trajectory, &b);
    }
    context.as_read = as_read;
    let tau = -row_seconds(&context.walks) / FIRST_CORRELATION.ln();
    let estimate = Estimate {
        noise: NoiseModel {
            q: context.inertial.iter().map(|f| f * f).collect(),
            tau: vec![tau; nv],
            white: context
                .inertial
                .iter()
                .map(|f| (FIRST_WHITE * f).powi(2))
                .collect(),
            r: context.reading_variance.clone(),
        },
        free: vec![Vec::new(); trajectory.len()],
        scatter: vec![Vec::new(); trajectory.len()],
        excess: vec![1.0; trajectory.len()],
        misled: vec![1.0; trajectory.len()],
        rolls: 0,
        least_white: vec![0.0; nv],
        told: vec![true; nv],
        smoothed: Vec::new(),
        log_likelihood: f64::NEG_INFINITY,
        trajectory,
        read: context.read.clone(),
        b,
    };
    Ok((context, estimate))
}
