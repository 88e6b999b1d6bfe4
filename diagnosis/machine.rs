//! The model under diagnosis on an engine, with or without effects.

use std::sync::Arc;

use asid_core::layout::Keyframe;
use asid_core::{Backend, Model, Result, Scene, Target};
use asid_effects::EffectSpec;
use asid_effects::refined::{Refined, as_compiled};
use asid_mjcf::Plant;

use crate::home::default_state;

/// A scene compiled by an engine, its machine, and the values and effects that the study's model
/// file has set and added.
#[derive(Clone)]
pub struct Machine {
    /// The engine.
    pub backend: Arc<dyn Backend>,
    /// The scene document.
    pub scene: Scene,
    /// The machine.
    pub plant: Arc<Plant>,
    /// Number of threads; 0 for one per core.
    pub threads: usize,
    model: Arc<dyn Model>,
    fixed: Vec<(Target, f64)>,
    effects: Vec<EffectSpec>,
}

impl Machine {
    /// Whether the model's own actuators remember commands, and the engine keeps that.
    #[must_use]
    pub fn remembers_commands(&self) -> bool {
        self.model.remembers_commands()
    }

    /// Compiles a scene.
    ///
    /// # Errors
    /// When the engine refuses it, or a value or effect of the model file.
    pub fn new(
        backend: Arc<dyn Backend>,
        scene: &Scene,
        fixed: &[(Target, f64)],
        effects: &[EffectSpec],
        threads: usize,
    ) -> Result<Self> {
        let model = backend.load(scene)?;
        let mut plant = as_compiled(&Plant::of(scene)?, &*model, scene.name())?;
        if plant.layout.keyframes.is_empty() {
            plant.layout.keyframes.push(default_state(&*model)?);
        }
        let machine = Self {
            plant: Arc::new(plant),
            model,
            backend,
            scene: scene.clone(),
            threads,
            fixed: fixed.to_vec(),
            effects: effects.to_vec(),
        };
        machine.with(&[])?;
        Ok(machine)
    }

    /// Returns the same machine with another initial state for logs that give none.
    #[must_use]
    pub(crate) fn beginning_at(&self, home: Keyframe) -> Self {
        let mut plant = Plant::clone(&self.plant);
        plant.layout.keyframes = vec![home];
        Self {
            plant: Arc::new(plant),
            ..self.clone()
        }
    }

    /// Returns the same machine with half the time step.
    ///
    /// # Errors
    /// As [`Machine::new`].
    pub fn halved(&self) -> Result<Self> {
        let scene = self.scene.with_timestep(self.plant.layout.timestep / 2.0)?;
        let (fixed, effects) = (&self.fixed, &self.effects);
        let finer = Self::new(
            Arc::clone(&self.backend),
            &scene,
            fixed,
            effects,
            self.threads,
        )?;
        let home = self.plant.layout.keyframes.first();
        Ok(home.map_or(finer.clone(), |home| finer.beginning_at(home.clone())))
    }

    /// Returns the model with further effects.
    ///
    /// # Errors
    /// As [`Refined::new`].
    pub fn with(&self, more: &[EffectSpec]) -> Result<Arc<dyn Model>> {
        if self.effects.is_empty() && more.is_empty() && self.fixed.is_empty() {
            return Ok(Arc::clone(&self.model));
        }
        Ok(self.refined(more)?)
    }

    /// Returns the model with further effects as a [`Refined`] one, even if nothing is refined.
    ///
    /// # Errors
    /// As [`Refined::new`].
    pub fn refined(&self, more: &[EffectSpec]) -> Result<Arc<Refined>> {
        let effects = [&self.effects[..], more].concat();
        let (model, plant) = (Arc::clone(&self.model), Arc::clone(&self.plant));
        Refined::new(&*self.backend, model, plant, &self.fixed, &effects)
    }

    /// Returns the effects that the study's model has already.
    #[must_use]
    pub fn given_effects(&self) -> &[EffectSpec] {
        &self.effects
    }
}
