//! What the tasks with a ball have in common: a Panda whose fingers are a paddle, a ball that
//! rolls until the floor's rolling friction stops it, and a goal.
//!
//! A task of this family says what is its own in a [`Spec`].
//!
//! Source: ASID (Memmel et al., ICLR 2024), section 5.1 and its appendix.

mod friction;
mod metric;
mod strike;

use asid_core::parameter::Parameter;
use asid_core::registry::Settings;
use asid_core::signal::Signal;
use asid_core::task::{
    Commander, Condition, Coordinate, DownstreamProtocol, ExplorationProtocol, Outcome, Outline,
    Task, TopView,
};
use asid_core::{Capabilities, Layout, Result, Scene, Target};

use crate::panda;
use crate::steering::{self, Steering};

pub use friction::{conditions, rolling_friction};

/// Radius of the ball, m.
const BALL_RADIUS: f64 = 0.03;

/// Command of each finger, m from the middle: the pads meet the ball 30 degrees left and right.
const FINGERS: f64 = 0.012;

/// The paddle moves at the height of the ball's middle; a ball fits between it and each wall.
pub const STEERING: Steering = Steering {
    max_step: 0.04, // 0.4 m/s
    x: [0.30, 0.70],
    y: [-0.46, 0.26],
    reach: 0.74,
    fingers: FINGERS,
};

/// Noise of the tracker of the ball, m.
const NOISE: f64 = 0.002;

/// A place in the plane: ranges of x and y, m.
pub type Area = [[f64; 2]; 2];

/// What is a task's own.
pub struct Spec {
    /// Name on the command line.
    pub name: &'static str,
    /// One line for `asid list`.
    pub about: &'static str,
    /// The scene's document; it includes `../panda.xml`.
    pub xml: &'static str,
    /// The unknowns.
    pub parameters: Vec<Parameter>,
    /// Unknowns that can be switched on.
    pub optional: Vec<Parameter>,
    /// Named truths.
    pub conditions: Vec<Condition>,
    /// Where the hand may go.
    pub steering: Steering,
    /// Control steps of exploration.
    pub horizon: usize,
    /// Where the ball lies when exploration begins.
    pub explored_from: Area,
    /// Where the ball lies when it is struck.
    pub struck_from: Area,
    /// Where it is to come to rest, m.
    pub goal: [f64; 2],
    /// A y behind the goal past which a ball has been struck too hard, m; see the metric.
    pub line: Option<f64>,
    /// Range of the paddle's speed, m/s.
    pub speed: [f64; 2],
    /// Length of an attempt, s.
    pub seconds: f64,
    /// Things that stand still, for pictures.
    pub fixtures: Vec<Outline>,
    /// Numbers of algorithms that suit the task better than their defaults.
    pub settings: &'static [Setting],
}

/// A number among an algorithm's settings.
pub struct Setting {
    /// `explorer`, `identifier` or `solver`.
    pub section: &'static str,
    /// Name of the algorithm.
    pub algorithm: &'static str,
    /// Name of the setting.
    pub key: &'static str,
    /// Its value.
    pub value: Number,
}

/// Value of a setting.
#[derive(Clone, Copy, Debug)]
pub enum Number {
    /// Of something that is counted.
    Whole(i64),
    /// Of something that is measured.
    Real(f64),
}

/// A task of the family.
pub struct Sphere {
    spec: Spec,
    scene: Scene,
    home: Vec<f64>,
    exploration: ExplorationProtocol,
    downstream: DownstreamProtocol,
}

