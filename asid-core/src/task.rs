//! A task: a scene with unknowns, how to explore it, and its goal.
//!
//! A task describes and runs nothing. Explorers, identifiers and solvers see the same description
//! for every task, which also defines the layout of the arrays that they exchange.

mod protocol;
mod view;

use std::collections::BTreeMap;

use crate::backend::Capabilities;
use crate::difficulty::Difficulty;
use crate::error::Result;
use crate::layout::Layout;
use crate::parameter::Parameter;
use crate::rng::Rng;
use crate::scene::Scene;
use crate::settings::Settings;
pub use protocol::{Condition, Coordinate, DownstreamProtocol, ExplorationProtocol, Outcome};
pub use view::{Outline, TopView, TrackedObject, TrackedPart};

/// Turns exploration actions into commands of the actuators, feed-forward.
pub trait Commander: Send {
    /// Returns to the start of an episode.
    fn reset(&mut self);
    /// Commands of the next control step: `frames_per_step x nu`.
    fn commands(&mut self, action: &[f64], ctrl: &mut [f64]);
}

/// The data of a task: everything about it that is not computation.
#[derive(Clone, Debug)]
pub struct TaskSpec {
    /// Name on the command line.
    pub name: String,
    /// One-line description for `asid list`.
    pub about: String,
    /// The scene.
    pub scene: Scene,
    /// Capabilities that an engine must have.
    pub requires: Capabilities,
    /// The unknowns that are identified by default.
    pub parameters: Vec<Parameter>,
    /// Further unknowns that can be switched on by name.
    pub optional_parameters: Vec<Parameter>,
    /// The named cases of tables.
    pub conditions: Vec<Condition>,
    /// The difficulties of the task; empty if none can be set.
    pub difficulty: Vec<Difficulty>,
    /// Readings of the trackers per second, the first at the start of an episode; `None` for one at
    /// every frame. Each control step ends with a reading, so that a policy always has one.
    pub tracker_rate: Option<f64>,
    /// How it is explored.
    pub exploration: ExplorationProtocol,
    /// Its goal.
    pub downstream: DownstreamProtocol,
    /// Corners (low, then high, m) of the box that contains every tracked and every own position
    /// during exploration.
    pub bounds: [[f64; 3]; 2],
    /// The two tracked parts whose joint is sought, the holding part first; `None` without such
    /// parts.
    pub parts: Option<[TrackedPart; 2]>,
    /// Content of a picture from above.
    pub top_view: TopView,
    /// The tracked things, with the one that the task is about first. Where none is given there is
    /// one: the first signal is its position, the second its orientation.
    pub objects: Vec<TrackedObject>,
    /// Regions of the plane that differ in what they tell, such as patches of a floor. Figures
    /// count where the object goes.
    pub regions: Vec<Outline>,
}

impl TaskSpec {
    /// A task with this name, scene and protocols; all else is empty, and the box of positions
    /// reaches 1.5 m from the origin.
    #[must_use]
    pub fn new(
        [name, about]: [&str; 2],
        scene: Scene,
        exploration: ExplorationProtocol,
        downstream: DownstreamProtocol,
    ) -> Self {
        Self {
            name: name.into(),
            about: about.into(),
            scene,
            requires: Capabilities::empty(),
            parameters: Vec::new(),
            optional_parameters: Vec::new(),
            conditions: Vec::new(),
            difficulty: Vec::new(),
            tracker_rate: None,
            exploration,
            downstream,
            bounds: [[-1.5, -1.5, -0.1], [1.5, 1.5, 1.5]],
            parts: None,
            top_view: TopView::default(),
            objects: Vec::new(),
            regions: Vec::new(),
        }
    }
}

/// A task as the framework sees it: its data, and what only code can express.
///
/// A task implements the first seven methods, and those of the next seven that it needs. The others
/// read its [`TaskSpec`] and are not overridden.
pub trait Task: Send + Sync {
    /// The data of the task.
    fn spec(&self) -> &TaskSpec;
    /// Writes a start pose into positions (`nq`, the first keyframe on entry).
    ///
    /// # Errors
    /// When the layout is not that of the task's scene.
    fn place(&self, layout: &Layout, start: &[f64], qpos: &mut [f64]) -> Result<()>;
    /// The start pose that a reading of the tracked signals shows.
    fn locate(&self, signals: &[f64]) -> Vec<f64>;
    /// Makes a commander of exploration.
    ///
    /// # Errors
    /// When the scene lacks what the commander needs.
    fn commander(&self) -> Result<Box<dyn Commander>>;
    /// Commands of an attempt, `frames x nu`, for a task action and the assumed start pose.
    ///
    /// # Errors
    /// When the scene lacks what the primitive needs.
    fn attempt(&self, start: &[f64], action: &[f64]) -> Result<Vec<f64>>;
    /// The metric over an attempt, one value a frame, from `frames x width` readings.
    fn metric(&self, readings: &[f64]) -> Vec<f64>;
    /// Result of an attempt.
    fn outcome(&self, readings: &[f64]) -> Outcome;

