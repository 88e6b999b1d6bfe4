//! Common code of the tasks with a ball: a Panda whose fingers are a paddle, a ball that rolls
//! until the floor's rolling friction stops it, and a goal.
//!
//! Each task of this family defines its own part in a [`Spec`].
//!
//! Source: ASID (Memmel et al., ICLR 2024), section 5.1 and its appendix.

mod friction;
mod metric;
mod outline;
mod spec;
mod strike;

use std::collections::BTreeMap;

use asid_core::registry::Settings;
use asid_core::task::{
    Commander, Coordinate, DownstreamProtocol, ExplorationProtocol, Outcome, Outline, Task,
    TaskSpec, TopView, TrackedObject,
};
use asid_core::{Capabilities, Difficulty, Layout, Levels, Result, Target};

use crate::panda;
use crate::steering::{self, Steering};
use crate::{circle, difficulty};

pub use friction::{conditions, rolling_friction};
pub use outline::{rectangle, walls};
pub use spec::{Area, Number, Setting, Spec};

/// Radius of the ball, m.
const BALL_RADIUS: f64 = 0.03;

/// Finger command, m from the middle: the pads meet the ball 30 degrees left and right.
const FINGERS: f64 = 0.012;

/// Workspace of the paddle, at the height of the ball's middle; a ball fits between it and each
/// wall.
pub const STEERING: Steering = Steering {
    speed: HAND_SPEED,
    x: [0.30, 0.70],
    y: [-0.46, 0.26],
    reach: 0.74,
    fingers: FINGERS,
};

/// Speed of the hand unless the difficulty sets another, m/s.
const HAND_SPEED: f64 = 0.4;

/// Radius of the goal unless the difficulty sets another, m.
const GOAL_RADIUS: f64 = 0.05;

/// Time constant of the contact of ball and paddle unless the difficulty sets another, s.
const CONTACT_TIME: f64 = 0.03;

/// A task of the family.
pub struct Sphere {
    task: TaskSpec,
    spec: Spec,
    goal: metric::Goal,
    steering: Steering,
    home: Vec<f64>,
}

impl Sphere {
    /// The task of a specification, at its default difficulty.
    ///
    /// # Errors
    /// When the scene cannot be read or lacks the arm or a keyframe.
    pub fn new(spec: Spec) -> Result<Self> {
        Self::at(spec, Levels::new(difficulties()))
    }

    /// The task at the given difficulty levels.
    fn at(spec: Spec, levels: Levels) -> Result<Self> {
        let (scene, home) = panda::scene(spec.name, spec.xml)?;
        let radius = levels.get("goal_radius")?;
        let contact = format!("{:?} 1", levels.get("contact_time")?);
        let scene = scene
            .with_attribute("geom", "goal", "size", &format!("{radius:?} 0.0005"))?
            .with_attribute("geom", "ball", "solref", &contact)?;
        let sensors: Vec<String> = balls(&spec).map(position_of).collect();
        let sensors: Vec<&str> = sensors.iter().map(String::as_str).collect();
        let exploration = ExplorationProtocol {
            horizon: spec.horizon,
            frames_per_step: steering::FRAMES,
            frame_period: steering::FRAME_PERIOD,
            action: steering::action(),
            start: place_in(spec.explored_from),
            signals: difficulty::signals(&levels, &sensors)?,
            proprioception: panda::proprioception(),
            contact: paddle_on("ball"),
        };
        let downstream = DownstreamProtocol {
            metric: "goal_distance_m".into(),
            unit: "m".into(),
            rule: format!("the ball at rest within {radius} m of the goal's middle"),
            threshold: Some(radius),
            frames: (spec.seconds / strike::FRAME_PERIOD).round() as usize,
            frame_period: strike::FRAME_PERIOD,
            action: vec![
                Coordinate::new("speed", "m/s", spec.speed),
                Coordinate::new("aim", "rad", [-0.1, 0.1]),
            ],
            start: place_in(spec.struck_from),
            channels: vec!["ball_pos".into()],
            phases: strike::phases(spec.seconds),
        };
        let goal = metric::Goal {
            at: spec.goal,
            radius,
        };
        let task = TaskSpec {
            requires: Capabilities::ARTICULATION
                | Capabilities::CONTACT
                | Capabilities::ACTUATORS
                | Capabilities::FREE_BODIES
                | Capabilities::ROLLING_FRICTION,
            parameters: spec.parameters.clone(),
            optional_parameters: spec.optional.clone(),
            conditions: spec.conditions.clone(),
            difficulty: levels.all().to_vec(),
            tracker_rate: Some(difficulty::rate(&levels)?),
            objects: objects(&spec),
            regions: spec.regions.clone(),
            top_view: top_view(&spec, &goal),
            ..TaskSpec::new([spec.name, spec.about], scene, exploration, downstream)
        };
        Ok(Self {
            task,
            goal,
            steering: Steering {
                speed: levels.get("hand_speed")?,
                ..spec.steering
            },
            spec,
            home,
        })
    }
}

