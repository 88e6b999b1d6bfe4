//! `result.json` of a diagnosis.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::nullable;

/// Gap of one sensor, root mean square in units of its noise.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct SignalGap {
    /// Sensor.
    pub signal: String,
    /// Deviation of its noise, in its unit.
    #[serde(deserialize_with = "nullable::scalar")]
    pub noise: f64,
    /// Unit.
    pub unit: String,
    /// The model as given.
    #[serde(deserialize_with = "nullable::scalar")]
    pub nominal: f64,
    /// After fitting the study's own parameters.
    #[serde(deserialize_with = "nullable::scalar")]
    pub identified: f64,
    /// With the verdict's effects.
    #[serde(deserialize_with = "nullable::scalar")]
    pub refined: f64,
}

/// Gaps on the logs held out, root mean square in units of the noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Gap {
    /// 1 by definition.
    #[serde(deserialize_with = "nullable::scalar")]
    pub noise_floor: f64,
    /// The model as given.
    #[serde(deserialize_with = "nullable::scalar")]
    pub nominal: f64,
    /// After fitting the study's own parameters.
    #[serde(deserialize_with = "nullable::scalar")]
    pub identified: f64,
    /// With the verdict's effects.
    #[serde(deserialize_with = "nullable::scalar")]
    pub refined: f64,
    /// Share of the excess squared gap that they close; null where there is none.
    pub closed: Option<f64>,
    /// 95 % interval of it, by a bootstrap over episodes.
    pub closed_interval95: Option<[f64; 2]>,
    /// By sensor.
    pub signals: Vec<SignalGap>,
}

impl Default for Gap {
    fn default() -> Self {
        Self {
            noise_floor: 1.0,
            nominal: f64::NAN,
            identified: f64::NAN,
            refined: f64::NAN,
            closed: None,
            closed_interval95: None,
            signals: Vec::new(),
        }
    }
}

/// A share of the excess squared residual.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[schemars(rename = "Place")]
pub struct Where {
    /// Entry of a sensor.
    pub signal: String,
    /// Regime of motion.
    pub regime: String,
    /// Share of the excess.
    #[serde(deserialize_with = "nullable::scalar")]
    pub share: f64,
    /// A readable condition under which it arises, where one is found.
    pub condition: Option<String>,
}

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
    /// Probability of it.
    #[serde(deserialize_with = "nullable::scalar")]
    pub probability: f64,
    /// Rival sets that these data cannot tell from it.
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

/// A parameter of the study, as fitted with the verdict's effects.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[schemars(rename = "StudyParameter")]
pub struct ParameterResult {
    /// Name.
    pub name: String,
    /// Unit; may be empty.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Value in the model as given, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
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

/// A check before the diagnosis.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[schemars(rename = "Check")]
pub struct CheckResult {
    /// Name.
    pub check: String,
    /// Whether it passed.
    pub ok: bool,
    /// What was seen, and what to do.
    pub detail: String,
}

/// A fault of wiring: columns of the logs that do not mean what their names say.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[schemars(rename = "Wiring")]
pub struct WiringResult {
    /// `wiring-swapped`, `wiring-sign`, `wiring-unit`, `wiring-offset` or `wiring-clock`.
    pub fault: String,
    /// Sensors or `ctrl.<actuator>` concerned.
    pub columns: Vec<String>,
    /// Probability against the wiring as given.
    #[serde(deserialize_with = "nullable::scalar")]
    pub probability: f64,
    /// Lines for the study file.
    pub mend: String,
}

/// The experiment that would tell rivals apart.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct NextExperiment {
    /// What it would tell apart.
    pub separates: Vec<String>,
    /// How.
    pub how: String,
}

/// The generalized force that the model lacks at a degree of freedom: its deviation over the training logs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct MissingForce {
    /// Joint; with the axis (`.x`, `.rx`, …) where it has several.
    pub dof: String,
    /// `N` or `N m`.
    pub unit: String,
    /// After fitting the study's parameters.
    #[serde(deserialize_with = "nullable::scalar")]
    pub identified: f64,
    /// With the verdict's effects.
    #[serde(deserialize_with = "nullable::scalar")]
    pub refined: f64,
    /// Time over which it stays much the same, s.
    #[serde(deserialize_with = "nullable::scalar")]
    pub correlation_time: f64,
}

/// A set of effects with the evidence for it over the model without effects, natural logarithms.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct RankedSet {
    /// Effects at their sites.
    pub effects: Vec<String>,
    /// In the first screening: to first order, at fixed noise.
    pub screened: Option<f64>,
    /// With the set in the model, values and noise fitted.
    pub fitted: Option<f64>,
}

