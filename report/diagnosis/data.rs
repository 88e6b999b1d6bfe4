//! The data of a diagnosis' report: the answer and what it rests on.

use serde::{Deserialize, Serialize};

use super::real_world::RealWorld;
use super::trace::{Map, Rung, SignalTrace};
use crate::nullable;
use crate::run::{FileEntry, NamedText};

/// Everything that the report of a diagnosis shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Diagnosis {
    /// Name of the study.
    pub study: String,
    /// The answer in one sentence.
    pub sentence: String,
    /// The gap as a whole.
    pub gap: Gap,
    /// The gap by sensor.
    pub signal_gaps: Vec<SignalGap>,
    /// Where the gap of the identified model lies, largest share first.
    pub places: Vec<Place>,
    /// Sets of effects with their probabilities, most probable first.
    pub hypotheses: Vec<Hypothesis>,
    /// Single effects.
    pub effects: Vec<Effect>,
    /// The answer.
    pub verdict: Verdict,
    /// The study's parameters.
    pub parameters: Vec<Parameter>,
    /// Checks of the study and its logs.
    pub checks: Vec<Check>,
    /// Faults of wiring; everything else is said of the study after their mending.
    pub wiring: Vec<Wiring>,
    /// What the next experiment would tell apart.
    pub separates: Vec<String>,
    /// How; empty where there is none to propose.
    pub next_experiment: String,
    /// Number of episodes held out; 0 where it is not known.
    pub held_out: usize,
    /// Number of episodes fitted to; 0 where it is not known.
    pub fitted_to: usize,
    /// Gap of each single effect that was tried to the end.
    pub ladder: Vec<Rung>,
    /// Readings of the held-out episodes beside the simulations.
    pub signals: Vec<SignalTrace>,
    /// Residuals by place.
    pub map: Option<Map>,
    /// Candidates that could not be tried: name and why.
    pub left_out: Vec<NamedText>,
    /// The task in the real world, before and after; `None` for a study.
    pub real_world: Option<RealWorld>,
    /// Engine of the simulations.
    pub engine: String,
    /// The command line that repeats the diagnosis.
    pub command: String,
    /// Versions and whatever else it takes: `asid`, `seed`, ….
    pub versions: Vec<NamedText>,
    /// What else lies in the folder.
    pub files: Vec<FileEntry>,
}

/// Root mean square residuals on the logs held out, in units of the noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Gap {
    /// The model as given.
    #[serde(deserialize_with = "nullable::scalar")]
    pub nominal: f64,
    /// After fitting the study's own parameters.
    #[serde(deserialize_with = "nullable::scalar")]
    pub identified: f64,
    /// With the verdict's effects.
    #[serde(deserialize_with = "nullable::scalar")]
    pub refined: f64,
    /// Share of the excess squared gap that the effects close.
    pub closed: Option<f64>,
    /// 95 % interval of it.
    pub closed_interval95: Option<[f64; 2]>,
}

impl Default for Gap {
    fn default() -> Self {
        Self {
            nominal: f64::NAN,
            identified: f64::NAN,
            refined: f64::NAN,
            closed: None,
            closed_interval95: None,
        }
    }
}

/// The gap of one sensor.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SignalGap {
    /// Sensor.
    pub signal: String,
    /// Unit of the noise.
    pub unit: String,
    /// Deviation of its noise.
    #[serde(deserialize_with = "nullable::scalar")]
    pub noise: f64,
    /// The model as given, after fitting, and with the verdict's effects.
    #[serde(deserialize_with = "nullable::array")]
    pub gaps: [f64; 3],
}

/// A share of the excess squared residual.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Entry of a sensor.
    pub signal: String,
    /// Regime of motion.
    pub regime: String,
    /// Share.
    #[serde(deserialize_with = "nullable::scalar")]
    pub share: f64,
    /// When it arises, such as `puck_pos.0 > 0.41`; may be empty.
    pub condition: String,
}

/// A set of effects, or `none` or `unknown`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Hypothesis {
    /// Effects at their sites.
    pub effects: Vec<String>,
    /// Probability.
    #[serde(deserialize_with = "nullable::scalar")]
    pub probability: f64,
}

/// A single effect.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    /// Name.
    pub name: String,
    /// Site; empty for an effect of the whole scene.
    pub site: String,
    /// What it is, in a few words; may be empty.
    pub about: String,
    /// Probability over all hypotheses.
    #[serde(deserialize_with = "nullable::scalar")]
    pub probability: f64,
    /// Share of the excess squared gap that it closes alone.
    pub closes: Option<f64>,
    /// Fitted values.
    pub values: Vec<EffectValue>,
}

impl Effect {
    /// `name@site`.
    pub(super) fn label(&self) -> String {
        if self.site.is_empty() {
            self.name.clone()
        } else {
            format!("{}@{}", self.name, self.site)
        }
    }
}

/// The fitted value of an effect's parameter.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EffectValue {
    /// Name.
    pub name: String,
    /// Value.
    #[serde(deserialize_with = "nullable::scalar")]
    pub value: f64,
    /// Unit; may be empty.
    pub unit: String,
    /// Value at which the effect is off, where it is known.
    pub null: Option<f64>,
}

/// What kind of answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Verdict {
    /// What kind.
    pub kind: Kind,
    /// Effects at their sites.
    pub effects: Vec<String>,
    /// Probability.
    #[serde(deserialize_with = "nullable::scalar")]
    pub probability: f64,
    /// Sets that these data cannot tell from it.
    pub ambiguous_with: Vec<Vec<String>>,
    /// Share of the excess squared gap that it leaves.
    #[serde(deserialize_with = "nullable::scalar")]
    pub unexplained: f64,
}

impl Default for Verdict {
    fn default() -> Self {
        Self {
            kind: Kind::None,
            effects: Vec::new(),
            probability: f64::NAN,
            ambiguous_with: Vec::new(),
            unexplained: f64::NAN,
        }
    }
}

/// A parameter of the study, as fitted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Name.
    pub name: String,
    /// Unit; may be empty.
    pub unit: String,
    /// Value in the model as given, where it is known.
    pub nominal: Option<f64>,
    /// Estimate.
    #[serde(deserialize_with = "nullable::scalar")]
    pub estimate: f64,
    /// Deviation.
    #[serde(deserialize_with = "nullable::scalar")]
    pub std: f64,
    /// 95 % interval.
    #[serde(deserialize_with = "nullable::array")]
    pub interval95: [f64; 2],
}

/// Columns of the logs that do not mean what their names say.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wiring {
    /// Kind of fault.
    pub fault: String,
    /// Columns concerned.
    pub columns: Vec<String>,
    /// Probability against the wiring as given.
    pub probability: f64,
    /// Lines for the study file.
    pub mend: String,
}

/// A check before the diagnosis.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// Name.
    pub name: String,
    /// Whether it passed.
    pub ok: bool,
    /// What was seen, and what to do.
    pub detail: String,
}
