//! The data of a run's report, as stored in `trace.json`.

use serde::{Deserialize, Serialize};

use super::nullable;

/// Version of the layout of `trace.json`.
pub const SCHEMA: u32 = 1;

/// Everything that the report of a run shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RunReport {
    /// Layout version, [`SCHEMA`].
    pub schema: u32,
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
    /// What answered as the real world.
    pub real_world: RealWorld,
    /// The answer in one sentence; made from the numbers where it is empty.
    pub answer: String,
    /// The unknowns and what became known of them.
    pub parameters: Vec<ParameterReport>,
    /// The real episode, seen from above.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub episode: Option<Episode>,
    /// Tracked signals of the real episode with their replays.
    pub signals: Vec<Signal>,
    /// What the exploration was for and what it gathered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exploration: Option<Exploration>,
    /// How the explorer learnt or planned.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub learning: Option<LearningCurve>,
    /// The task itself, done once with what was learnt.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub downstream: Option<Downstream>,
    /// What the stages took.
    pub costs: Vec<StageCost>,
    /// Time of the whole run in s; NaN where it is not known.
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
    /// What else lies in the run's folder.
    pub files: Vec<FileEntry>,
    /// Remarks for the reader, such as simulations that diverged.
    pub notes: Vec<String>,
}

impl Default for RunReport {
    fn default() -> Self {
        Self {
            schema: SCHEMA,
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

/// What answered as the real world.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RealWorld {
    /// Engine, or what else it was: `logs`, `robot`.
    pub engine: String,
    /// Model file, where it is not the task's own scene; empty otherwise.
    pub model: String,
    /// Effects that the simulator lacks, as `name@site:parameter=value`.
    pub effects: Vec<String>,
    /// Noise of the readings in words, such as `2 mm, 0.01 rad`; empty where it is not known.
    pub noise: String,
}

/// A name and a text.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NamedText {
    /// The name.
    pub name: String,
    /// The text.
    pub value: String,
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

/// An unknown and what became known of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ParameterReport {
    /// Name, such as `mass_offset`.
    pub name: String,
    /// Unit of every number here; may be empty.
    pub unit: String,
    /// Where it acts in the scene, such as `geom/rod/mass`; may be empty.
    pub target: String,
    /// Draw it on a logarithmic axis.
    pub log_scale: bool,
    /// The hidden truth, where there is one to be known.
    pub truth: Option<f64>,
    /// Point estimate (posterior mean).
    #[serde(deserialize_with = "nullable::scalar")]
    pub estimate: f64,
    /// Posterior standard deviation; NaN where it is not known.
    #[serde(deserialize_with = "nullable::scalar")]
    pub std: f64,
    /// Ends of the central 95 % interval; NaN where they are not known.
    #[serde(deserialize_with = "nullable::array")]
    pub interval95: [f64; 2],
    /// What was believed before.
    pub prior: Option<Prior>,
    /// The distribution from iteration to iteration.
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
            narrowing: Vec::new(),
            samples: Vec::new(),
            weights: Vec::new(),
        }
    }
}

/// What was believed of a parameter before.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Prior {
    /// Every value in the range alike.
    Uniform {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// Every ratio in the range alike; `low` is positive.
    LogUniform {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// A Gaussian, cut off at a range.
    Normal {
        /// Mean before the cut.
        mean: f64,
        /// Standard deviation before the cut.
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

/// The real episode in the horizontal plane of the world, in m.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Episode {
    /// Objects that move.
    pub objects: Vec<ObjectTrack>,
    /// The end effector's path.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end_effector: Option<Path>,
    /// The workspace as `[x_low, x_high, y_low, y_high]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub workspace: Option<[f64; 4]>,
    /// What stands still: table, walls, goal, ledge.
    pub shapes: Vec<Shape>,
}

/// An object that moves in the plane.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ObjectTrack {
    /// Name, such as `rod`.
    pub name: String,
    /// Its outline in its own frame, a polygon in m.
    #[serde(deserialize_with = "nullable::rows")]
    pub outline: Vec<[f64; 2]>,
    /// Times of the poses in s.
    #[serde(deserialize_with = "nullable::list")]
    pub time: Vec<f64>,
    /// Pose at each time: x and y in m, yaw in rad.
    #[serde(deserialize_with = "nullable::rows")]
    pub poses: Vec<[f64; 3]>,
}

/// A path in the plane.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Path {
    /// Times in s; a dot is drawn at each, so control steps serve better than physics steps.
    #[serde(deserialize_with = "nullable::list")]
    pub time: Vec<f64>,
    /// Position at each time in m.
    #[serde(deserialize_with = "nullable::rows")]
    pub position: Vec<[f64; 2]>,
}

