//! What a diagnosis said: the keys of its `result.json` that are scored.
//!
//! They are read as the contract has them and not as types of the diagnosis, so that any tool that writes such a file
//! can be scored, and so that nothing of the diagnosis is inside of the stick.

use std::collections::BTreeMap;
use std::path::Path;

use asid_core::{Error, Result};
use serde::{Deserialize, Serialize};

/// Gaps on the logs held out, in units of the noise.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// After fitting the study's own parameters.
    #[serde(default)]
    pub identified: Option<f64>,
    /// With the verdict's effects.
    #[serde(default)]
    pub refined: Option<f64>,
    /// Share of the excess that they close.
    #[serde(default)]
    pub closed: Option<f64>,
    /// Noise by sensor.
    #[serde(default)]
    pub signals: Vec<SignalNoise>,
}

/// Noise that the diagnosis took a sensor to have.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SignalNoise {
    /// Sensor.
    pub signal: String,
    /// Deviation, in its unit.
    pub noise: f64,
}

/// Kind of the verdict of an answer that names nothing, and takes what it learned off the residuals.
pub const RESIDUAL: &str = "residual";

/// A share of the excess.
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

/// A set of effects, `none` or `unknown`, with its probability.
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
    /// Fitted values.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
    /// Their 95 % intervals, where it gives any.
    #[serde(default)]
    pub intervals95: BTreeMap<String, [f64; 2]>,
}

impl EffectValues {
    /// `NAME@SITE`.
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
    /// Probability.
    pub probability: f64,
    /// Rival sets that the data cannot tell from it.
    #[serde(default)]
    pub ambiguous_with: Vec<Vec<String>>,
    /// What is left beside it.
    #[serde(default)]
    pub remainder: Option<serde_json::Value>,
}

impl Verdict {
    /// Its set of effects, sorted; `["none"]` or `["unknown"]` where it names none.
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

/// A parameter of the study.
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

/// A fault of wiring that it found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WiringFound {
    /// `wiring-sign` and the like.
    pub fault: String,
    /// Columns concerned.
    #[serde(default)]
    pub columns: Vec<String>,
    /// Probability.
    #[serde(default)]
    pub probability: Option<f64>,
}

/// What a diagnosis said.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// Gaps.
    pub gap: Gap,
    /// Where the gap lies.
    #[serde(default, rename = "where")]
    pub places: Vec<Place>,
    /// Sets with probabilities.
    #[serde(default)]
    pub hypotheses: Vec<Hypothesis>,
    /// Effects with values.
    #[serde(default)]
    pub effects: Vec<EffectValues>,
    /// The verdict.
    pub verdict: Verdict,
    /// The study's parameters.
    #[serde(default)]
    pub parameters: Vec<ParameterEstimate>,
    /// Faults of wiring.
    #[serde(default)]
    pub wiring: Vec<WiringFound>,
    /// What it learned is left of the readings of the logs held out by a replay with the study's parameters: `rows x
    /// entries` of each log, three an orientation, in the sensor's unit, rad of an orientation.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub learned: Vec<Vec<f64>>,
}

/// Probability of a fault of wiring from which on it counts as named: as likely as not.
const NAMED: f64 = 0.5;

impl Answer {
    /// Reads a `result.json`.
    ///
    /// # Errors
    /// When the file is missing or is no result of a diagnosis.
    pub fn read(path: &Path) -> Result<Self> {
        let fail = |message: String| Error::File {
            path: path.to_owned(),
            message,
        };
        let text = std::fs::read_to_string(path).map_err(|e| fail(e.to_string()))?;
        serde_json::from_str(&text).map_err(|e| fail(format!("is no result of a diagnosis: {e}")))
    }

    /// Whether it says by no name what is missing.
    #[must_use]
    pub fn names_nothing(&self) -> bool {
        self.verdict.kind == RESIDUAL
    }

    /// Fitted values of an effect at its site.
    #[must_use]
    pub fn values(&self, effect: &str) -> Option<&EffectValues> {
        self.effects.iter().find(|e| e.label() == effect)
    }

    /// Faults of wiring that it names: as likely as not, or without a probability.
    pub fn named_wiring(&self) -> impl Iterator<Item = &WiringFound> {
        let named = |w: &&WiringFound| w.probability.is_none_or(|p| p >= NAMED);
        self.wiring.iter().filter(named)
    }
}
