//! The answer of a diagnosis: the scored keys of its `result.json`.
//!
//! The keys follow the contract and not the types of the diagnosis. Any tool that writes such a
//! file can therefore be scored, and the scorer shares nothing with the diagnosis.

use std::collections::BTreeMap;
use std::path::Path;

use asid_core::{Error, Result};
use serde::{Deserialize, Serialize};

/// Gaps on the held-out logs, in units of the noise.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// Gap after fitting the study's own parameters.
    #[serde(default)]
    pub identified: Option<f64>,
    /// Gap with the verdict's effects.
    #[serde(default)]
    pub refined: Option<f64>,
    /// Share of the excess that the effects close.
    #[serde(default)]
    pub closed: Option<f64>,
    /// Noise by sensor.
    #[serde(default)]
    pub signals: Vec<SignalNoise>,
}

/// Noise that the diagnosis assumed for a sensor.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SignalNoise {
    /// Sensor.
    pub signal: String,
    /// Standard deviation, in the sensor's unit.
    pub noise: f64,
}

/// Kind of a verdict that names nothing but subtracts learned residuals.
pub const RESIDUAL: &str = "residual";

/// A share of the excess at one place.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Column of the logs.
    pub signal: String,
    /// Regime of motion.
    #[serde(default)]
    pub regime: String,
    /// Share of the squared excess.
    pub share: f64,
}

/// A set of effects, or `none` or `unknown`, with its probability.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Hypothesis {
    /// Effects at their sites.
    pub effects: Vec<String>,
    /// Probability.
    pub probability: f64,
}

/// An effect with its values.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EffectValues {
    /// Name.
    pub effect: String,
    /// Site; empty for an effect of the whole scene.
    #[serde(default)]
    pub site: String,
    /// Fitted values of its parameters.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
    /// 95 % intervals of the values, if the answer gives any.
    #[serde(default)]
    pub intervals95: BTreeMap<String, [f64; 2]>,
}

impl EffectValues {
    /// `NAME@SITE`, or the name alone for an effect of the whole scene.
    #[must_use]
    pub fn label(&self) -> String {
        if self.site.is_empty() {
            self.effect.clone()
        } else {
            format!("{}@{}", self.effect, self.site)
        }
    }
}

/// The verdict.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// `none`, `effects`, `unknown`, or [`RESIDUAL`].
    pub kind: String,
    /// Effects at their sites.
    #[serde(default)]
    pub effects: Vec<String>,
    /// Stated probability of the verdict.
    pub probability: f64,
    /// Rival sets that the data cannot distinguish from the verdict.
    #[serde(default)]
    pub ambiguous_with: Vec<Vec<String>>,
    /// What the verdict leaves unexplained.
    #[serde(default)]
    pub remainder: Option<serde_json::Value>,
}

impl Verdict {
    /// The verdict's set of effects, sorted; `[kind]`, for example `["none"]`, if it names none.
    #[must_use]
    pub fn set(&self) -> Vec<String> {
        if self.kind != "effects" {
            return vec![self.kind.clone()];
        }
        let mut set = self.effects.clone();
        set.sort();
        set
    }
}

/// Estimate of a parameter of the study.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ParameterEstimate {
    /// Name.
    pub name: String,
    /// Estimate.
    pub estimate: f64,
    /// 95 % interval.
    #[serde(default)]
    pub interval95: Option<[f64; 2]>,
}

/// A wiring fault that the diagnosis found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WiringFound {
    /// Name of the fault, for example `wiring-sign`.
    pub fault: String,
    /// Affected columns.
    #[serde(default)]
    pub columns: Vec<String>,
    /// Probability.
    #[serde(default)]
    pub probability: Option<f64>,
}

/// The answer of a diagnosis.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// Gaps.
    pub gap: Gap,
    /// Where the gap lies.
    #[serde(default, rename = "where")]
    pub places: Vec<Place>,
    /// Sets of effects with their probabilities.
    #[serde(default)]
    pub hypotheses: Vec<Hypothesis>,
    /// Effects with their fitted values.
    #[serde(default)]
    pub effects: Vec<EffectValues>,
    /// The verdict.
    pub verdict: Verdict,
    /// Estimates of the study's parameters.
    #[serde(default)]
    pub parameters: Vec<ParameterEstimate>,
    /// Wiring faults.
    #[serde(default)]
    pub wiring: Vec<WiringFound>,
    /// Learned residuals of the held-out logs, replayed with the study's fitted parameters.
    ///
    /// Each log has `rows x entries` values in the sensor's unit. An orientation has three entries,
    /// in rad.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub learned: Vec<Vec<f64>>,
}

/// Probability from which a wiring fault counts as named: as likely as not.
const NAMED: f64 = 0.5;

impl Answer {
    /// Reads a `result.json`.
    ///
    /// # Errors
    /// If the file is missing or is not a result of a diagnosis.
    pub fn read(path: &Path) -> Result<Self> {
        let fail = |message: String| Error::File {
            path: path.to_owned(),
            message,
        };
        let text = std::fs::read_to_string(path).map_err(|e| fail(e.to_string()))?;
        serde_json::from_str(&text).map_err(|e| fail(format!("is no result of a diagnosis: {e}")))
    }

    /// Whether the answer gives no name for what is missing.
    #[must_use]
    pub fn names_nothing(&self) -> bool {
        self.verdict.kind == RESIDUAL
    }

    /// Fitted values of an effect at its site.
    #[must_use]
    pub fn values(&self, effect: &str) -> Option<&EffectValues> {
        self.effects.iter().find(|e| e.label() == effect)
    }

    /// Wiring faults that the answer names: as likely as not, or without a probability.
    pub fn named_wiring(&self) -> impl Iterator<Item = &WiringFound> {
        let named = |w: &&WiringFound| w.probability.is_none_or(|p| p >= NAMED);
        self.wiring.iter().filter(named)
    }
}
