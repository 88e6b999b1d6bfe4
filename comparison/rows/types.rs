//! Types of a comparison's `result.json`.

use serde::Serialize;

use crate::cell::Failure;
use crate::paper::Published;

/// How well one unknown was identified over the runs of a row.
#[derive(Clone, Debug, Serialize, schemars::JsonSchema)]
#[schemars(rename = "IdentifiedUnknown")]
pub struct Identification {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Median distance of the estimate from the truth.
    pub median_abs_error: f64,
    /// Share of 95 % intervals that hold the truth.
    pub coverage95: f64,
    /// Median width of the 95 % intervals.
    pub median_width95: f64,
    /// Median of the expected posterior standard deviations.
    pub median_expected_std: Option<f64>,
}

/// Probability that a run is better than one of the next best method.
#[derive(Clone, Debug, Serialize, schemars::JsonSchema)]
pub struct Improvement {
    /// The next best method.
    pub over: String,
    /// Probability; ties count half.
    pub probability: f64,
    /// Its 95 % bootstrap interval.
    pub interval95: [f64; 2],
}

/// Whether a row is the best of its column, with an interval apart from the others'.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, schemars::JsonSchema)]
pub struct Best {
    /// In the interquartile mean of the metric.
    pub iqm: bool,
    /// In the share of successes.
    pub success: bool,
}

/// Figures of one or more conditions' runs.
#[derive(Clone, Debug, Serialize, schemars::JsonSchema)]
pub struct Summary {
    /// Runs.
    pub n: usize,
    /// Mean of the metric.
    pub mean: f64,
    /// Sample standard deviation.
    pub std: f64,
    /// Median.
    pub median: f64,
    /// Interquartile mean.
    pub iqm: f64,
    /// Bootstrap interval of the mean.
    pub interval95: [f64; 2],
    /// Bootstrap interval of the interquartile mean.
    pub iqm_interval95: [f64; 2],
    /// Share of successes.
    pub success_rate: f64,
    /// Its Wilson interval.
    pub success_interval95: [f64; 2],
    /// Against the next best method; none of the last one, of the oracle, and of one alone.
    pub improvement: Option<Improvement>,
    /// Whether it is the best of its column.
    pub best: Best,
}

/// One row of the table.
#[derive(Clone, Debug, Serialize, schemars::JsonSchema)]
#[schemars(rename = "ComparisonRow")]
pub struct Row {
    /// Task.
    pub task: String,
    /// Condition.
    pub condition: String,
    /// Method.
    pub method: String,
    /// Kind of real world.
    pub world: String,
    /// Engine of the simulator.
    pub backend: String,
    /// Explorer, or `none`.
    pub explorer: String,
    /// Identifier, `none`, or `truth`.
    pub identifier: String,
    /// Solver.
    pub solver: String,
    /// Hash of the settings.
    pub settings: String,
    /// Commit.
    pub commit: String,
    /// The task's metric; lower is better.
    pub metric: String,
    /// The figures.
    #[serde(flatten)]
    pub summary: Summary,
    /// Seeds of the runs.
    pub seeds: Vec<u64>,
    /// Values of the metric, by seed.
    pub values: Vec<f64>,
    /// The paper's value, as a share where it counts successes.
    pub paper: Option<f64>,
    /// Where that value stands in the paper and what it measures.
    pub published: Option<Published>,
    /// What makes the row unequal to others of its task, condition, world and engine.
    pub differs: Vec<String>,
    /// How well the unknowns were identified; empty without identification.
    pub identification: Vec<Identification>,
}

/// A method over all conditions of a task, each condition a stratum.
#[derive(Clone, Debug, Serialize, schemars::JsonSchema)]
#[schemars(rename = "PooledRow")]
pub struct Pooled {
    /// Task.
    pub task: String,
    /// Conditions that are pooled.
    pub conditions: Vec<String>,
    /// Method.
    pub method: String,
    /// Kind of real world.
    pub world: String,
    /// Engine of the simulator.
    pub backend: String,
    /// The task's metric.
    pub metric: String,
    /// The figures.
    #[serde(flatten)]
    pub summary: Summary,
}

/// A method that could not be run at all on a task.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, schemars::JsonSchema)]
pub struct Omitted {
    /// Task.
    pub task: String,
    /// Method.
    pub method: String,
    /// Kind of real world.
    pub world: String,
    /// Engine of the simulator.
    pub backend: String,
    /// Why.
    pub reason: String,
}

/// What is asked of a comparison, and how much of it there is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, schemars::JsonSchema)]
#[schemars(rename = "CellCount")]
pub struct Count {
    /// Cells of the plan.
    pub planned: usize,
    /// Cells that are there.
    pub done: usize,
}

/// `result.json` of a comparison.
#[derive(Clone, Debug, Serialize, schemars::JsonSchema)]
#[schemars(rename = "Comparison")]
pub struct ComparisonResult {
    /// Layout version.
    pub schema: u32,
    /// The paper's table that this is; none for a comparison of one's own.
    pub table: Option<u8>,
    /// Whether searches were cut short.
    pub quick: bool,
    /// How much there is.
    pub cells: Count,
    /// A row a task, condition, engine, world and method.
    pub rows: Vec<Row>,
    /// A row a task, engine, world and method, where a task has several conditions.
    pub pooled: Vec<Pooled>,
    /// Methods that could not be run.
    pub omitted: Vec<Omitted>,
    /// Single runs that failed.
    pub failures: Vec<Failure>,
    /// What made the cells.
    pub versions: serde_json::Value,
}