    /// Settings that suit this task better than the algorithm's defaults.
    ///
    /// `section` is `explorer`, `identifier` or `solver`, `algorithm` its name.
    fn settings(&self, _section: &str, _algorithm: &str) -> Settings {
        Settings::new()
    }
    /// The task with some of its difficulties set by name, the others at their defaults; `None`
    /// where nothing can be set.
    ///
    /// # Errors
    /// When a name is unknown, a value out of range, or the task cannot be made with it.
    fn adjusted(&self, _values: &BTreeMap<String, f64>) -> Result<Option<Box<dyn Task>>> {
        Ok(None)
    }
    /// The task in one of its conditions; `None` where the condition only sets true values.
    ///
    /// # Errors
    /// When the condition's task cannot be made.
    fn under(&self, _condition: &str) -> Result<Option<Box<dyn Task>>> {
        Ok(None)
    }
    /// Applies the wear of an episode or attempt in the real world to the truth, which simulators
    /// do not know.
    ///
    /// `truth` holds the values of `parameters`.
    fn wear(&self, _parameters: &[Parameter], _truth: &mut [f64], _rng: &mut Rng) {}
    /// The task's scene with another object of the same kind, for a real set-up whose parts differ
    /// from the model's.
    ///
    /// Names, unknowns and actuators are those of [`TaskSpec::scene`]. `None` where the task has
    /// none.
    ///
    /// # Errors
    /// When that scene cannot be made.
    fn stand_in(&self) -> Result<Option<Scene>> {
        Ok(None)
    }
    /// The task's own reward of a reading of an exploration episode (tracked signals first).
    ///
    /// It is larger where the object is nearer to its goal, in the metric's unit. `None` where the
    /// task has no goal for its object during exploration.
    fn goal_reward(&self, _reading: &[f64]) -> Option<f64> {
        None
    }
    /// Content of a picture from the side at the end of an attempt: shapes in the world, from one
    /// row of readings.
    fn side_view(&self, _readings: &[f64]) -> Vec<Outline> {
        Vec::new()
    }

    /// [`TaskSpec::name`].
    fn name(&self) -> &str {
        &self.spec().name
    }
    /// [`TaskSpec::scene`].
    fn scene(&self) -> &Scene {
        &self.spec().scene
    }
    /// [`TaskSpec::parameters`].
    fn parameters(&self) -> Vec<Parameter> {
        self.spec().parameters.clone()
    }
    /// [`TaskSpec::optional_parameters`].
    fn optional_parameters(&self) -> Vec<Parameter> {
        self.spec().optional_parameters.clone()
    }
    /// [`TaskSpec::conditions`].
    fn conditions(&self) -> Vec<Condition> {
        self.spec().conditions.clone()
    }
    /// [`TaskSpec::difficulty`].
    fn difficulty(&self) -> Vec<Difficulty> {
        self.spec().difficulty.clone()
    }
    /// [`TaskSpec::exploration`].
    fn exploration(&self) -> &ExplorationProtocol {
        &self.spec().exploration
    }
    /// [`TaskSpec::downstream`].
    fn downstream(&self) -> &DownstreamProtocol {
        &self.spec().downstream
    }
    /// [`TaskSpec::objects`].
    fn objects(&self) -> Vec<TrackedObject> {
        let spec = self.spec();
        if !spec.objects.is_empty() {
            return spec.objects.clone();
        }
        let mut sensors = spec.exploration.signals.iter().map(|s| s.sensor.clone());
        sensors
            .next()
            .map(|position| TrackedObject {
                outline: spec.top_view.object.clone(),
                position,
                orientation: sensors.next(),
                contact: spec.exploration.contact.clone(),
                mass: None,
            })
            .into_iter()
            .collect()
    }
}
