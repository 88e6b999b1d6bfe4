//! The data of exploration, learning and the task.

use serde::{Deserialize, Serialize};

use super::{NamedValue, Shape};
use asid_results::nullable;

/// Objective of the exploration, and what the real episode gathered.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Exploration {
    /// The objective by name: `trace`, `a-optimal`, `d-optimal`.
    pub objective: String,
    /// `one-step` or `trajectory`: what the sensitivities include.
    pub form: String,
    /// Time at the end of each control step in s.
    #[serde(deserialize_with = "nullable::list")]
    pub time: Vec<f64>,
    /// Information gained in each control step, in `gained_unit`.
    #[serde(deserialize_with = "nullable::list")]
    pub gained: Vec<f64>,
    /// Unit of `gained`, such as `nat`; may be empty.
    pub gained_unit: String,
    /// Expected posterior standard deviation so far, one entry a parameter.
    pub expected_std: Vec<ExpectedStd>,
    /// Share of the control steps in which the robot touched the object.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_fraction: Option<f64>,
}

/// Expected posterior standard deviation of a parameter after each control step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ExpectedStd {
    /// The parameter.
    pub parameter: String,
    /// Unit of the values.
    pub unit: String,
    /// The standard deviation before the first step (the prior's).
    pub prior: Option<f64>,
    /// One value a control step.
    #[serde(deserialize_with = "nullable::list")]
    pub value: Vec<f64>,
}

/// Learning curve of the explorer's return.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LearningCurve {
    /// What the x axis counts: `iteration`, `environment steps`.
    pub x_label: String,
    /// What the y axis shows: `return`, with the objective's unit if any.
    pub y_label: String,
    /// Iterations or environment steps.
    #[serde(deserialize_with = "nullable::list")]
    pub x: Vec<f64>,
    /// Mean return over the candidates or episodes.
    #[serde(deserialize_with = "nullable::list")]
    pub mean: Vec<f64>,
    /// Their standard deviation; may be empty.
    #[serde(deserialize_with = "nullable::list")]
    pub std: Vec<f64>,
    /// The best of them; may be empty.
    #[serde(deserialize_with = "nullable::list")]
    pub best: Vec<f64>,
}

/// The task itself, attempted once in the real world.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Downstream {
    /// Metric by name, such as `tilt_deg`.
    pub metric: String,
    /// Its name in a sentence, such as `tilt`.
    pub label: String,
    /// Unit of the metric.
    pub unit: String,
    /// Its final value.
    #[serde(deserialize_with = "nullable::scalar")]
    pub value: f64,
    /// Whether the task's rule of success held.
    pub success: bool,
    /// The rule in words, such as `below 5° and still on the ledge`.
    pub rule: String,
    /// The metric's limit in `unit`, if the rule has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold: Option<f64>,
    /// Times in s.
    #[serde(deserialize_with = "nullable::list")]
    pub time: Vec<f64>,
    /// The metric (or the quantity it is read from) at each time, in `unit`.
    #[serde(deserialize_with = "nullable::list")]
    pub metric_over_time: Vec<f64>,
    /// Phases of the motion.
    pub phases: Vec<Phase>,
    /// How the solver found its action.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub search: Option<Search>,
    /// The end of the task, seen from the side.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub side_view: Option<SideView>,
}

/// A phase of the task's motion.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Phase {
    /// Name, such as `lift`.
    pub name: String,
    /// Start in s.
    #[serde(deserialize_with = "nullable::scalar")]
    pub start: f64,
    /// End in s.
    #[serde(deserialize_with = "nullable::scalar")]
    pub end: f64,
}

/// How the solver found its action.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Search {
    /// Chosen action: one entry a dimension, with its name and unit.
    pub chosen: Vec<NamedValue>,
    /// Name of the cost, such as `expected tilt`.
    pub cost_label: String,
    /// Unit of the cost.
    pub cost_unit: String,
    /// The actions tried.
    pub trials: Vec<Trial>,
}

/// One action that the solver tried.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Iteration of the search, from 0.
    pub iteration: u32,
    /// The action in the dimensions and units of [`Search::chosen`].
    #[serde(deserialize_with = "nullable::list")]
    pub action: Vec<f64>,
    /// Its cost.
    #[serde(deserialize_with = "nullable::scalar")]
    pub cost: f64,
}

/// A scene seen from the side, in m.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SideView {
    /// Label of the horizontal axis, such as `y` or `along the rod`.
    pub x_label: String,
    /// Height below which nothing is shown, such as the table's top.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub floor: Option<f64>,
    /// The shapes, back to front.
    pub shapes: Vec<Shape>,
}
