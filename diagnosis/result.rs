//! `result.json` of a diagnosis, and the diagnosis as a whole.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Gap of one sensor, root mean square in units of its noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SignalGap {
    /// Sensor.
    pub signal: String,
    /// Deviation of its noise, in its unit.
    pub noise: f64,
    /// Unit.
    pub unit: String,
    /// The model as given.
    pub nominal: f64,
    /// After fitting the study's own parameters.
    pub identified: f64,
    /// With the verdict's effects.
    pub refined: f64,
}

/// Gaps on the logs held out, root mean square in units of the noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// 1 by definition.
    pub noise_floor: f64,
    /// The model as given.
    pub nominal: f64,
    /// After fitting the study's own parameters.
    pub identified: f64,
    /// With the verdict's effects.
    pub refined: f64,
    /// Share of the excess squared gap that they close; null where there is none.
    pub closed: Option<f64>,
    /// 95 % interval of it, by a bootstrap over episodes.
    pub closed_interval95: Option<[f64; 2]>,
    /// By sensor.
    pub signals: Vec<SignalGap>,
}

/// A share of the excess squared residual.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Where {
    /// Entry of a sensor.
    pub signal: String,
    /// Regime of motion.
    pub regime: String,
    /// Share of the excess.
    pub share: f64,
    /// A readable condition under which it arises, where one is found.
    pub condition: Option<String>,
}

/// A set of effects, or `none` or `unknown`, with its probability.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HypothesisResult {
    /// Effects at their sites.
    pub effects: Vec<String>,
    /// Probability.
    pub probability: f64,
}

/// An effect with its marginal probability.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EffectResult {
    /// Name.
    pub effect: String,
    /// Site; empty for an effect of the whole scene.
    pub site: String,
    /// Sum of the probabilities of the hypotheses that it is in.
    pub probability: f64,
    /// Share of the excess squared gap that it closes alone.
    pub gap_closed: Option<f64>,
    /// Fitted values.
    pub parameters: BTreeMap<String, f64>,
}

/// What kind of answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// No gap beyond the noise and the study's parameters.
    None,
    /// Effects of the catalogue.
    Effects,
    /// A gap that nothing in the catalogue explains.
    Unknown,
}

/// The answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// What kind.
    pub kind: Kind,
    /// Effects at their sites.
    pub effects: Vec<String>,
    /// Probability of it.
    pub probability: f64,
    /// Rival sets that these data cannot tell from it.
    pub ambiguous_with: Vec<Vec<String>>,
    /// Share of the excess squared gap that it leaves.
    pub unexplained: f64,
}

/// A parameter of the study, as fitted with the verdict's effects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterResult {
    /// Name.
    pub name: String,
    /// Estimate.
    pub estimate: f64,
    /// Deviation.
    pub std: f64,
    /// 95 % interval.
    pub interval95: [f64; 2],
}

/// A check before the diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckResult {
    /// Name.
    pub check: String,
    /// Whether it passed.
    pub ok: bool,
    /// What was seen, and what to do.
    pub detail: String,
}

/// A fault of wiring: columns of the logs that do not mean what their names say.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WiringResult {
    /// `wiring-swapped`, `wiring-sign`, `wiring-unit`, `wiring-offset` or `wiring-clock`.
    pub fault: String,
    /// Sensors or `ctrl.<actuator>` concerned.
    pub columns: Vec<String>,
    /// Probability against the wiring as given.
    pub probability: f64,
    /// Lines for the study file.
    pub mend: String,
}

/// The experiment that would tell rivals apart.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NextExperiment {
    /// What it would tell apart.
    pub separates: Vec<String>,
    /// How.
    pub how: String,
}

/// The generalized force that the model lacks at a degree of freedom: its deviation over the training logs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MissingForce {
    /// Joint; with the axis (`.x`, `.rx`, …) where it has several.
    pub dof: String,
    /// `N` or `N m`.
    pub unit: String,
    /// After fitting the study's parameters.
    pub identified: f64,
    /// With the verdict's effects.
    pub refined: f64,
    /// Time over which it stays much the same, s.
    pub correlation_time: f64,
}

/// `result.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DiagnosisResult {
    /// 1.
    pub schema: u32,
    /// Name of the study.
    pub study: String,
    /// The answer in one sentence.
    pub sentence: String,
    /// Gaps.
    pub gap: Gap,
    /// Where the gap of the identified model lies, largest share first.
    #[serde(rename = "where")]
    pub places: Vec<Where>,
    /// Probabilities, most probable first.
    pub hypotheses: Vec<HypothesisResult>,
    /// Effects of the hypotheses.
    pub effects: Vec<EffectResult>,
    /// The answer.
    pub verdict: Verdict,
    /// The study's parameters.
    pub parameters: Vec<ParameterResult>,
    /// Checks.
    pub checks: Vec<CheckResult>,
    /// What to do next.
    pub next_experiment: NextExperiment,
    /// Faults of wiring; everything else is said of the study after their mending.
    #[serde(default)]
    pub wiring: Vec<WiringResult>,
    /// The force that is missing at each degree of freedom; empty where contact lasts, and it is not estimated.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing_force: Vec<MissingForce>,
}

/// One signal of one held-out episode: the real reading and three simulations, with gaps
/// (`None`) where a reading is missing or a simulation diverged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SignalTrace {
    /// Episode's file.
    pub episode: String,
    /// Entry, `sensor` or `sensor.i`.
    pub signal: String,
    /// Unit.
    pub unit: String,
    /// Deviation of the sensor's noise, in its unit.
    pub noise: f64,
    /// Times, s.
    pub time: Vec<f64>,
    /// Log.
    pub real: Vec<Option<f64>>,
    /// The model as given.
    pub nominal: Vec<Option<f64>>,
    /// After fitting the study's parameters.
    pub identified: Vec<Option<f64>>,
    /// With the verdict's effects.
    pub refined: Vec<Option<f64>>,
}

/// What the report shows besides `result.json`; stored as `trace.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DiagnosisTrace {
    /// Signals of the held-out episodes.
    pub signals: Vec<SignalTrace>,
    /// Gap on the held-out logs of each single effect tried to the end: label and gap.
    pub ladder: Vec<(String, f64)>,
    /// A map of where: position (m, two axes), magnitude of the residual in units of the
    /// noise, for a sensor of a position; empty where there is none.
    pub map: Vec<[f64; 3]>,
    /// Names of the map's axes.
    pub map_axes: [String; 2],
    /// Candidates that could not be tried, and why.
    pub left_out: Vec<(String, String)>,
}
