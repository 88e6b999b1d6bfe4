//! The model under diagnosis on an engine, with or without effects.

use std::sync::Arc;

use asid_core::layout::Keyframe;
use asid_core::{Backend, Model, Result, Scene, Target};
use asid_effects::EffectSpec;
use asid_effects::refined::Refined;
use asid_mjcf::Plant;

use crate::home::default_state;

/// A scene compiled by an engine, what is known of its machine, and what the study's model
/// file has set and added already.
#[derive(Clone)]
pub struct Machine {
    /// The engine.
    pub backend: Arc<dyn Backend>,
    /// The document.
    pub scene: Scene,
    /// The machine.
    pub plant: Arc<Plant>,
    /// Threads; 0 for one a core.
    pub threads: usize,
    model: Arc<dyn Model>,
    fixed: Vec<(Target, f64)>,
    effects: Vec<EffectSpec>,
}

impl Machine {
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
        let mut plant = Plant::of(scene)?;
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

    /// The same machine, which begins elsewhere where a log does not say.
    #[must_use]
    pub(crate) fn beginning_at(&self, home: Keyframe) -> Self {
        let mut plant = Plant::clone(&self.plant);
        plant.layout.keyframes = vec![home];
        Self {
            plant: Arc::new(plant),
            ..self.clone()
        }
    }

    /// The same machine with half the time step.
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

    /// The model with more effects.
    ///
    /// # Errors
    /// As [`Refined::new`].
    pub fn with(&self, more: &[EffectSpec]) -> Result<Arc<dyn Model>> {
        if self.effects.is_empty() && more.is_empty() && self.fixed.is_empty() {
            return Ok(Arc::clone(&self.model));
        }
        Ok(self.refined(more)?)
    }

    /// The same, refined by nothing where there are none.
    ///
    /// # Errors
    /// As [`Refined::new`].
    pub fn refined(&self, more: &[EffectSpec]) -> Result<Arc<Refined>> {
        let effects = [&self.effects[..], more].concat();
        let (model, plant) = (Arc::clone(&self.model), Arc::clone(&self.plant));
        Refined::new(&*self.backend, model, plant, &self.fixed, &effects)
    }

    /// Effects that the study's model has already.
    #[must_use]
    pub fn given_effects(&self) -> &[EffectSpec] {
        &self.effects
    }
}
