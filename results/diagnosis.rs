//! `result.json` of a diagnosis.

mod gap;
mod sight;
mod verdict;

use serde::{Deserialize, Serialize};

use crate::nullable;

pub use gap::{Gap, Shares, SignalGap, Where};
pub use sight::{
    Calibration, CalibrationRow, DetectionLimit, Isolability, MissingForce, RankedSet,
};
pub use verdict::{EffectResult, Group, HypothesisResult, Kind, Remainder, Tolerance, Verdict};

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
    /// File of its commands, beside the result; empty where there are none to play.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub file: String,
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
    /// Effects of the verdict that are one law at several sites.
    #[serde(default)]
    pub groups: Vec<Group>,
    /// What an ordinary machine has of effects, fitted and not named; empty where what is named does without.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tolerances: Vec<Tolerance>,
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
    /// Sets of effects by their evidence, the best first, at most 20.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ranking: Vec<RankedSet>,
    /// Which of the leading effects these logs tell apart; `None` where none leads.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub isolability: Option<Isolability>,
    /// The smallest size of each effect that these logs could have shown.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub detection_limits: Vec<DetectionLimit>,
    /// What the diagnosis says of simulated logs; `None` where that was not asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<Calibration>,
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
        "gap":{"noise_floor":1.0,"nominal":9.1,"identified":4.0,"refined":1.1,"closed":0.98,"closed_interval95":[0.9,1.0],"shares":{"named":0.98,"learnable":0.01,"unrepeatable":0.01},
            "signals":[{"signal":"elbow","noise":0.01,"unit":"rad","nominal":null,"identified":4.0,"refined":1.1}]},
        "where":[{"signal":"elbow","regime":"reversal","share":1.0,"condition":null}],
        "hypotheses":[{"effects":["actuator-delay@elbow"],"probability":0.9},{"effects":["none"],"probability":0.1}],
        "effects":[{"effect":"actuator-delay","site":"elbow","probability":0.9,"gap_closed":null,"parameters":{"delay":0.03},"units":{"delay":"s"},"intervals95":{"delay":[0.029,null]},"at_bound":false}],
        "verdict":{"kind":"effects","effects":["actuator-delay@elbow"],"probability":0.9,"ambiguous_with":[["sensor-delay@q"]],"unexplained":0.02,
            "remainder":{"share":0.02,"where":"elbow","against":"speed","kinds":["friction-like"]}},
        "groups":[{"effect":"actuator-delay","sites":["elbow","wrist"]}],
        "parameters":[{"name":"damping","estimate":0.2,"std":0.01,"interval95":[0.18,0.22]}],
        "checks":[{"check":"excitation","ok":true,"detail":""}],
        "next_experiment":{"separates":["a","b"],"how":"faster"},
        "wiring":[{"fault":"wiring-sign","columns":["q"],"probability":1.0,"mend":"sign = -1"}],
        "missing_force":[{"dof":"elbow","unit":"N m","identified":0.4,"refined":0.1,"correlation_time":0.2}],
        "ranking":[{"effects":["actuator-delay@elbow"],"screened":90.5,"fitted":112.0}],
        "isolability":{"effects":["a@q","b@q"],"angles":[[0.0,1.2],[1.2,0.0]]},
        "detection_limits":[{"effect":"a@q","parameter":"delay","unit":"s","value":0.001}],
        "not_tried":[{"stage":"confirmation","effects":["b@q"]}],
        "seconds":9.5,"seconds_to_first_table":2.5}"#;

    #[test]
    fn a_result_that_is_read_and_written_again_is_the_same() {
        let result: DiagnosisResult = serde_json::from_str(TEXT).expect("it is of the contract");
        assert!(result.gap.signals[0].nominal.is_nan());
        assert_eq!(result.verdict.effects, [result.effects[0].label()]);
        assert!(result.effects[0].intervals95["delay"][1].is_nan());
        let written = serde_json::to_value(&result).expect("it has a form");
        let given: serde_json::Value = serde_json::from_str(TEXT).expect("it is JSON");
        assert_eq!(written, given);
    }
}
