//! A compiled scene with effects, usable as any other model.
//!
//! The effects wrap the engine's model and its batches. Exploration, identification, the task's
//! solver and the diagnosis therefore use a refined simulator without knowing it. Each simulation
//! of a batch has effects of its own, whose parameters are columns like the scene's:
//! `effect/NAME@SITE/PARAMETER`. A row whose effect has null values runs without it, at no cost.

mod compiled;
mod ranges;
mod rows;
mod simulator;

use std::sync::Arc;

use crate::{Acts, Effect, EffectSpec};
use asid_core::backend::{Backend, Capabilities, Model};
use asid_core::error::{Error, Result};
use asid_core::layout::Layout;
use asid_core::scene::Scene;
use asid_core::simulator::{BatchConfig, Simulator};
use asid_core::target::Target;
use asid_mjcf::plant::Plant;
pub use compiled::as_compiled;
use ranges::{Ranged, behind_ranges, ranged};
use rows::Effects;
use simulator::Column;
pub use simulator::RefinedSimulator;

/// Target of the column that holds the number of a simulation's episode; 0 if it is not set.
///
/// Models whose effects [count episodes](Effect::counts_episodes) have this column.
#[must_use]
pub fn episode_number() -> Target {
    Target {
        element: "episode".into(),
        name: String::new(),
        attribute: "number".into(),
        index: 0,
    }
}

/// The target [`episode_number`], if the model has it.
#[must_use]
pub fn counts_episodes(model: &dyn Model) -> Option<Target> {
    let column = episode_number();
    model.nominal(&column).is_ok().then_some(column)
}

/// An effect with its site and values.
struct Placed {
    label: String,
    site: String,
    effect: Box<dyn Effect>,
    values: Vec<f64>,
    targets: Vec<Target>,
    /// Index of the sensor whose readings it changes.
    sensor: Option<usize>,
}

impl Placed {
    fn parameter(&self, target: &Target) -> Result<usize> {
        let parameters = self.effect.parameters();
        let place = parameters.iter().position(|p| p.name == target.attribute);
        place.ok_or_else(|| {
            Error::unknown(
                "effect parameter",
                &target.attribute,
                parameters.iter().map(|p| p.name),
            )
        })
    }
}

/// A model with effects and with values that override the document's.
pub struct Refined {
    inner: Arc<dyn Model>,
    plant: Arc<Plant>,
    placed: Arc<Vec<Placed>>,
    ranged: Vec<Ranged<Target>>,
    fixed: Vec<(Target, f64)>,
}

impl Refined {
    /// Gives `model` some parameter values and effects.
    ///
    /// `backend` must have compiled `model` from the scene of `plant`, which is [`as_compiled`].
    ///
    /// # Errors
    /// When an effect, site, parameter or target is unknown, or is not for this engine.
    pub fn new(
        backend: &dyn Backend,
        model: Arc<dyn Model>,
        plant: Arc<Plant>,
        fixed: &[(Target, f64)],
        effects: &[EffectSpec],
    ) -> Result<Arc<Self>> {
        let plant = behind_ranges(&plant, model.layout());
        let mut placed: Vec<Placed> = Vec::with_capacity(effects.len());
        for spec in effects {
            let effect = spec.find(&plant)?;
            let values = spec.values_of(&*effect)?;
            let label = spec.label();
            if placed.iter().any(|p| p.label == label) {
                return Err(Error::Config {
                    key: "effect".into(),
                    message: format!("`{label}` is named twice"),
                });
            }
            let lacking = needs(&*effect) - backend.capabilities();
            if !lacking.is_empty() {
                return Err(Error::Incapable {
                    backend: backend.name().to_owned(),
                    what: format!("give a scene the effect `{label}`: it needs {lacking:?}"),
                });
            }
            let targets = effect.targets(&plant, &spec.site);
            for target in &targets {
                model.nominal(target)?;
            }
            let sensors = &plant.layout.sensors;
            let sensor = match effect.acts() {
                Acts::Measurement => sensors.iter().position(|s| s.name == spec.site),
                _ => None,
            };
            placed.push(Placed {
                label,
                site: spec.site.clone(),
                effect,
                values,
                targets,
                sensor,
            });
        }
        placed.sort_by_key(|p| rank(&*p.effect));
        for (target, _) in fixed {
            model.nominal(target)?;
        }
        let refined = Arc::new(Self {
            ranged: ranged(&*model, &plant, &placed),
            inner: model,
            plant: Arc::new(plant),
            placed: Arc::new(placed),
            fixed: fixed.to_vec(),
        });
        // Simulators check values; a batch of one does so now.
        refined.simulator(&BatchConfig {
            size: 1,
            threads: 1,
            targets: Vec::new(),
        })?;
        Ok(refined)
    }

    /// Compiles a scene with effects.
    ///
    /// # Errors
    /// As [`Backend::load`] and [`Refined::new`].
    pub fn load(backend: &dyn Backend, scene: &Scene, effects: &[EffectSpec]) -> Result<Arc<Self>> {
        let model = backend.load(scene)?;
        let plant = as_compiled(&Plant::of(scene)?, &*model, scene.name())?;
        Self::new(backend, model, Arc::new(plant), &[], effects)
    }

