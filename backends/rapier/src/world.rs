//! One simulation: its state, its parameters, and rapier's pipeline that steps it.

mod ahead;
mod divergence;
mod forces;

use std::panic::{AssertUnwindSafe, catch_unwind};

use asid_core::layout::Channel;
use asid_core::simulator::{StepHook, StepView};
use asid_core::{Recording, Status};
use nalgebra::Vector3;
use rapier3d::dynamics::RigidBodyHandle;
use rapier3d::math::{Rotation, Vector};
use rapier3d::pipeline::PhysicsPipeline;

use crate::compiled::Compiled;
use crate::contact;
use crate::pairs::Hooks;
use crate::parameter::ParameterSlot;
use crate::state::State;
use crate::tables::Tables;
use forces::MAX_FORCE;

/// One simulation of a batch.
pub struct World {
    /// State.
    pub state: State,
    /// Parameters.
    pub tables: Tables,
    /// Steps taken since its creation.
    pub steps: u64,
    pipeline: PhysicsPipeline,
    /// Bodies with an applied force in this step.
    pushed: Vec<RigidBodyHandle>,
    torques: Vec<(usize, Vector)>,
    /// Body whose applied force exceeds [`MAX_FORCE`] in this step.
    excess: Option<usize>,
    /// Orientations of floating roots before the step.
    rotations: Vec<Rotation>,
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    ctrl: Vec<f64>,
    force: Vec<f64>,
    live: Vec<f64>,
}

/// Inputs of one physics step.
pub struct StepInput<'a> {
    /// Command, `nu`.
    pub ctrl: &'a [f64],
    /// Bodies of the layout with applied force (N) and torque (N m).
    pub wrenches: &'a [(usize, &'a [f64])],
    /// Hook with physics that the engine lacks.
    pub hook: Option<&'a dyn StepHook>,
    /// Columns of the batch, which the hook may change for the step.
    pub slots: &'a [ParameterSlot],
    /// Row of the rollout, for the hook.
    pub row: usize,
    /// Physics step since the start of the rollout, for the hook.
    pub step: usize,
}

impl World {
    /// A simulation in the scene's start state with nominal parameters.
    pub fn new(compiled: &Compiled) -> Self {
        let mut world = Self {
            state: compiled.pristine.clone(),
            tables: compiled.nominal.clone(),
            steps: 0,
            pipeline: PhysicsPipeline::new(),
            pushed: Vec::new(),
            torques: Vec::new(),
            excess: None,
            rotations: Vec::new(),
            qpos: vec![0.0; compiled.layout.nq],
            qvel: vec![0.0; compiled.layout.nv],
            ctrl: vec![0.0; compiled.layout.nu()],
            force: vec![0.0; compiled.layout.nv],
            live: Vec::new(),
        };
        world.reset(compiled);
        world
    }

    /// Resets it to the scene's start state, at time zero.
    pub fn reset(&mut self, compiled: &Compiled) {
        self.place(compiled, &compiled.start.0, &compiled.start.1, 0.0);
    }

    /// Sets a state without a history.
    pub fn place(&mut self, compiled: &Compiled, qpos: &[f64], qvel: &[f64], time: f64) {
        self.adopt(compiled, &compiled.pristine);
        self.state.set_coordinates(compiled, qpos, qvel);
        self.state.fresh = true;
        self.state.time = time;
    }

    /// Takes over a state and applies this simulation's parameters.
    pub fn adopt(&mut self, compiled: &Compiled, state: &State) {
        self.state.clone_from(state);
        self.state.rebuild(compiled, &self.tables);
        // The pipeline remembers which impulse joints it selected last.
        if !self.state.impulse_joints.is_empty() {
            self.pipeline = PhysicsPipeline::new();
        }
    }

