//! A task: a scene with unknowns, how to explore it, and what to achieve in it.
//!
//! A task describes; it runs nothing. Explorers, identifiers and solvers see the
//! same description, whatever the task, and the arrays they pass around are laid
//! out by it.

use std::collections::BTreeMap;

use crate::backend::Capabilities;
use crate::difficulty::Difficulty;
use crate::error::Result;
use crate::layout::Layout;
use crate::parameter::Parameter;
use crate::rng::Rng;
use crate::scene::Scene;
use crate::settings::Settings;
use crate::signal::Signal;
use crate::target::Target;

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

/// A named case that a task is tried in, such as `left`: true values, or a goal.
#[derive(Clone, Debug, PartialEq)]
pub struct Condition {
    /// Name in tables.
    pub name: String,
    /// Smallest and largest true value by parameter name, equal where the value is fixed;
    /// they may lie outside the prior. Of a parameter without an entry the whole prior is drawn from.
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

    /// A condition whose true values are drawn from ranges, and from the prior where none is given.
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
    /// What a tracker reads of the object: the likelihood's data.
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

    /// Names of all sensors of a reading's row: tracked signals, then proprioception.
    #[must_use]
    pub fn channels(&self) -> Vec<String> {
        let tracked = self.signals.iter().map(|s| s.sensor.clone());
        tracked.chain(self.proprioception.iter().cloned()).collect()
    }
}

/// What is to be achieved, and how it is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct DownstreamProtocol {
    /// Name of the metric, such as `tilt_deg`.
    pub metric: String,
    /// Unit of the metric, as shown to people.
    pub unit: String,
    /// The rule of success, in words.
    pub rule: String,
    /// The metric's limit in the rule, where it has one.
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

/// What came of an attempt.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The metric.
    pub value: f64,
    /// The task's own success rule.
    pub success: bool,
    /// What a solver minimises: the metric, with penalties that lead towards success.
    pub cost: f64,
}

/// A shape seen from above or from the side, for pictures; m.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outline {
    /// What it is.
    pub label: String,
    /// Corners, in order.
    pub corners: Vec<[f64; 2]>,
}

/// What a picture of the scene from above shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TopView {
    /// The object in its own frame.
    pub object: Outline,
    /// Things that stand still, in the world frame.
    pub fixtures: Vec<Outline>,
    /// Corners of the picture: low then high.
    pub bounds: [[f64; 2]; 2],
}

/// A part whose pose is tracked.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackedPart {
    /// Sensor of its position.
    pub position: String,
    /// Sensor of its orientation.
    pub orientation: String,
}

/// A thing that is tracked, as pictures and figures know it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrackedObject {
    /// What it is, and its shape in its own frame.
    pub outline: Outline,
    /// Sensor of its position, of which the first two entries are its place in the plane, m.
    pub position: String,
    /// Sensor of its orientation, where that is tracked.
    pub orientation: Option<String>,
    /// Pairs of bodies whose contact counts as the machine touching it.
    pub contact: Vec<[String; 2]>,
    /// Its mass in the scene, where one number sets it.
    pub mass: Option<Target>,
}

/// Turns exploration actions into commands of the actuators, feed-forward.
pub trait Commander: Send {
    /// Back to the start of an episode.
    fn reset(&mut self);
    /// Commands of the next control step: `frames_per_step x nu`.
    fn commands(&mut self, action: &[f64], ctrl: &mut [f64]);
}

