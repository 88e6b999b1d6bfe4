//! The engine's own bare loop, as a baseline for batches: servos and one call of rapier's pipeline
//! a step, in a plain loop.
//!
//! It omits what a simulation of a batch does besides: readings, the plausibility check of the
//! state, resistance to rolling and spinning, corrections of link velocities and floating roots,
//! and the guard against panics. It keeps the servos, without which the arm falls, and rapier's
//! hook that decides which shapes collide.

use std::sync::Arc;

use asid_core::{Error, Result, Scene};
use asid_core::{Layout, Target};
use rapier3d::math::Vector;
use rapier3d::pipeline::PhysicsPipeline;

use crate::compiled::Compiled;
use crate::pairs::Hooks;
use crate::parameter::ParameterSlot;
use crate::state::State;
use crate::tables::Tables;

/// A compiled scene whose worlds are stepped in a plain loop.
pub struct BareScene {
    compiled: Arc<Compiled>,
    slots: Vec<ParameterSlot>,
}

/// One simulation, stepped by its owner.
pub struct BareWorld {
    compiled: Arc<Compiled>,
    tables: Tables,
    state: State,
    pipeline: PhysicsPipeline,
}

impl BareScene {
    /// Compiles a scene; [`BareScene::world`] sets the `targets`.
    ///
    /// # Errors
    /// As for loading the scene and resolving the targets.
    pub fn new(scene: &Scene, targets: &[Target]) -> Result<Self> {
        let compiled = Arc::new(Compiled::new(scene)?);
        let slots = targets
            .iter()
            .map(|t| ParameterSlot::resolve(t, &compiled))
            .collect::<Result<_>>()?;
        Ok(Self { compiled, slots })
    }

    /// Names and places.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        &self.compiled.layout
    }

    /// A world in a state (`qpos`, `qvel`) with a value for each target.
    ///
    /// # Errors
    /// [`Error::Shape`] where a length does not fit.
    pub fn world(&self, values: &[f64], qpos: &[f64], qvel: &[f64]) -> Result<BareWorld> {
        let layout = &self.compiled.layout;
        if (values.len(), qpos.len(), qvel.len()) != (self.slots.len(), layout.nq, layout.nv) {
            return Err(Error::Shape("values or state do not fit the scene".into()));
        }
        let mut tables = self.compiled.nominal.clone();
        for (slot, &value) in self.slots.iter().zip(values) {
            slot.set(&mut tables, value);
        }
        let mut state = self.compiled.pristine.clone();
        state.rebuild(&self.compiled, &tables);
        state.set_coordinates(&self.compiled, qpos, qvel);
        Ok(BareWorld {
            compiled: Arc::clone(&self.compiled),
            tables,
            state,
            pipeline: PhysicsPipeline::new(),
        })
    }
}

impl BareWorld {
    /// Takes `substeps` steps for each command of `control` (`frames x nu`).
    pub fn run(&mut self, control: &[f64], substeps: usize) {
        let compiled = &*self.compiled;
        let g = self.tables.gravity.map(|x| x as f32);
        for command in control.chunks_exact(compiled.layout.nu().max(1)) {
            for _ in 0..substeps {
                self.state.drive(compiled, &self.tables, command, &[]);
                let hooks = Hooks {
                    table: &compiled.pairs,
                    friction: &self.tables.friction,
                    body_of: &compiled.body_of_geom,
                    links: &compiled.links,
                    trees: &compiled.trees,
                };
                let state = &mut self.state;
                self.pipeline.step(
                    Vector::new(g[0], g[1], g[2]),
                    &compiled.integration,
                    &mut state.islands,
                    &mut state.broad_phase,
                    &mut state.narrow_phase,
                    &mut state.bodies,
                    &mut state.colliders,
                    &mut state.impulse_joints,
                    &mut state.multibodies,
                    &mut state.soft_bodies,
                    &mut state.ccd,
                    &hooks,
                    &(),
                );
            }
        }
    }

    /// Writes its positions and velocities.
    pub fn coordinates(&self, qpos: &mut [f64], qvel: &mut [f64]) {
        self.state.coordinates(&self.compiled, qpos, qvel);
    }
}
