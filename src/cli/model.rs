//! Models from files that replace a task's scene: MJCF, or a refined model.

use std::path::Path;
use std::sync::Arc;

use asid_core::{Backend, Error, Layout, Model, Parameter, Result, Scene, Task};
use asid_effects::EffectSpec;
use asid_effects::refined::{Refined, as_compiled};
use asid_effects::refined_model::RefinedModel;
use asid_mjcf::Plant;

/// The unchanged scene of a task.
pub fn of_task(task: &dyn Task) -> RefinedModel {
    RefinedModel {
        scene: task.scene().clone(),
        parameters: Vec::new(),
        effects: Vec::new(),
    }
}

/// Compiles a scene and applies its values and effects.
pub fn compile(backend: &dyn Backend, source: &RefinedModel) -> Result<Arc<dyn Model>> {
    let model = backend.load(&source.scene)?;
    refine(backend, model, &source.scene, source, &[])
}

/// Applies the values and effects of a file to a compiled scene, and some more effects.
pub fn refine(
    backend: &dyn Backend,
    model: Arc<dyn Model>,
    scene: &Scene,
    source: &RefinedModel,
    more: &[EffectSpec],
) -> Result<Arc<dyn Model>> {
    if source.parameters.is_empty() && source.effects.is_empty() && more.is_empty() {
        return Ok(model);
    }
    let plant = Arc::new(as_compiled(&Plant::of(scene)?, &*model, scene.name())?);
    let effects = [&source.effects[..], more].concat();
    Ok(Refined::new(
        backend,
        model,
        plant,
        &source.parameters,
        &effects,
    )?)
}

/// What a task needs of a model that replaces its scene.
pub struct Needs<'a> {
    pub task: &'a dyn Task,
    /// Layout of the task's scene.
    pub layout: &'a Layout,
    pub parameters: &'a [Parameter],
}

impl Needs<'_> {
    /// Opens and compiles the file of the task's `role`, and adds `more` effects.
    pub fn open(
        &self,
        backend: &dyn Backend,
        path: &Path,
        role: &str,
        more: &[EffectSpec],
    ) -> Result<(RefinedModel, Arc<dyn Model>)> {
        let source = RefinedModel::open(path)?;
        let wrong = |e: Error| Error::Scene {
            scene: path.display().to_string(),
            message: format!("cannot stand for the task's {role}: {e}"),
        };
        let scene = backend.load(&source.scene)?;
        let model =
            refine(backend, Arc::clone(&scene), &source.scene, &source, &[]).map_err(wrong)?;
        self.check(&*model).map_err(wrong)?;
        let model = if more.is_empty() {
            model
        } else {
            refine(backend, scene, &source.scene, &source, more)?
        };
        Ok((source, model))
    }

    /// Checks that a model has what the task's protocols need.
    pub fn check(&self, model: &dyn Model) -> Result<()> {
        let (ours, theirs) = (self.layout, model.layout());
        let (exploration, downstream) = (self.task.exploration(), self.task.downstream());
        if ours.actuators.len() != theirs.actuators.len() {
            return Err(Error::Shape(format!(
                "it has {} actuators, the task commands {}",
                theirs.actuators.len(),
                ours.actuators.len()
            )));
        }
        for (i, actuator) in ours.actuators.iter().enumerate() {
            if theirs.actuator(&actuator.name)? != i {
                return Err(Error::Shape(format!(
                    "actuator `{}` has another place in the order",
                    actuator.name
                )));
            }
        }
        theirs.recording(&exploration.channels())?;
        theirs.recording(&downstream.channels)?;
        for body in exploration.contact.iter().flatten() {
            theirs.body(body)?;
        }
        for target in self.parameters.iter().flat_map(|p| &p.targets) {
            model.nominal(target)?;
        }
        for frame_period in [exploration.frame_period, downstream.frame_period] {
            asid_core::problem::substeps(theirs, frame_period)?;
        }
        let (mut qpos, _) = asid_core::problem::home(theirs);
        let middle: Vec<f64> = exploration
            .start
            .iter()
            .map(asid_core::task::Coordinate::center)
            .collect();
        self.task.place(theirs, &middle, &mut qpos)
    }
}
