//! What the logs show of effects: missing forces, evidence, what can be told apart and what could be seen.

use serde::{Deserialize, Serialize};

use crate::nullable;

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

/// The smallest size of an effect that these logs could have shown.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct DetectionLimit {
    /// Effect at its site.
    pub effect: String,
    /// Its parameter.
    pub parameter: String,
    /// Unit of the parameter; may be empty.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Value from which on it is seen; NaN where no value within its range is.
    #[serde(deserialize_with = "nullable::scalar")]
    pub value: f64,
    /// At twice that value: the share of such logs by which it is ranked first; `None` where it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recognised: Option<f64>,
    /// The effect that most of the others rank first; `None` where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub taken_for: Option<String>,
}

/// What the diagnosis says of logs that were simulated in place of the real ones.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Calibration {
    /// Simulated sets of logs that were diagnosed.
    pub runs: usize,
    /// Probability that the real logs' answer is right, by Bayes' rule over these runs; `None` where none gave it.
    pub probability: Option<f64>,
    /// Probability of as large a gap where the model lacks nothing; `None` where that was not simulated.
    pub p_no_gap: Option<f64>,
    /// By what the simulated machine lacked.
    pub rows: Vec<CalibrationRow>,
}

/// Diagnoses of machines that lack the same.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CalibrationRow {
    /// What they lack, as fitted to the real logs; empty for nothing.
    pub effects: Vec<String>,
    /// Runs.
    pub runs: usize,
    /// Runs that said just this.
    pub right: usize,
    /// Runs that said that nothing is missing, where that is wrong.
    pub none: usize,
    /// Runs that named no effect.
    pub unknown: usize,
    /// Runs that named other effects.
    pub other: usize,
    /// Mean probability that they stated.
    #[serde(deserialize_with = "nullable::scalar")]
    pub probability: f64,
}
