//! The simulated real world: its kind and its settings.

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::Result;
use asid_core::{Error, Parameter, Task};
use asid_effects::EffectSpec;
use asid_worlds::{PerturbationRanges, WorldKind};
use schemars::JsonSchema;
use serde::Serialize;

use super::model_file;
use super::table::{check_keys, numbers, section, text, wrong};
use crate::cli::options::Real;

/// The simulated real world.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct RealConfig {
    /// Kind; not written where it follows from the rest.
    #[serde(skip_serializing_if = "follows")]
    #[schemars(with = "String")]
    pub world: WorldKind,
    /// Engine.
    pub backend: String,
    /// Model file, MJCF or TOML; empty for the task's scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<PathBuf>,
    /// Effects that the simulator lacks, as `name@site:parameter=value`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<String>,
    /// True values that were given; the others are drawn from the prior.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub truth: BTreeMap<String, f64>,
    /// How far off a perturbed world may be.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub perturbation: Option<PerturbationRanges>,
}

/// Whether a kind follows from the engine, the model and the effects.
#[allow(clippy::trivially_copy_pass_by_ref)] // as serde calls it
fn follows(kind: &WorldKind) -> bool {
    matches!(kind, WorldKind::Matched | WorldKind::Custom)
}

impl RealConfig {
    /// Whether the world is the task's scene as it is, on this engine.
    pub fn is_scene_on(&self, engine: &str) -> bool {
        matches!(self.world, WorldKind::Matched | WorldKind::Custom)
            && self.backend == engine
            && self.model.is_none()
            && self.effects.is_empty()
    }

    /// Whether the settings say nothing of a real world of its own, beside the simulator's engine.
    pub fn is_left_open(&self, simulator: &str) -> bool {
        self.is_scene_on(simulator) && self.truth.is_empty()
    }
}

/// Resolves the section `real` of the settings, overridden by the options.
///
/// `simulator` is the simulator's engine, and whether it has a model other than the task's scene.
pub fn resolve(
    table: &toml::Table,
    options: &Real,
    task: &dyn Task,
    parameters: &[Parameter],
    (simulator, own_model): (&str, bool),
) -> Result<RealConfig> {
    const KEYS: [&str; 6] = [
        "world",
        "backend",
        "model",
        "truth",
        "effects",
        "perturbation",
    ];
    check_keys("real", table, &KEYS)?;
    let named = options.real_backend.clone().or(text(table, "backend")?);
    let mut real = RealConfig {
        model: model_file(&options.real_model, table)?,
        effects: effects(table, options)?,
        truth: truth(table, options, parameters)?,
        ..RealConfig::default()
    };
    let other = named.as_ref().is_some_and(|name| name != simulator);
    let made = real.model.is_some() || !real.effects.is_empty();
    real.world = match options.world.clone().or(text(table, "world")?) {
        Some(name) => name.parse()?,
        None if other || made || own_model => WorldKind::Custom,
        None => WorldKind::Matched,
    };
    let kind = real.world;
    if kind == WorldKind::Matched && (other || made) {
        return Err(wrong(
            "real.world",
            "a matched world is the simulator itself and has no engine, model or effects of its own; \
             leave them out, or choose another --world",
        ));
    }
    if kind == WorldKind::Custom && !(other || made || own_model) {
        return Err(wrong(
            "--world custom",
            "nothing of this world is other than the simulator's: name what is by --real-backend, --real-model or --real-effect, \
             or choose --world matched",
        ));
    }
    if kind == WorldKind::StandIn && real.model.is_some() {
        return Err(wrong(
            "real.world",
            "a stand-in is the task's own other scene; it goes with no --real-model",
        ));
    }
    real.backend = match named {
        Some(name) if kind == WorldKind::Crossed && !other => {
            let message =
                format!("a crossed world has another engine than the simulator's, `{name}`");
            return Err(wrong("real.backend", message));
        }
        Some(name) => name,
        None if kind == WorldKind::Crossed => {
            asid_worlds::other_engine(simulator, task.spec().requires)?
        }
        None => simulator.to_owned(),
    };
    // Check the ranges even where only other runs with the same settings use them.
    let ranges = PerturbationRanges::read(&section(table, "perturbation")?)?;
    real.perturbation = (kind == WorldKind::Perturbed).then_some(ranges);
    Ok(real)
}

/// True values of the configuration, overridden by the command line.
fn truth(
    table: &toml::Table,
    options: &Real,
    parameters: &[Parameter],
) -> Result<BTreeMap<String, f64>> {
    let mut truth = numbers("real.truth", &section(table, "truth")?)?;
    for given in &options.truth {
        let (name, value) = given
            .split_once('=')
            .ok_or_else(|| wrong("--truth", format!("`{given}` is not NAME=VALUE")))?;
        let number = value.trim().parse().ok();
        let value: f64 = number.filter(|x: &f64| x.is_finite()).ok_or_else(|| {
            let message = format!("`{value}` is not a finite number");
            wrong(&format!("--truth {name}"), message)
        })?;
        truth.insert(name.trim().to_owned(), value);
    }
    for name in truth.keys() {
        if !parameters.iter().any(|p| &p.name == name) {
            let known = parameters.iter().map(|p| &*p.name);
            return Err(Error::unknown("parameter", name, known).into());
        }
    }
    Ok(truth)
}

/// Effects of the configuration, then those of the command line; the form of each is checked.
fn effects(table: &toml::Table, real: &Real) -> Result<Vec<String>> {
    let listed = match table.get("effects") {
        None => Vec::new(),
        Some(value) => value
            .as_array()
            .and_then(|a| a.iter().map(|v| v.as_str().map(str::to_owned)).collect())
            .ok_or_else(|| wrong("real.effects", format!("{value} is not a list of texts")))?,
    };
    listed
        .iter()
        .chain(&real.real_effect)
        .map(|text| Ok(text.parse::<EffectSpec>()?.to_string()))
        .collect()
}

#[cfg(test)]
mod tests {
    use asid_core::registry::{TaskEntry, find};

    use super::*;

    /// Symptom: a run whose simulator had another model called its real world matched. Cause: only
    /// the real world's own engine, model and effects made a world custom.
    #[test]
    fn the_scene_is_no_matched_world_of_a_simulator_with_another_model() {
        let task = (find::<TaskEntry>("rod-balancing").unwrap().make)().unwrap();
        let of = |own_model: bool| {
            let (table, options) = (toml::Table::new(), Real::default());
            let simulator = ("rapier", own_model);
            resolve(&table, &options, &*task, &task.parameters(), simulator).unwrap()
        };
        let (matched, custom) = (of(false), of(true));
        assert_eq!(matched.world, WorldKind::Matched);
        assert_eq!(custom.world, WorldKind::Custom);
        // Both are the task's scene.
        for real in [matched, custom] {
            assert!(real.is_scene_on("rapier") && !real.is_scene_on("mujoco"));
        }
    }
}
