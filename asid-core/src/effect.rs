//! Physical effects that a simulator can be given.
//!
//! An effect is attached at a *site* (a joint, an actuator, …) with values of its
//! parameters, and acts through a [`StepHook`] before each physics step: on the
//! command, or as a force. At its parameters' null values it does exactly nothing.
//! The simulated real world can be given effects that the method's simulator lacks.

use std::str::FromStr;

use crate::error::{Error, Result};
use crate::layout::Layout;
use crate::registry::{EffectEntry, all, find};
use crate::simulator::{StepHook, StepView};

/// Where an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Acts {
    /// On the model's parameters.
    Model,
    /// On the command on its way to the drive.
    Command,
    /// As a force during the step.
    Force,
    /// On the reading on its way from the sensor.
    Measurement,
}

/// A parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectParameter {
    /// Name, such as `gain`.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Plausible values.
    pub range: [f64; 2],
    /// Value at which the effect is off.
    pub null: f64,
}

/// A physical effect.
pub trait Effect: Send + Sync {
    /// Where it acts.
    fn acts(&self) -> Acts;
    /// Its parameters.
    fn parameters(&self) -> &'static [EffectParameter];
    /// Names of the sites of a scene that it can be attached to.
    fn sites(&self, layout: &Layout) -> Vec<String>;
    /// Attaches it at a site, with one value a parameter.
    ///
    /// # Errors
    /// When the scene has no such site.
    fn attach(
        &self,
        layout: &Layout,
        site: &str,
        values: &[f64],
    ) -> Result<Box<dyn StepHook + Send>>;
}

/// An effect with its site and values, written `name@site:parameter=value,…`;
/// parameters that are left out are at their null value.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectSpec {
    /// Name of the effect.
    pub name: String,
    /// Name of the site; empty for an effect of the whole scene.
    pub site: String,
    /// Values by parameter.
    pub values: Vec<(String, f64)>,
}

impl FromStr for EffectSpec {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = |message: String| Error::Config {
            key: "effect".into(),
            message: format!(
                "`{text}`: {message}; an effect is written NAME@SITE:parameter=value,parameter=value"
            ),
        };
        let (head, tail) = text.split_once(':').unwrap_or((text, ""));
        let (name, site) = name_and_site(head);
        if name.trim().is_empty() {
            return Err(wrong("the name is missing".into()));
        }
        let values = tail
            .split(',')
            .filter(|part| !part.trim().is_empty())
            .map(|part| {
                let (key, value) = part
                    .split_once('=')
                    .ok_or_else(|| wrong(format!("`{part}` is not parameter=value")))?;
                let value: f64 = value
                    .trim()
                    .parse()
                    .ok()
                    .filter(|x: &f64| x.is_finite())
                    .ok_or_else(|| wrong(format!("`{value}` is not a finite number")))?;
                Ok((key.trim().to_owned(), value))
            })
            .collect::<Result<_>>()?;
        Ok(Self {
            name: name.trim().to_owned(),
            site: site.trim().to_owned(),
            values,
        })
    }
}

/// Splits `NAME@SITE`. A loaded effect whose own name was taken has an `@` in its name.
fn name_and_site(head: &str) -> (&str, &str) {
    let longest = all::<EffectEntry>()
        .iter()
        .filter(|e| head == e.name || head.starts_with(&format!("{}@", e.name)))
        .map(|e| e.name.len())
        .max();
    match longest {
        Some(length) => (&head[..length], head[length..].trim_start_matches('@')),
        None => head.split_once('@').unwrap_or((head, "")),
    }
}

impl std::fmt::Display for EffectSpec {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.name)?;
        if !self.site.is_empty() {
            write!(f, "@{}", self.site)?;
        }
        for (i, (key, value)) in self.values.iter().enumerate() {
            write!(f, "{}{key}={value}", if i == 0 { ":" } else { "," })?;
        }
        Ok(())
    }
}

impl EffectSpec {
    /// Finds the effect and attaches it.
    ///
    /// # Errors
    /// When there is no such effect, site or parameter; the message lists near names.
    pub fn attach(&self, layout: &Layout) -> Result<Box<dyn StepHook + Send>> {
        let effect = (find::<EffectEntry>(&self.name)?.make)();
        let sites = effect.sites(layout);
        if !sites.contains(&self.site) && !sites.is_empty() {
            return Err(Error::unknown(
                "site",
                &self.site,
                sites.iter().map(String::as_str),
            ));
        }
        let parameters = effect.parameters();
        let mut values: Vec<f64> = parameters.iter().map(|p| p.null).collect();
        for (name, value) in &self.values {
            let i = parameters
                .iter()
                .position(|p| p.name == name)
                .ok_or_else(|| {
                    Error::unknown("effect parameter", name, parameters.iter().map(|p| p.name))
                })?;
            values[i] = *value;
        }
        effect.attach(layout, &self.site, &values)
    }
}

/// Several effects, one after the other.
pub struct Effects(pub Vec<Box<dyn StepHook + Send>>);

impl Effects {
    /// The hook of a rollout; none where there is no effect, which costs nothing.
    #[must_use]
    pub fn hook(&self) -> Option<&dyn StepHook> {
        (!self.0.is_empty()).then_some(self)
    }
}

impl StepHook for Effects {
    fn before_step(&self, row: usize, step: usize, view: &mut StepView<'_>) {
        for effect in &self.0 {
            effect.before_step(row, step, view);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn specifications_round_trip() {
        for text in [
            "actuator-gain@servo:gain=0.9",
            "gravity-tilt:x=0.01,y=-0.02",
            "backlash@elbow",
        ] {
            assert_eq!(text.parse::<EffectSpec>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn bad_specifications_say_how_one_is_written() {
        for text in ["", "@servo", "a@b:gain", "a@b:gain=x", "a@b:gain=inf"] {
            let error = text.parse::<EffectSpec>().unwrap_err().to_string();
            assert!(error.contains("NAME@SITE"), "{error}");
        }
    }
}