/// A task as the framework sees it.
pub trait Task: Send + Sync {
    /// Name on the command line.
    fn name(&self) -> &str;
    /// One line for `asid list`.
    fn about(&self) -> &str;
    /// The scene.
    fn scene(&self) -> &Scene;
    /// What an engine must be able to do.
    fn requires(&self) -> Capabilities;
    /// The unknowns that are identified by default.
    fn parameters(&self) -> Vec<Parameter>;
    /// Further unknowns that can be switched on by name.
    fn optional_parameters(&self) -> Vec<Parameter> {
        Vec::new()
    }
    /// Settings of an algorithm that suit this task better than the algorithm's defaults:
    /// `section` is `explorer`, `identifier` or `solver`, `algorithm` its name.
    fn settings(&self, _section: &str, _algorithm: &str) -> Settings {
        Settings::new()
    }
    /// The numbers that say how hard the task is; none where it is as it is.
    fn difficulty(&self) -> Vec<Difficulty> {
        Vec::new()
    }
    /// The task with some of its difficulties set, by name, the others at their defaults; `None`
    /// where nothing can be set.
    ///
    /// # Errors
    /// When a name is unknown, a value out of range, or the task cannot be made with it.
    fn adjusted(&self, _values: &BTreeMap<String, f64>) -> Result<Option<Box<dyn Task>>> {
        Ok(None)
    }
    /// Readings of the trackers a second, the first at the start of an episode; `None` for one at
    /// every frame. There is one at the end of each control step, so that a policy always has it.
    fn tracker_rate(&self) -> Option<f64> {
        None
    }
    /// The named cases of tables.
    fn conditions(&self) -> Vec<Condition>;
    /// The task as it is set in one of its conditions; `None` where the condition is of
    /// true values alone.
    ///
    /// # Errors
    /// When the condition's task cannot be made.
    fn under(&self, _condition: &str) -> Result<Option<Box<dyn Task>>> {
        Ok(None)
    }
    /// What an episode or an attempt in the real world does to the truth, of which simulators
    /// know nothing: `truth` holds the values of `parameters`.
    fn wear(&self, _parameters: &[Parameter], _truth: &mut [f64], _rng: &mut Rng) {}
    /// The task's scene with another object of the same kind: what stands for a real set-up whose parts
    /// are not those of the model. Names, unknowns and actuators are those of [`Task::scene`]. `None`
    /// where the task has none.
    ///
    /// # Errors
    /// When that scene cannot be made.
    fn stand_in(&self) -> Result<Option<Scene>> {
        Ok(None)
    }
    /// How it is explored.
    fn exploration(&self) -> &ExplorationProtocol;
    /// What is to be achieved.
    fn downstream(&self) -> &DownstreamProtocol;
    /// Writes a start pose into positions (`nq`, the first keyframe on entry).
    ///
    /// # Errors
    /// When the layout is not that of the task's scene.
    fn place(&self, layout: &Layout, start: &[f64], qpos: &mut [f64]) -> Result<()>;
    /// The start pose that a reading of the tracked signals shows.
    fn locate(&self, signals: &[f64]) -> Vec<f64>;
    /// A fresh commander of exploration.
    ///
    /// # Errors
    /// When the scene lacks what the commander needs.
    fn commander(&self) -> Result<Box<dyn Commander>>;
    /// Commands of an attempt, `frames x nu`, for a task action and the start pose believed in.
    ///
    /// # Errors
    /// When the scene lacks what the primitive needs.
    fn attempt(&self, start: &[f64], action: &[f64]) -> Result<Vec<f64>>;
    /// The metric over an attempt, one value a frame, from `frames x width` readings.
    fn metric(&self, readings: &[f64]) -> Vec<f64>;
    /// What came of an attempt.
    fn outcome(&self, readings: &[f64]) -> Outcome;
    /// Corners of the box that every tracked and every own position stays in while the task is
    /// explored, low then high, m.
    fn bounds(&self) -> [[f64; 3]; 2] {
        [[-1.5, -1.5, -0.1], [1.5, 1.5, 1.5]]
    }
    /// What a reading of an exploration episode (tracked signals first) is worth to the task itself:
    /// larger where the object is nearer to its goal, in the metric's unit; `None` where the task has
    /// no goal for its object while it is explored.
    fn goal_reward(&self, _reading: &[f64]) -> Option<f64> {
        None
    }
    /// The two tracked parts whose joint is in question, the one that holds first; `None`
    /// where there are no such parts.
    fn parts(&self) -> Option<[TrackedPart; 2]> {
        None
    }
    /// What a picture from above shows.
    fn top_view(&self) -> TopView {
        TopView::default()
    }
    /// The things that are tracked, the one that the task is about first. Unless a task says
    /// otherwise it is one thing: the first signal is its position, the second its orientation.
    fn objects(&self) -> Vec<TrackedObject> {
        let protocol = self.exploration();
        let mut sensors = protocol.signals.iter().map(|s| s.sensor.clone());
        sensors
            .next()
            .map(|position| TrackedObject {
                outline: self.top_view().object,
                position,
                orientation: sensors.next(),
                contact: protocol.contact.clone(),
                mass: None,
            })
            .into_iter()
            .collect()
    }
    /// Parts of the plane that differ in what they tell, such as patches of a floor: figures count
    /// where the object goes.
    fn regions(&self) -> Vec<Outline> {
        Vec::new()
    }
    /// What a picture from the side shows at the end of an attempt: shapes in the
    /// world, from one row of readings.
    fn side_view(&self, _readings: &[f64]) -> Vec<Outline> {
        Vec::new()
    }
}
