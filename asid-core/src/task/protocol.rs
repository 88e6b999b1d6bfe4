//! Data on how a task is explored, attempted and judged.

use crate::signal::Signal;

/// A number with a name, a unit and a range: an entry of an action or of a start pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Coordinate {
    /// Name, such as `x`.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Smallest and largest value.
    pub range: [f64; 2],
}

impl Coordinate {
    /// A coordinate of this name, unit and range.
    #[must_use]
    pub fn new(name: &str, unit: &str, range: [f64; 2]) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            range,
        }
    }

    /// Value at a fraction of the range.
    #[must_use]
    pub fn at(&self, fraction: f64) -> f64 {
        self.range[0] + fraction * (self.range[1] - self.range[0])
    }

    /// Middle of the range.
    #[must_use]
    pub fn center(&self) -> f64 {
        self.at(0.5)
    }

    /// Standard deviation of a uniform draw from the range.
    #[must_use]
    pub fn std(&self) -> f64 {
        (self.range[1] - self.range[0]) / 12_f64.sqrt()
    }
}

/// A named case of a task, such as `left`: true values, or a goal.
#[derive(Clone, Debug, PartialEq)]
pub struct Condition {
    /// Name in tables.
    pub name: String,
    /// Smallest and largest true value by parameter name, equal for a fixed value; they may lie
    /// outside the prior. A parameter without an entry is drawn from the whole prior.
    pub truth: Vec<(String, [f64; 2])>,
}

impl Condition {
    /// A condition of fixed true values.
    #[must_use]
    pub fn fixed(name: &str, truth: &[(&str, f64)]) -> Self {
        Self {
            name: name.into(),
            truth: truth.iter().map(|&(n, v)| (n.to_owned(), [v, v])).collect(),
        }
    }

    /// A condition whose true values are drawn from ranges, or from the prior for other parameters.
    #[must_use]
    pub fn drawn(name: &str, ranges: &[(&str, [f64; 2])]) -> Self {
        Self {
            name: name.into(),
            truth: ranges.iter().map(|&(n, r)| (n.to_owned(), r)).collect(),
        }
    }
}

/// How the unknowns are explored.
#[derive(Clone, Debug, PartialEq)]
pub struct ExplorationProtocol {
    /// Control steps of an episode.
    pub horizon: usize,
    /// Frames (rows of commands and readings) of a control step.
    pub frames_per_step: usize,
    /// Length of a frame, s; a multiple of the physics time step.
    pub frame_period: f64,
    /// Entries of an action.
    pub action: Vec<Coordinate>,
    /// Start pose of the object, drawn uniformly.
    pub start: Vec<Coordinate>,
    /// What a tracker measures of the object: the data of the likelihood.
    pub signals: Vec<Signal>,
    /// Sensors of the machine itself, for policies and logs.
    pub proprioception: Vec<String>,
    /// Pairs of bodies whose contact counts as interaction.
    pub contact: Vec<[String; 2]>,
}

impl ExplorationProtocol {
    /// Frames of an episode.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.horizon * self.frames_per_step
    }

    /// Names of all sensors in a row of readings: tracked signals, then proprioception.
    #[must_use]
    pub fn channels(&self) -> Vec<String> {
        let tracked = self.signals.iter().map(|s| s.sensor.clone());
        tracked.chain(self.proprioception.iter().cloned()).collect()
    }
}

/// The goal of a task, and how its success is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct DownstreamProtocol {
    /// Name of the metric, such as `tilt_deg`.
    pub metric: String,
    /// Unit of the metric, as shown to people.
    pub unit: String,
    /// The rule of success, in words.
    pub rule: String,
    /// The metric's limit in the rule, if any.
    pub threshold: Option<f64>,
    /// Frames of an attempt.
    pub frames: usize,
    /// Length of a frame, s.
    pub frame_period: f64,
    /// Entries of a task action.
    pub action: Vec<Coordinate>,
    /// Start pose of the object, drawn uniformly.
    pub start: Vec<Coordinate>,
    /// Channels that the metric is computed from.
    pub channels: Vec<String>,
    /// Phases of an attempt: name, start and end in s, for plots.
    pub phases: Vec<(String, f64, f64)>,
}

/// Result of an attempt.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The metric.
    pub value: f64,
    /// The task's own success rule.
    pub success: bool,
    /// Cost that a solver minimises: the metric, with penalties that lead towards success.
    pub cost: f64,
}