/// How well the logs tell effects apart: principal angles between what they add to the model along the logs, what
/// the study's parameters can do projected out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Isolability {
    /// Effects at their sites, the most evident first.
    pub effects: Vec<String>,
    /// Smallest angle between each two, rad: 0 where they act alike, pi / 2 where they have nothing in common.
    #[serde(deserialize_with = "nullable::table")]
    pub angles: Vec<Vec<f64>>,
}

/// A stage that a time limit or an interruption cut short.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct NotTried {
    /// What was left out.
    pub stage: String,
    /// For which sets of effects, `a@x + b@y`; empty where it concerns none.
    pub effects: Vec<String>,
}

/// `result.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[schemars(rename = "Diagnosis")]
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
    /// Sets of effects by their evidence, the best first, at most 20; empty where replays decide.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ranking: Vec<RankedSet>,
    /// Which of the leading effects these logs tell apart; `None` where replays decide.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub isolability: Option<Isolability>,
    /// What a time limit or an interruption left out; empty where the search came to its end.
    #[serde(default)]
    pub not_tried: Vec<NotTried>,
    /// Wall time of the diagnosis, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
    /// Wall time until the first ranking was known, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seconds_to_first_table: Option<f64>,
    /// The task in the real world, before and after; `None` for a study.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub real_world: Option<RealWorld>,
}

/// A task in the real world with one simulator after the other.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default)]
#[schemars(rename = "RealWorldTrials")]
pub struct RealWorld {
    /// The task.
    pub task: String,
    /// Its condition; may be empty.
    pub condition: String,
    /// Name of its metric.
    pub metric: String,
    /// Unit of the metric.
    pub unit: String,
    /// The rule of success, in words.
    pub rule: String,
    /// Effects that the real world has and the simulator lacks.
    pub effects: Vec<String>,
    /// Episodes that were played to tell explanations apart, in words; may be empty.
    pub experiments: String,
    /// The hidden true values, by name.
    pub truth: Vec<(String, f64)>,
    /// One a world and simulator, in the order shown.
    pub trials: Vec<TaskTrial>,
}

/// Runs of a task in one world with one simulator.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default)]
pub struct TaskTrial {
    /// In which world.
    pub world: String,
    /// With which simulator.
    pub simulator: String,
    /// The metric of each run, in its unit.
    #[serde(deserialize_with = "nullable::list")]
    pub values: Vec<f64>,
    /// Runs that succeeded.
    pub successes: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the contract has it; a number that was not finite is null.
    const TEXT: &str = r#"{"schema":1,"study":"arm","sentence":"The elbow answers late.",
        "gap":{"noise_floor":1.0,"nominal":9.1,"identified":4.0,"refined":1.1,"closed":0.98,"closed_interval95":[0.9,1.0],
            "signals":[{"signal":"elbow","noise":0.01,"unit":"rad","nominal":null,"identified":4.0,"refined":1.1}]},
        "where":[{"signal":"elbow","regime":"reversal","share":1.0,"condition":null}],
        "hypotheses":[{"effects":["actuator-delay@elbow"],"probability":0.9},{"effects":["none"],"probability":0.1}],
        "effects":[{"effect":"actuator-delay","site":"elbow","probability":0.9,"gap_closed":null,"parameters":{"delay":0.03}}],
        "verdict":{"kind":"effects","effects":["actuator-delay@elbow"],"probability":0.9,"ambiguous_with":[["sensor-delay@q"]],"unexplained":0.02},
        "parameters":[{"name":"damping","estimate":0.2,"std":0.01,"interval95":[0.18,0.22]}],
        "checks":[{"check":"excitation","ok":true,"detail":""}],
        "next_experiment":{"separates":["a","b"],"how":"faster"},
        "wiring":[{"fault":"wiring-sign","columns":["q"],"probability":1.0,"mend":"sign = -1"}],
        "missing_force":[{"dof":"elbow","unit":"N m","identified":0.4,"refined":0.1,"correlation_time":0.2}],
        "ranking":[{"effects":["actuator-delay@elbow"],"screened":90.5,"fitted":112.0}],
        "isolability":{"effects":["a@q","b@q"],"angles":[[0.0,1.2],[1.2,0.0]]},
        "not_tried":[{"stage":"confirmation","effects":["b@q"]}],
        "seconds":9.5,"seconds_to_first_table":2.5}"#;

    #[test]
    fn a_result_that_is_read_and_written_again_is_the_same() {
        let result: DiagnosisResult = serde_json::from_str(TEXT).expect("it is of the contract");
        assert!(result.gap.signals[0].nominal.is_nan());
        assert_eq!(result.verdict.effects, [result.effects[0].label()]);
        let written = serde_json::to_value(&result).expect("it has a form");
        let given: serde_json::Value = serde_json::from_str(TEXT).expect("it is JSON");
        assert_eq!(written, given);
    }
}
