//! What the maker of a model does not know of the machine, and the models that follow from it.

use std::sync::Arc;

use asid_core::registry;
use asid_core::{Backend, Error, Model, Parameter, Result, Scene, Streams, Target};
use asid_effects::EffectSpec;
use asid_mjcf::Plant;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::ensemble::Ensemble;
use crate::{Perturbation, PerturbationRanges, perturb};

/// Key of the section in a configuration.
pub const MODEL_ERRORS: &str = "model_errors";

/// Fewest members: from `m` models the standard deviation that they cause is known to
/// `1 / sqrt(2 (m - 1))` of its value, from four to 41 %. A single one would be another model that is
/// taken as certain.
const MIN_MEMBERS: usize = 4;
/// Largest number of members: the scatter over this many models is known to 9 % of its standard
/// deviation.
const MAX_MEMBERS: usize = 64;

/// Errors of the simulator that identification takes into account.
///
/// Simulations of an identification are shared by models that differ by factors and lags from these
/// ranges: a log-uniform density for factors, a uniform one for the lag. A range of one value is
/// that value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ModelErrors {
    /// Models, 4 to 64; 0, the default here, for the model as it is. A command takes
    /// [16](Self::USUAL_MEMBERS) where the real world is not the simulator.
    pub members: usize,
    /// Factor on the time constant of every contact, 1. Default 0.7 to 1.4: a scene's contact
    /// softness is usually chosen and not measured (estimate). 1 is null.
    pub contact_time: [f64; 2],
    /// Factor on the damping ratio of every contact, 1. Default 0.7 to 1.4 (estimate). 1 is null.
    pub contact_damping: [f64; 2],
    /// Time constant of a lag between commands and servos, s. Default 0 to 0.01 (estimate). 0 is
    /// null.
    pub servo_lag: [f64; 2],
    /// Factor on the mass of free bodies, 1. Default 0.97 to 1.03: what a kitchen scale leaves open.
    /// 1 is null.
    pub mass: [f64; 2],
}

impl Default for ModelErrors {
    fn default() -> Self {
        let usual = PerturbationRanges::default();
        Self {
            members: 0,
            contact_time: usual.contact_time,
            contact_damping: usual.contact_damping,
            servo_lag: usual.servo_lag,
            mass: usual.mass,
        }
    }
}

impl ModelErrors {
    /// Members where the simulator is known to deviate: they tell the scatter that they cause to
    /// 18 % of its standard deviation. In perturbed worlds 64 are no better (docs/identification.md).
    pub const USUAL_MEMBERS: usize = 16;

    /// Reads the errors that a table sets, over the defaults.
    ///
    /// # Errors
    /// [`Error::Config`] naming the key.
    pub fn read(table: &toml::Table) -> Result<Self> {
        let errors: Self = registry::settings(MODEL_ERRORS, table)?;
        let members = errors.members;
        if members != 0 && !(MIN_MEMBERS..=MAX_MEMBERS).contains(&members) {
            return Err(Error::Config {
                key: format!("{MODEL_ERRORS}.members"),
                message: format!(
                    "{members} is not 0 (the model as it is) or {MIN_MEMBERS} to {MAX_MEMBERS}"
                ),
            });
        }
        errors.ranges().check(MODEL_ERRORS)?;
        Ok(errors)
    }

    fn ranges(self) -> PerturbationRanges {
        PerturbationRanges {
            contact_time: self.contact_time,
            contact_damping: self.contact_damping,
            servo_lag: self.servo_lag,
            mass: self.mass,
            ..PerturbationRanges::off()
        }
    }

    /// Compiles the members from a scene with `values` and `effects`, and what the engine or the
    /// scene does not support, with the reasons; `None` without members.
    ///
    /// Unknowns are left as they are.
    ///
    /// # Errors
    /// When the engine refuses the scene.
    pub fn ensemble(
        self,
        backend: &dyn Backend,
        scene: &Scene,
        (values, effects): (&[(Target, f64)], &[EffectSpec]),
        unknowns: &[Parameter],
        streams: Streams,
    ) -> Result<Option<(Ensemble, Vec<String>)>> {
        let plant = Plant::of(scene)?;
        let ranges = self.ranges();
        let mut left_out = Vec::new();
        let mut members: Vec<Arc<dyn Model>> = Vec::with_capacity(self.members);
        for k in 0..self.members {
            let own = streams.child(&format!("model {k}"));
            let drawn = Perturbation::draw(&ranges, &plant, &plant.layout, &[], own)?;
            let given = (values, effects);
            let made = perturb(backend, scene, given, unknowns, &[], &drawn)?;
            left_out = made.left_out;
            members.push(made.model);
        }
        if members.is_empty() {
            return Ok(None);
        }
        Ok(Some((Ensemble::new(members)?, left_out)))
    }
}