/// What a shape is, which decides its colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShapeKind {
    /// Table, wall, ledge: it only stands there.
    #[default]
    Fixed,
    /// Where something should go.
    Goal,
    /// The object of the task.
    Object,
    /// A part of the object to be told apart, such as its movable mass.
    Part,
    /// The robot.
    Robot,
}

/// A polygon, or a circle where it has a radius.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Shape {
    /// Text for the legend; may be empty.
    pub label: String,
    /// What it is.
    pub kind: ShapeKind,
    /// Corners of the polygon in m, or the circle's centre.
    #[serde(deserialize_with = "nullable::rows")]
    pub points: Vec<[f64; 2]>,
    /// Radius of the circle in m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
}

/// A tracked signal of the real episode.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Signal {
    /// Name as in the log, such as `rod_pos.0`.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// Standard deviation of a reading's noise, where it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_std: Option<f64>,
    /// Times of the readings in s.
    #[serde(deserialize_with = "nullable::list")]
    pub time: Vec<f64>,
    /// Readings; NaN where one is missing.
    #[serde(deserialize_with = "nullable::list")]
    pub readings: Vec<f64>,
    /// The same commands replayed with the prior's mean.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub before: Option<Replay>,
    /// The same commands replayed with the estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub after: Option<Replay>,
}

/// A replayed trajectory of a signal.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Replay {
    /// Times in s, increasing; need not be those of the readings.
    #[serde(deserialize_with = "nullable::list")]
    pub time: Vec<f64>,
    /// Value at each time.
    #[serde(deserialize_with = "nullable::list")]
    pub value: Vec<f64>,
    /// `[low, high]` of 95 % of the posterior's replays at each time; may be empty.
    #[serde(deserialize_with = "nullable::rows")]
    pub band95: Vec<[f64; 2]>,
}

/// What the exploration was for and what the real episode gathered.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Exploration {
    /// The objective by name: `trace`, `a-optimal`, `d-optimal`.
    pub objective: String,
    /// `one-step` or `trajectory`: what the sensitivities count.
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

/// How the explorer's return rose.
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

/// The task itself, done once in the real world.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Downstream {
    /// Metric by name, such as `tilt_deg`.
    pub metric: String,
    /// What it is called in a sentence, such as `tilt`.
    pub label: String,
    /// Unit of the metric.
    pub unit: String,
    /// Its value at the end.
    #[serde(deserialize_with = "nullable::scalar")]
    pub value: f64,
    /// Whether the task's rule of success held.
    pub success: bool,
    /// The rule in words, such as `below 5° and still on the ledge`.
    pub rule: String,
    /// The metric's limit in `unit`, where the rule has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold: Option<f64>,
    /// Times in s.
    #[serde(deserialize_with = "nullable::list")]
    pub time: Vec<f64>,
    /// The metric (or what it is read from) at each time, in `unit`.
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

/// A stretch of the task's motion.
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
    /// What the cost is, such as `expected tilt`.
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
    /// Height below which there is nothing to see, such as the table's top.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub floor: Option<f64>,
    /// What is seen, back to front.
    pub shapes: Vec<Shape>,
}

/// What a stage took.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageCost {
    /// Stage, such as `explore`.
    pub stage: String,
    /// Time in s.
    #[serde(deserialize_with = "nullable::scalar")]
    pub wall_s: f64,
    /// Physics steps.
    pub physics_steps: u64,
}

/// A file of the run's folder.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FileEntry {
    /// Name relative to the folder.
    pub name: String,
    /// What it holds.
    pub what: String,
}
