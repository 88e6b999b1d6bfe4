//! An effect with its site and values, as users write it.

use std::str::FromStr;

use crate::Effect;
use crate::EffectEntry;
use asid_core::error::{Error, Result};
use asid_core::registry::{all, find};
use asid_mjcf::plant::Plant;

/// An effect with its site and values, written `name@site:parameter=value,…`.
///
/// Parameters that are left out have their null values.
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
        // A site may contain colons: the last one that values follow begins the values.
        let values_follow = |tail: &str| tail.trim().is_empty() || tail.contains('=');
        let (head, tail) = match text.rsplit_once(':') {
            Some((head, tail)) if values_follow(tail) => (head, tail),
            _ => text.split_once(':').unwrap_or((text, "")),
        };
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

/// Splits `NAME@SITE`.
///
/// A loaded effect whose own name was taken has an `@` in its name.
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
    /// Finds the effect, and checks that the machine has the site.
    ///
    /// # Errors
    /// When there is no such effect or site; the message lists near names.
    pub fn find(&self, plant: &Plant) -> Result<Box<dyn Effect>> {
        let effect = (find::<EffectEntry>(&self.name)?.make)();
        let sites = effect.sites(plant);
        if sites.contains(&self.site) {
            return Ok(effect);
        }
        if sites.iter().all(String::is_empty) && !sites.is_empty() {
            return Err(Error::Config {
                key: format!("effect {}", self.name),
                message: format!("acts on the whole scene: write it without `@{}`", self.site),
            });
        }
        if sites.is_empty() {
            return Err(Error::Config {
                key: format!("effect {}", self.name),
                message: "this scene has nothing that it could act on".into(),
            });
        }
        Err(Error::unknown(
            "site",
            &self.site,
            sites.iter().map(String::as_str),
        ))
    }

    /// One value for each parameter of `effect`: the given value, else the null value.
    ///
    /// # Errors
    /// When a parameter is unknown; the message lists near names.
    pub fn values_of(&self, effect: &dyn Effect) -> Result<Vec<f64>> {
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
        Ok(values)
    }

    /// Name and site, `NAME@SITE`; the name alone for an effect of the whole scene.
    #[must_use]
    pub fn label(&self) -> String {
        if self.site.is_empty() {
            self.name.clone()
        } else {
            format!("{}@{}", self.name, self.site)
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
            "backlash@robot/left arm.elbow:gap=0.01",
            "actuator-gain@robot:servo:gain=0.9",
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