/// The balls, as tracked objects.
fn objects(spec: &Spec) -> Vec<TrackedObject> {
    balls(spec)
        .map(|ball| TrackedObject {
            outline: Outline {
                label: ball.replace('_', " "),
                corners: circle([0.0, 0.0], BALL_RADIUS),
            },
            position: position_of(ball),
            orientation: None,
            contact: paddle_on(ball),
            mass: format!("geom/{ball}/mass").parse().ok(),
        })
        .collect()
}

/// Top view of ball, goal and fixtures.
fn top_view(spec: &Spec, goal: &metric::Goal) -> TopView {
    let mut fixtures = spec.fixtures.clone();
    fixtures.push(Outline {
        label: "goal".into(),
        corners: circle(goal.at, goal.radius),
    });
    TopView {
        object: Outline {
            label: "ball".into(),
            corners: circle([0.0, 0.0], BALL_RADIUS),
        },
        fixtures,
        bounds: [[0.15, -0.62], [0.85, 0.42]],
    }
}

/// Difficulties of the task.
fn difficulties() -> Vec<Difficulty> {
    let goal = "radius of the goal";
    let contact = "time constant of the contact of ball and paddle; a smaller one is stiffer";
    let mut all = vec![
        Difficulty::new("goal_radius", "m", GOAL_RADIUS, [0.005, 0.1], goal).published(0.05),
        difficulty::hand_speed(HAND_SPEED),
        Difficulty::new("contact_time", "s", CONTACT_TIME, [0.01, 0.06], contact),
    ];
    all.extend(difficulty::tracker());
    all
}

/// Bodies of all balls; the struck one comes first.
fn balls(spec: &Spec) -> impl Iterator<Item = &'static str> {
    std::iter::once("ball").chain(spec.distractors.iter().copied())
}

/// Name of the sensor of a ball's position.
fn position_of(ball: &str) -> String {
    format!("{ball}_pos")
}

/// Pairs of bodies that touch when the paddle touches a ball.
fn paddle_on(ball: &str) -> Vec<[String; 2]> {
    ["finger_left", "finger_right"]
        .map(|finger| [finger.into(), ball.into()])
        .into()
}

/// Coordinates of a position in an area.
fn place_in([x, y]: Area) -> Vec<Coordinate> {
    vec![Coordinate::new("x", "m", x), Coordinate::new("y", "m", y)]
}

impl Task for Sphere {
    fn spec(&self) -> &TaskSpec {
        &self.task
    }

    fn settings(&self, section: &str, algorithm: &str) -> Settings {
        let all = self.spec.settings.iter();
        all.filter(|s| (s.0, s.1) == (section, algorithm))
            .map(|&(_, _, key, value)| {
                let value = match value {
                    Number::Whole(n) => n.into(),
                    Number::Real(x) => x.into(),
                };
                (key.to_owned(), value)
            })
            .collect()
    }

    fn adjusted(&self, values: &BTreeMap<String, f64>) -> Result<Option<Box<dyn Task>>> {
        let levels = Levels::new(difficulties()).with(values)?;
        Ok(Some(Box::new(Self::at(self.spec.clone(), levels)?)))
    }

    fn place(&self, layout: &Layout, start: &[f64], qpos: &mut [f64]) -> Result<()> {
        let at = layout.joint("ball_free")?.qpos;
        qpos[at..at + 7].copy_from_slice(&[start[0], start[1], BALL_RADIUS, 1.0, 0.0, 0.0, 0.0]);
        Ok(())
    }

    fn locate(&self, signals: &[f64]) -> Vec<f64> {
        signals[..2].to_vec()
    }

    fn commander(&self) -> Result<Box<dyn Commander>> {
        self.steering.commander(&self.task.scene, &self.home)
    }

    fn attempt(&self, start: &[f64], action: &[f64]) -> Result<Vec<f64>> {
        let [x, y] = self.spec.struck_from.map(|[low, high]| 0.5 * (low + high));
        let goal = self.spec.goal;
        let strike = strike::Strike {
            ball: [start[0], start[1]],
            goal,
            distance: (goal[0] - x).hypot(goal[1] - y),
            speed: action[0],
            aim: action[1],
        };
        strike::commands(
            &self.task.scene,
            &self.home,
            &strike,
            self.task.downstream.frames,
        )
    }

    fn metric(&self, readings: &[f64]) -> Vec<f64> {
        readings
            .chunks_exact(metric::WIDTH)
            .map(|row| metric::distance(row, self.spec.goal))
            .collect()
    }

    fn outcome(&self, readings: &[f64]) -> Outcome {
        metric::outcome(readings, self.goal, self.spec.line)
    }

    fn goal_reward(&self, reading: &[f64]) -> Option<f64> {
        Some(-metric::distance(reading, self.spec.goal))
    }
}

/// Target of a built-in parameter.
#[must_use]
pub fn target(target: &str) -> Vec<Target> {
    target.parse().into_iter().collect()
}