impl Sphere {
    /// The task of a specification.
    ///
    /// # Errors
    /// When the scene cannot be read or lacks the arm or a keyframe.
    pub fn new(spec: Spec) -> Result<Self> {
        let (scene, home) = panda::scene(spec.name, spec.xml)?;
        let exploration = ExplorationProtocol {
            horizon: spec.horizon,
            frames_per_step: steering::FRAMES,
            frame_period: steering::FRAME_PERIOD,
            action: steering::action(),
            start: place_in(spec.explored_from),
            signals: vec![Signal {
                sensor: "ball_pos".into(),
                noise: NOISE,
            }],
            proprioception: panda::proprioception(),
            contact: ["finger_left", "finger_right"]
                .map(|f| [f.into(), "ball".into()])
                .into(),
        };
        let downstream = DownstreamProtocol {
            metric: "goal_distance_m".into(),
            unit: "m".into(),
            rule: "the ball at rest within 0.05 m of the goal's middle".into(),
            threshold: Some(metric::GOAL_RADIUS),
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
        Ok(Self {
            spec,
            scene,
            home,
            exploration,
            downstream,
        })
    }
}

/// Coordinates of a place in an area.
fn place_in([x, y]: Area) -> Vec<Coordinate> {
    vec![Coordinate::new("x", "m", x), Coordinate::new("y", "m", y)]
}

impl Task for Sphere {
    fn name(&self) -> &str {
        self.spec.name
    }

    fn about(&self) -> &str {
        self.spec.about
    }

    fn scene(&self) -> &Scene {
        &self.scene
    }

    fn requires(&self) -> Capabilities {
        Capabilities::ARTICULATION
            | Capabilities::CONTACT
            | Capabilities::ACTUATORS
            | Capabilities::FREE_BODIES
            | Capabilities::ROLLING_FRICTION
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.spec.parameters.clone()
    }

    fn optional_parameters(&self) -> Vec<Parameter> {
        self.spec.optional.clone()
    }

    fn settings(&self, section: &str, algorithm: &str) -> Settings {
        let all = self.spec.settings.iter();
        all.filter(|s| s.section == section && s.algorithm == algorithm)
            .map(|s| {
                let value = match s.value {
                    Number::Whole(n) => n.into(),
                    Number::Real(x) => x.into(),
                };
                (s.key.to_owned(), value)
            })
            .collect()
    }

    fn conditions(&self) -> Vec<Condition> {
        self.spec.conditions.clone()
    }

    fn exploration(&self) -> &ExplorationProtocol {
        &self.exploration
    }

    fn downstream(&self) -> &DownstreamProtocol {
        &self.downstream
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
        self.spec.steering.commander(&self.scene, &self.home)
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
        strike::commands(&self.scene, &self.home, &strike, self.downstream.frames)
    }

    fn metric(&self, readings: &[f64]) -> Vec<f64> {
        readings
            .chunks_exact(metric::WIDTH)
            .map(|row| metric::distance(row, self.spec.goal))
            .collect()
    }

    fn outcome(&self, readings: &[f64]) -> Outcome {
        metric::outcome(readings, self.spec.goal, self.spec.line)
    }

    fn goal_reward(&self, reading: &[f64]) -> Option<f64> {
        Some(-metric::distance(reading, self.spec.goal))
    }

    fn top_view(&self) -> TopView {
        let mut fixtures = self.spec.fixtures.clone();
        fixtures.push(Outline {
            label: "goal".into(),
            corners: circle(self.spec.goal, metric::GOAL_RADIUS),
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
}

/// A circle as a polygon.
fn circle([x, y]: [f64; 2], radius: f64) -> Vec<[f64; 2]> {
    (0..24)
        .map(|k| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 24.0).sin_cos();
            [x + radius * cos, y + radius * sin]
        })
        .collect()
}

/// An axis-aligned rectangle between two corners.
#[must_use]
pub fn rectangle(label: &str, [x, y]: Area) -> Outline {
    Outline {
        label: label.into(),
        corners: vec![[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]],
    }
}

/// The four walls of the arena.
#[must_use]
pub fn walls() -> Vec<Outline> {
    vec![
        rectangle("wall", [[0.18, 0.20], [-0.58, 0.38]]),
        rectangle("wall", [[0.80, 0.82], [-0.58, 0.38]]),
        rectangle("wall", [[0.20, 0.80], [-0.58, -0.56]]),
        rectangle("wall", [[0.20, 0.80], [0.36, 0.38]]),
    ]
}

/// The target of a parameter that is built in.
#[must_use]
pub fn target(target: &str) -> Vec<Target> {
    target.parse().into_iter().collect()
}