    /// Whether a target is the number of the episode.
    fn is_episode(&self, target: &Target) -> bool {
        let counts = || self.placed.iter().any(|p| p.effect.counts_episodes());
        *target == episode_number() && counts()
    }

    /// The effect and its parameter that a target names; `None` for a target of the scene.
    fn effect_column(&self, target: &Target) -> Result<Option<(usize, usize)>> {
        if target.element != "effect" {
            return Ok(None);
        }
        let labels = self.placed.iter().map(|p| &*p.label);
        let effect = self
            .placed
            .iter()
            .position(|p| p.label == target.name)
            .ok_or_else(|| Error::unknown("effect of this model", &target.name, labels))?;
        let parameter = self.placed[effect].parameter(target)?;
        Ok(Some((effect, parameter)))
    }
}

/// Capabilities that an engine needs for an effect, hooks included.
#[must_use]
pub fn needs(effect: &dyn Effect) -> Capabilities {
    if effect.steps() {
        effect.needs() | Capabilities::STEP_HOOKS
    } else {
        effect.needs()
    }
}

/// Place of an effect in the order in which a simulation applies them.
///
/// Effects on commands come first, since a force may depend on the command that reaches the drive,
/// and limits of the force are the last of them. One that takes the drive from its joint comes after
/// all that depend on the drive.
pub(crate) fn rank(effect: &dyn Effect) -> u8 {
    let nulls: Vec<f64> = effect.parameters().iter().map(|p| p.null).collect();
    match effect.acts() {
        Acts::Command if effect.force_limit(&nulls).is_some() => 1,
        Acts::Command => 0,
        _ if effect.takes_drive() => 3,
        _ => 2,
    }
}

impl Model for Refined {
    fn layout(&self) -> &Layout {
        self.inner.layout()
    }

    fn engine(&self) -> String {
        self.inner.engine()
    }

    fn remembers_commands(&self) -> bool {
        self.inner.remembers_commands()
    }

    fn nominal(&self, target: &Target) -> Result<f64> {
        if self.is_episode(target) {
            return Ok(0.0);
        }
        if let Some((effect, parameter)) = self.effect_column(target)? {
            return Ok(self.placed[effect].values[parameter]);
        }
        let fixed = self.fixed.iter().find(|(t, _)| t == target);
        fixed.map_or_else(|| self.inner.nominal(target), |(_, value)| Ok(*value))
    }

    fn simulator(&self, config: &BatchConfig) -> Result<Box<dyn Simulator>> {
        Ok(Box::new(self.batch(config)?))
    }
}

impl Refined {
    /// A batch, as [`Model::simulator`] makes it.
    ///
    /// # Errors
    /// As [`Model::simulator`].
    pub fn batch(&self, config: &BatchConfig) -> Result<RefinedSimulator> {
        let mut targets: Vec<Target> = Vec::new();
        let mut place = |target: &Target| match targets.iter().position(|t| t == target) {
            Some(i) => i,
            None => {
                targets.push(target.clone());
                targets.len() - 1
            }
        };
        let columns = config
            .targets
            .iter()
            .map(|target| {
                if self.is_episode(target) {
                    return Ok(Column::Episode);
                }
                Ok(match self.effect_column(target)? {
                    None => Column::Model(place(target)),
                    Some((effect, parameter)) => Column::Effect(effect, parameter),
                })
            })
            .collect::<Result<Vec<_>>>()?;
        for (target, _) in &self.fixed {
            place(target);
        }
        let places: Vec<Vec<usize>> = self
            .placed
            .iter()
            .map(|p| p.targets.iter().map(&mut place).collect())
            .collect();
        let ranged = self.ranged.iter().map(|drive| Ranged {
            actuator: drive.actuator,
            gains: drive.gains.iter().map(&mut place).collect(),
            by: drive.by.clone(),
        });
        let ranged = ranged.collect();
        let held = targets.iter().enumerate();
        let held = held.filter(|(_, t)| !self.placed.is_empty() && self.plant.holds(t));
        let held = held
            .map(|(at, t)| Ok((at, t.clone(), self.inner.nominal(t)?)))
            .collect::<Result<Vec<_>>>()?;
        let base = targets
            .iter()
            .map(|t| self.nominal(t))
            .collect::<Result<Vec<_>>>()?;
        let inner = self.inner.simulator(&BatchConfig {
            targets,
            ..config.clone()
        })?;
        let nominal = config
            .targets
            .iter()
            .map(|t| self.nominal(t))
            .collect::<Result<Vec<_>>>()?;
        let effects = Effects {
            plant: Arc::clone(&self.plant),
            placed: Arc::clone(&self.placed),
            places,
            held,
            ranged,
        };
        let mut simulator = RefinedSimulator::new(inner, effects, base, columns)?;
        let all: Vec<usize> = (0..config.size).collect();
        simulator.set_parameters(&all, &nominal.repeat(config.size))?;
        Ok(simulator)
    }
}
