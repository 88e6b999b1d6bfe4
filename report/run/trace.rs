//! The data of a run's report, as stored in `trace.json`.

mod episode;
mod stages;

pub use episode::{Episode, ObjectTrack, PlanarPath, Replay, Shape, ShapeKind, Signal};
pub use stages::{
    Downstream, ExpectedStd, Exploration, LearningCurve, Phase, Search, SideView, Trial,
};

use serde::{Deserialize, Serialize};

use asid_results::nullable;
use asid_results::trace::{FileEntry, NamedText, StageCost};
use asid_results::view::View;

/// Version of the layout of `trace.json`.
pub const SCHEMA: u32 = 1;

/// Everything that the report of a run shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RunReport {
    /// Layout version, [`SCHEMA`].
    pub schema: u32,
    /// Stage that was run alone: `explore`, `identify` or `solve`; empty for a whole run. For
    /// `explore` and `solve` the simulator predicts what is shown.
    pub stage: String,
    /// Name of the task.
    pub task: String,
    /// Condition of the task, such as `left`; empty where it has none.
    pub condition: String,
    /// Engine of the simulator that identifies and plans.
    pub backend: String,
    /// Explorer, identifier and solver by name; empty for a stage that was not run.
    pub explorer: String,
    /// See `explorer`.
    pub identifier: String,
    /// See `explorer`.
    pub solver: String,
    /// The seed.
    pub seed: u64,
    /// The source of real episodes.
    pub real_world: RealWorld,
    /// The answer in one sentence; generated from the numbers if empty.
    pub answer: String,
    /// The unknowns, with what became known of them.
    pub parameters: Vec<ParameterReport>,
    /// The real episode, seen from above.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub episode: Option<Episode>,
    /// The machine in 3-D.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view: Option<View>,
    /// Tracked signals of the real episode with their replays.
    pub signals: Vec<Signal>,
    /// Objective of the exploration, and what it gathered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exploration: Option<Exploration>,
    /// Learning curve of the explorer, or of its planning.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub learning: Option<LearningCurve>,
    /// The task itself, attempted once with what was learnt.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub downstream: Option<Downstream>,
    /// Cost of the stages.
    pub costs: Vec<StageCost>,
    /// Time of the whole run, s; NaN if unknown.
    #[serde(deserialize_with = "nullable::scalar")]
    pub wall_s: f64,
    /// Physics steps of the whole run.
    pub physics_steps: u64,
    /// Environment (control) steps of the whole run.
    pub env_steps: u64,
    /// Versions: `asid`, `engine`, `git`, ….
    pub versions: Vec<NamedText>,
    /// The command line that repeats the run.
    pub command: String,
    /// Other files in the run's folder.
    pub files: Vec<FileEntry>,
    /// Remarks for the reader, such as simulations that diverged.
    pub notes: Vec<String>,
}

impl Default for RunReport {
    fn default() -> Self {
        Self {
            schema: SCHEMA,
            stage: String::new(),
            task: String::new(),
            condition: String::new(),
            backend: String::new(),
            explorer: String::new(),
            identifier: String::new(),
            solver: String::new(),
            seed: 0,
            real_world: RealWorld::default(),
            answer: String::new(),
            parameters: Vec::new(),
            episode: None,
            view: None,
            signals: Vec::new(),
            exploration: None,
            learning: None,
            downstream: None,
            costs: Vec::new(),
            wall_s: f64::NAN,
            physics_steps: 0,
            env_steps: 0,
            versions: Vec::new(),
            command: String::new(),
            files: Vec::new(),
            notes: Vec::new(),
        }
    }
}

/// The source of real episodes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RealWorld {
    /// Kind, such as `perturbed`; empty if unknown.
    pub kind: String,
    /// Engine, or another source: `logs`, `robot`.
    pub engine: String,
    /// Model file, if it is not the task's own scene; empty otherwise.
    pub model: String,
    /// Effects that the simulator lacks, as `name@site:parameter=value`.
    pub effects: Vec<String>,
    /// Noise of the readings in words, such as `2 mm, 0.01 rad`; empty if unknown.
    pub noise: String,
}

/// A name, a number and its unit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NamedValue {
    /// The name.
    pub name: String,
    /// The number in `unit`.
    #[serde(deserialize_with = "nullable::scalar")]
    pub value: f64,
    /// The unit; may be empty.
    #[serde(default)]
    pub unit: String,
}

/// An unknown, with what became known of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ParameterReport {
    /// Name, such as `mass_offset`.
    pub name: String,
    /// Unit of every number here; may be empty.
    pub unit: String,
    /// Target in the scene, such as `geom/rod/mass`; may be empty.
    pub target: String,
    /// Whether to draw it on a logarithmic axis.
    pub log_scale: bool,
    /// The hidden truth, if it is known.
    pub truth: Option<f64>,
    /// Point estimate (posterior mean).
    #[serde(deserialize_with = "nullable::scalar")]
    pub estimate: f64,
    /// Posterior standard deviation; NaN if unknown.
    #[serde(deserialize_with = "nullable::scalar")]
    pub std: f64,
    /// Ends of the central 95 % interval; NaN if unknown.
    #[serde(deserialize_with = "nullable::array")]
    pub interval95: [f64; 2],
    /// The prior.
    pub prior: Option<Prior>,
    /// The range that was searched in the end, where the search went on past the prior's.
    pub searched: Option<[f64; 2]>,
    /// Quantiles after each iteration.
    pub narrowing: Vec<Narrowing>,
    /// Samples of the final posterior, at most a few thousand.
    #[serde(deserialize_with = "nullable::list")]
    pub samples: Vec<f64>,
    /// Weights of the samples (any sum); empty for equal ones.
    #[serde(deserialize_with = "nullable::list")]
    pub weights: Vec<f64>,
}

impl Default for ParameterReport {
    fn default() -> Self {
        Self {
            name: String::new(),
            unit: String::new(),
            target: String::new(),
            log_scale: false,
            truth: None,
            estimate: f64::NAN,
            std: f64::NAN,
            interval95: [f64::NAN; 2],
            prior: None,
            searched: None,
            narrowing: Vec::new(),
            samples: Vec::new(),
            weights: Vec::new(),
        }
    }
}

/// The prior of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Prior {
    /// Uniform over the range.
    Uniform {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// Uniform in the logarithm over the range; `low` is positive.
    LogUniform {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// A Gaussian truncated to a range.
    Normal {
        /// Mean before the truncation.
        mean: f64,
        /// Standard deviation before the truncation.
        std: f64,
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// Yes (1) or no (0).
    Binary {
        /// Probability of 1.
        probability: f64,
    },
}

/// Quantiles of a parameter after one iteration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Narrowing {
    /// Iteration; 0 is the prior.
    pub iteration: u32,
    /// The 2.5, 25, 50, 75 and 97.5 % quantiles.
    #[serde(deserialize_with = "nullable::array")]
    pub quantiles: [f64; 5],
}
