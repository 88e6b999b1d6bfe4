//! The unknowns and the trackers' noise: the task's own, overridden by the configuration.

use std::collections::BTreeMap;

use anyhow::Result;
use asid_core::parameter::{Parameter, Scale};
use asid_core::{Error, Target, Task};
use asid_documents::toml_text;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::table::{numbers, wrong};

/// An unknown as it stands in a configuration.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ParameterConfig {
    /// One target.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "String")]
    pub target: Option<Target>,
    /// Several targets that share the value.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Vec<String>")]
    pub targets: Option<Vec<Target>>,
    /// Smallest and largest value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
    /// Scale of the prior.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "String")]
    pub scale: Option<Scale>,
    /// Unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Whether it is identified.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub enabled: Option<bool>,
}

/// The task's unknowns, overridden by the configuration.
pub fn unknowns(
    task: &dyn Task,
    table: &toml::Table,
) -> Result<(BTreeMap<String, ParameterConfig>, Vec<Parameter>)> {
    let mut given: BTreeMap<String, ParameterConfig> = BTreeMap::new();
    for (name, value) in table {
        let read = ParameterConfig::deserialize(value.clone())
            .map_err(|e| wrong(&format!("parameter.{name}"), toml_text::keyed(&e)))?;
        given.insert(name.clone(), read);
    }
    let mut parameters = task.parameters();
    let mut order: Vec<String> = parameters.iter().map(|p| p.name.clone()).collect();
    for p in task.optional_parameters() {
        if given.contains_key(&p.name) {
            order.push(p.name.clone());
            parameters.push(p);
        }
    }
    for (name, config) in &given {
        if order.contains(name) {
            continue;
        }
        if config.target.is_none() && config.targets.is_none() {
            let known = task
                .parameters()
                .into_iter()
                .chain(task.optional_parameters())
                .map(|p| p.name)
                .collect::<Vec<_>>();
            let unknown = Error::unknown("parameter", name, known.iter().map(String::as_str));
            return Err(wrong(
                &format!("parameter.{name}"),
                format!("{unknown}; a new one needs a `target` and a `range`"),
            ));
        }
        parameters.push(Parameter {
            name: name.clone(),
            targets: Vec::new(),
            range: config
                .range
                .ok_or_else(|| wrong(&format!("parameter.{name}"), "needs a `range`"))?,
            scale: Scale::Linear,
            unit: String::new(),
        });
    }
    parameters.retain_mut(|p| {
        let Some(config) = given.get(&p.name) else {
            return true;
        };
        if let Some(targets) = &config.targets {
            p.targets.clone_from(targets);
        }
        if let Some(target) = &config.target {
            p.targets = vec![target.clone()];
        }
        if let Some(range) = config.range {
            p.range = range;
        }
        if let Some(scale) = config.scale {
            p.scale = scale;
        }
        if let Some(unit) = &config.unit {
            p.unit.clone_from(unit);
        }
        config.enabled != Some(false)
    });
    if parameters.is_empty() {
        return Err(wrong("parameter", "every unknown is switched off"));
    }
    for p in &parameters {
        p.check()?;
    }
    let mut resolved: BTreeMap<String, ParameterConfig> = parameters
        .iter()
        .map(|p| {
            (
                p.name.clone(),
                ParameterConfig {
                    target: None,
                    targets: Some(p.targets.clone()),
                    range: Some(p.range),
                    scale: Some(p.scale),
                    unit: Some(p.unit.clone()),
                    enabled: None,
                },
            )
        })
        .collect();
    for (name, config) in given {
        if config.enabled == Some(false) {
            let off = ParameterConfig {
                enabled: Some(false),
                ..ParameterConfig::default()
            };
            resolved.insert(name, off);
        }
    }
    Ok((resolved, parameters))
}

/// The task's tracking noise, overridden by the configuration.
pub fn noise(task: &dyn Task, table: &toml::Table) -> Result<BTreeMap<String, f64>> {
    let mut all: BTreeMap<String, f64> = task
        .exploration()
        .signals
        .iter()
        .map(|s| (s.sensor.clone(), s.noise))
        .collect();
    for (name, value) in numbers("noise", table)? {
        if value <= 0.0 {
            return Err(wrong(
                &format!("noise.{name}"),
                format!("must be positive, not {value}"),
            ));
        }
        if all.insert(name.clone(), value).is_none() {
            let known = task.exploration().signals.iter().map(|s| &*s.sensor);
            return Err(Error::unknown("tracked sensor", &name, known).into());
        }
    }
    Ok(all)
}
