//! The label of a case: an entry of `labels.json`.
//!
//! The keys are a contract between the generator of cases and the scorer. Only `effects` is
//! mandatory; what a label does not say is not scored.

use std::collections::BTreeMap;
use std::path::Path;

use asid_core::{Error, Result};
use serde::Deserialize;

use crate::catalogue::has_parameter;

/// A small effect that the world has besides its causes.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Dirt {
    /// Name of the effect.
    pub effect: String,
    /// Element; empty for an effect of the whole scene.
    #[serde(default)]
    pub site: String,
    /// Drawn values, by the catalogue's names and in its units.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
    /// Excess gap of this item alone, in units of the noise.
    #[serde(default)]
    pub excess_gap: f64,
}

/// A fault in the wiring of log columns to sensors.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct WiringTruth {
    /// Name of the fault, for example `wiring-sign`.
    pub fault: String,
    /// Affected columns.
    pub columns: Vec<String>,
    /// Factor, shift or delay, in SI units.
    #[serde(default)]
    pub value: f64,
}

/// A share of the true excess at one place.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct TruePlace {
    /// Column of the logs.
    pub signal: String,
    /// Regime of motion.
    pub regime: String,
    /// Share of the squared excess.
    pub share: f64,
}

/// A case's label.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Label {
    /// Kind of machine.
    #[serde(default)]
    pub world: String,
    /// Causes as `NAME@SITE`; empty without a cause; `unknown:…` for a cause of no catalogue.
    pub effects: Vec<String>,
    /// True values, by `NAME@SITE.parameter`, or by the bare parameter name if that is unambiguous.
    #[serde(default)]
    pub effect_parameters: BTreeMap<String, f64>,
    /// True values of the study's parameters.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
    /// Other sets of effects that are right, for example `["none"]` or `["unknown"]`.
    #[serde(default)]
    pub acceptable: Vec<Vec<String>>,
    /// Effects that a right answer must not name.
    #[serde(default)]
    pub must_not: Vec<String>,
    /// Whether the world is dirty: everything deviates a little.
    #[serde(default)]
    pub dirty: bool,
    /// The items of dirt.
    #[serde(default)]
    pub dirt: Vec<Dirt>,
    /// Multiple of the gap of the dirt that the causes reach; 0 without causes or dirt.
    #[serde(default)]
    pub factor: f64,
    /// Excess gap for which the causes were sized, in units of the noise.
    #[serde(default)]
    pub target_gap: f64,
    /// Excess gap of each cause alone.
    #[serde(default)]
    pub own_gaps: BTreeMap<String, f64>,
    /// Excess gap of the whole world.
    #[serde(default)]
    pub excess_gap: f64,
    /// Share of the squared excess in each column of the logs.
    #[serde(default)]
    pub signals: BTreeMap<String, f64>,
    /// The same shares by column and regime.
    #[serde(default, rename = "where")]
    pub places: Vec<TruePlace>,
    /// Faults of wiring.
    #[serde(default)]
    pub wiring: Vec<WiringTruth>,
    /// Faults of the log itself.
    #[serde(default)]
    pub log_faults: Vec<String>,
    /// Standard deviation of each sensor's noise, in its unit.
    #[serde(default)]
    pub noise: BTreeMap<String, f64>,
}

impl Label {
    /// Whether a cause is in no catalogue.
    #[must_use]
    pub fn is_unknown(&self) -> bool {
        self.effects.iter().any(|e| e.starts_with("unknown"))
    }

    /// Whether there is no cause.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.effects.is_empty()
    }

    /// Names of the causes without their sites, sorted, each once.
    #[must_use]
    pub fn cause(&self) -> String {
        if self.is_none() {
            return "none".to_owned();
        }
        let mut names: Vec<&str> = self.effects.iter().map(|e| name_of(e)).collect();
        names.sort_unstable();
        names.dedup();
        names.join(" + ")
    }

    /// `none`, `unknown`, `single`, `several` or `group` (the same effect at several sites).
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match &self.effects[..] {
            [] => "none",
            _ if self.is_unknown() => "unknown",
            [_] => "single",
            [first, rest @ ..] if rest.iter().all(|e| name_of(e) == name_of(first)) => "group",
            _ => "several",
        }
    }

    /// Excess gap of the causes alone, in units of the noise.
    ///
    /// It is the root of the sum of squares, which is exact if the causes act on different
    /// readings. Without gaps by cause it is the gap of the whole world.
    #[must_use]
    pub fn cause_gap(&self) -> f64 {
        if self.own_gaps.is_empty() {
            return self.excess_gap;
        }
        self.own_gaps.values().map(|g| g * g).sum::<f64>().sqrt()
    }

    /// True value of a parameter of an effect at its site.
    #[must_use]
    pub fn value(&self, effect: &str, parameter: &str) -> Option<f64> {
        let whole = self.effect_parameters.get(&format!("{effect}.{parameter}"));
        // A bare name is unambiguous if no other cause has that parameter.
        let has = |e: &&String| has_parameter(name_of(e), parameter);
        let mut owners = self.effects.iter().filter(has);
        let clear = owners.next().is_some_and(|e| e == effect) && owners.next().is_none();
        let bare = || {
            clear
                .then(|| self.effect_parameters.get(parameter))
                .flatten()
        };
        whole.or_else(bare).copied()
    }
}

/// Name of an effect without its site.
#[must_use]
pub fn name_of(effect: &str) -> &str {
    effect.split_once('@').map_or(effect, |(name, _)| name)
}

/// Site of an effect; empty for one of the whole scene.
#[must_use]
pub fn site_of(effect: &str) -> &str {
    effect.split_once('@').map_or("", |(_, site)| site)
}

/// Reads `labels.json`.
///
/// # Errors
/// If the file is missing or is not a set of labels.
pub fn read_labels(path: &Path) -> Result<BTreeMap<String, Label>> {
    let fail = |message: String| Error::File {
        path: path.to_owned(),
        message,
    };
    let text = std::fs::read_to_string(path).map_err(|e| fail(e.to_string()))?;
    serde_json::from_str(&text).map_err(|e| fail(format!("is not labels: {e}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_with_effects_alone_is_whole() {
        let label: Label =
            serde_json::from_str(r#"{"effects": ["a@x", "a@y"], "more": 1}"#).unwrap();
        assert_eq!((label.kind(), &*label.cause()), ("group", "a"));
        assert!(serde_json::from_str::<Label>(r#"{"world": "cart"}"#).is_err());
    }

    #[test]
    fn a_bare_parameter_is_of_the_only_cause_that_has_it() {
        let values = BTreeMap::from([("force".to_owned(), 2.0)]);
        let (dry, tilt) = ("coulomb-friction@x", "gravity-tilt");
        let mut label = Label {
            effects: vec![dry.into(), tilt.into()],
            effect_parameters: values,
            ..Label::default()
        };
        assert_eq!(label.value(dry, "force"), Some(2.0));
        assert_eq!(label.value(tilt, "force"), None);
        label.effects.push("coulomb-friction@y".into());
        assert_eq!(label.value(dry, "force"), None);
    }

    #[test]
    fn gaps_of_causes_add_by_their_squares() {
        let label = Label {
            own_gaps: BTreeMap::from([("a".into(), 3.0), ("b".into(), 4.0)]),
            excess_gap: 7.0,
            ..Label::default()
        };
        assert!((label.cause_gap() - 5.0).abs() < 1e-12);
    }
}