    /// Takes one physics step; a failure of the engine is recorded in the status.
    ///
    /// # Panics
    /// When the hook panics.
    pub fn step(&mut self, compiled: &Compiled, input: &StepInput<'_>) {
        if !self.state.status.is_running() {
            return;
        }
        self.ctrl.copy_from_slice(input.ctrl);
        if let Some(hook) = input.hook {
            self.ask(compiled, input, hook);
        }
        let outcome = catch_unwind(AssertUnwindSafe(|| self.try_step(compiled, input)));
        if input.hook.is_some() {
            // Back to the parameters as set, also after a failure.
            self.swap_live(compiled, input.slots);
        }
        self.state.fresh = false;
        self.steps += 1;
        let excess = self.excess.take().map(|body| {
            let name = &compiled.layout.bodies[body];
            format!("a force on body `{name}` is beyond {MAX_FORCE} N")
        });
        let message = match outcome {
            Ok(()) => excess.or_else(|| self.complaint(compiled)),
            Err(panic) => Some(
                panic
                    .downcast_ref::<String>()
                    .cloned()
                    .or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()))
                    .unwrap_or_else(|| "rapier failed".into()),
            ),
        };
        self.state.time += compiled.layout.timestep;
        if let Some(message) = message {
            self.pipeline = PhysicsPipeline::new();
            self.state.status = Status::Diverged {
                time: self.state.time,
                message,
            };
        }
    }

    /// Shows the state to a hook, and applies the parameters that it wants for this step.
    fn ask(&mut self, compiled: &Compiled, input: &StepInput<'_>, hook: &dyn StepHook) {
        self.state
            .coordinates(compiled, &mut self.qpos, &mut self.qvel);
        self.force.fill(0.0);
        self.live.clear();
        self.live.extend(input.slots.iter().map(|slot| {
            if slot.is_live() {
                slot.get(&self.tables, compiled)
            } else {
                0.0
            }
        }));
        let mut view = StepView {
            time: self.state.time,
            qpos: &self.qpos,
            qvel: &self.qvel,
            ctrl: &mut self.ctrl,
            force: &mut self.force,
            parameters: &mut self.live,
        };
        hook.before_step(input.row, input.step, &mut view);
        self.swap_live(compiled, input.slots);
    }

    fn try_step(&mut self, compiled: &Compiled, input: &StepInput<'_>) {
        let hooked: &[f64] = match input.hook {
            Some(_) => &self.force,
            None => &[],
        };
        self.state.refresh_link_velocities(compiled);
        self.state.drive(compiled, &self.tables, &self.ctrl, hooked);
        if input.hook.is_some() {
            self.push_generalised(compiled);
        }
        for (body, wrench) in input.wrenches {
            let force = Vector3::from_column_slice(&wrench[..3]);
            let torque = Vector3::from_column_slice(&wrench[3..6]);
            self.push(compiled, *body, &force, &torque);
        }
        self.resist(compiled);

        self.rotations.clear();
        for &body in &compiled.floating {
            self.rotations
                .push(self.state.root_rotation(compiled, body));
        }
        let State {
            bodies,
            colliders,
            islands,
            broad_phase,
            narrow_phase,
            impulse_joints,
            multibodies,
            soft_bodies,
            ccd,
            ..
        } = &mut self.state;
        let hooks = Hooks {
            table: &compiled.pairs,
            friction: &self.tables.friction,
            body_of: &compiled.body_of_geom,
            links: &compiled.links,
            trees: &compiled.trees,
        };
        let g = self.tables.gravity;
        self.pipeline.step(
            Vector::new(g[0] as f32, g[1] as f32, g[2] as f32),
            &compiled.integration,
            islands,
            broad_phase,
            narrow_phase,
            bodies,
            colliders,
            impulse_joints,
            multibodies,
            soft_bodies,
            ccd,
            &hooks,
            &(),
        );
        for handle in self.pushed.drain(..) {
            if let Some(body) = bodies.get_mut(handle) {
                body.reset_forces(false);
                body.reset_torques(false);
            }
        }
        for (&body, &before) in compiled.floating.iter().zip(&self.rotations) {
            self.state.correct_root(compiled, body, before);
        }
    }

    /// Exchanges the live parameters with the values that the hook wants.
    fn swap_live(&mut self, compiled: &Compiled, slots: &[ParameterSlot]) {
        for (slot, wanted) in slots.iter().zip(&mut self.live) {
            if slot.is_live() {
                let set = slot.get(&self.tables, compiled);
                if *wanted != set {
                    slot.set(&mut self.tables, *wanted);
                }
                *wanted = set;
            }
        }
    }

    /// Reads channels into a row; NaN where the simulation has diverged.
    pub fn read(&mut self, compiled: &Compiled, record: &Recording, row: &mut [f64]) {
        if !self.state.status.is_running() {
            row.fill(f64::NAN);
            return;
        }
        let coordinates = record
            .channels()
            .iter()
            .any(|c| matches!(c, Channel::Position { .. } | Channel::Velocity { .. }));
        if coordinates {
            self.state
                .coordinates(compiled, &mut self.qpos, &mut self.qvel);
        }
        let touches = |c: &Channel| matches!(c, Channel::ContactForce { .. });
        let ahead = (self.state.fresh && record.channels().iter().any(touches))
            .then(|| self.ahead(compiled));
        let touching = ahead.as_ref().unwrap_or(&self.state);
        for (i, channel) in record.channels().iter().enumerate() {
            let out = &mut row[record.range(i)];
            match *channel {
                Channel::Sensor { index } => {
                    compiled.sensors[index].read(&self.state, compiled, out)
                }
                Channel::Position { start, len } => {
                    out.copy_from_slice(&self.qpos[start..start + len])
                }
                Channel::Velocity { start, len } => {
                    out.copy_from_slice(&self.qvel[start..start + len])
                }
                Channel::ContactForce { bodies } => {
                    out[0] = contact::normal_force(
                        &touching.narrow_phase,
                        &touching.colliders,
                        &compiled.body_of_geom,
                        bodies,
                        compiled.layout.timestep,
                    );
                }
            }
        }
    }
}
