//! Which effect: hypotheses, effects with their values, and the verdict.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::nullable;

/// A set of effects, or `none` or `unknown`, with its probability.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[schemars(rename = "Hypothesis")]
pub struct HypothesisResult {
    /// Effects at their sites.
    pub effects: Vec<String>,
    /// Probability.
    #[serde(deserialize_with = "nullable::scalar")]
    pub probability: f64,
}

/// An effect with its marginal probability.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[schemars(rename = "Effect")]
pub struct EffectResult {
    /// Name.
    pub effect: String,
    /// Site; empty for an effect of the whole scene.
    pub site: String,
    /// Sum of the probabilities of the hypotheses that it is in.
    #[serde(deserialize_with = "nullable::scalar")]
    pub probability: f64,
    /// Share of the excess squared gap that it closes alone.
    pub gap_closed: Option<f64>,
    /// Fitted values.
    #[serde(deserialize_with = "nullable::map")]
    pub parameters: BTreeMap<String, f64>,
    /// Units of the values at this site.
    #[serde(default)]
    pub units: BTreeMap<String, String>,
    /// 95 % intervals of those that were fitted.
    #[serde(default, deserialize_with = "nullable::intervals")]
    pub intervals95: BTreeMap<String, [f64; 2]>,
    /// Whether a fitted value is at the end of its range: the best one may lie beyond.
    #[serde(default)]
    pub at_bound: bool,
}

/// What an ordinary machine has of an effect, as it was fitted beside the verdict's: within its tolerance, and not named.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Tolerance {
    /// Name.
    pub effect: String,
    /// Site; empty for an effect of the whole scene.
    pub site: String,
    /// Fitted values.
    #[serde(deserialize_with = "nullable::map")]
    pub parameters: BTreeMap<String, f64>,
}

impl EffectResult {
    /// `name@site`; the name alone where it acts on the whole scene.
    #[must_use]
    pub fn label(&self) -> String {
        if self.site.is_empty() {
            self.effect.clone()
        } else {
            format!("{}@{}", self.effect, self.site)
        }
    }
}

/// What kind of answer.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "VerdictKind")]
pub enum Kind {
    /// No gap beyond the noise and the study's parameters.
    #[default]
    None,
    /// Effects of the catalogue.
    Effects,
    /// A gap that nothing in the catalogue explains.
    Unknown,
}

/// The answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Verdict {
    /// What kind.
    pub kind: Kind,
    /// Effects at their sites.
    pub effects: Vec<String>,
    /// Probability of it; of effects, that all of them are among the true ones.
    #[serde(deserialize_with = "nullable::scalar")]
    pub probability: f64,
    /// Rival sets that these data cannot tell from it.
    pub ambiguous_with: Vec<Vec<String>>,
    /// Share of the excess squared gap that it leaves.
    #[serde(deserialize_with = "nullable::scalar")]
    pub unexplained: f64,
    /// What is left beside the effects that are named; `None` where nothing is, or none is named.
    #[serde(default)]
    pub remainder: Option<Remainder>,
}

/// What is left of the gap beside the effects that are named.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Remainder {
    /// Share of the excess squared gap.
    #[serde(deserialize_with = "nullable::scalar")]
    pub share: f64,
    /// The joint or sensor at which most of it is.
    #[serde(rename = "where")]
    pub place: String,
    /// The variable that most of what is there goes with; empty where it goes with none.
    pub against: String,
    /// Kinds of effects that go with that variable, the most probable first.
    pub kinds: Vec<String>,
}

/// One law at several sites.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Group {
    /// Effect.
    pub effect: String,
    /// Its sites.
    pub sites: Vec<String>,
}

impl Default for Verdict {
    fn default() -> Self {
        Self {
            kind: Kind::None,
            effects: Vec::new(),
            probability: f64::NAN,
            ambiguous_with: Vec::new(),
            unexplained: f64::NAN,
            remainder: None,
        }
    }
}
