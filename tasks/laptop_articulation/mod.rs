//! Laptop articulation: find whether a laptop's lid turns, and about which axis, by pushing it;
//! then close it to a set angle.
//!
//! Base and lid are plates of 0.30 x 0.20 x 0.01 m. `articulated` says whether the hinge yields to
//! the hand or holds. `hinge_offset` is the height of its axis above the nominal position at the
//! rear edge. The closed gripper sweeps over the table at a fixed height. The task's action is the
//! distance in front of the hinge at which the hand stops when it closes the lid; the lid's final
//! angle depends on the axis.
//!
//! Source: ASID (Memmel et al., ICLR 2024), section 5.1 and its appendix.

mod closing;
mod metric;

use std::collections::BTreeMap;

use asid_core::parameter::{Parameter, Scale};
use asid_core::registry::Settings;
use asid_core::task::{
    Commander, Condition, Coordinate, DownstreamProtocol, ExplorationProtocol, Outcome, Outline,
    Task, TaskSpec, TopView, TrackedObject, TrackedPart,
};
use asid_core::{Capabilities, Difficulty, Layout, Levels, Result};

use crate::difficulty;
use crate::panda;
use crate::steering::{self, Steering};

/// Half sizes of base and lid: along the hinge, across it, thickness, m.
const PLATE_HALF: [f64; 3] = [0.15, 0.1, 0.005];

/// Dry friction of a hinge that holds, and of one that yields to a hand, N m.
const HINGE_FRICTION: [f64; 2] = [200.0, 0.3];

/// Largest distance of the hinge's axis from its nominal height, m.
const MAX_OFFSET: f64 = 0.02;

/// Largest angle error of a success unless the difficulty sets another, rad.
const ANGLE_TOLERANCE: f64 = 0.05;

/// Speed of the hand unless the difficulty sets another, m/s.
const HAND_SPEED: f64 = 0.5;

/// Workspace of the closed gripper: it sweeps over the base at a height at which it meets the lid.
const STEERING: Steering = Steering {
    speed: HAND_SPEED,
    x: [0.25, 0.75],
    y: [-0.5, 0.45],
    reach: 0.76,
    fingers: 0.0,
};

/// A point of the hinge's axis in the base's frame, m.
///
/// The axis is along x and lies `hinge_offset` (m) above its nominal position.
#[must_use]
pub fn hinge(hinge_offset: f64) -> [f64; 3] {
    [0.0, PLATE_HALF[1], 0.015 + hinge_offset]
}

/// The task.
pub struct LaptopArticulation {
    spec: TaskSpec,
    angle_tolerance: f64,
    hand_speed: f64,
    home: Vec<f64>,
}

const NAME: &str = "laptop-articulation";
const ABOUT: &str =
    "find whether a laptop's lid turns and about which axis, then close it to a set angle";

asid_core::register!(TaskEntry {
    name: NAME,
    about: ABOUT,
    make: || Ok(Box::new(LaptopArticulation::new()?)),
});

impl LaptopArticulation {
    /// The task with its published ranges.
    ///
    /// # Errors
    /// When the built-in scene cannot be read.
    pub fn new() -> Result<Self> {
        Self::at(Levels::new(difficulties()))
    }

    /// The task at the given difficulty levels.
    fn at(levels: Levels) -> Result<Self> {
        let (scene, home) = panda::scene(NAME, include_str!("scene.xml"))?;
        let angle_tolerance = levels.get("angle_tolerance")?;
        let sensors = ["base_pos", "base_quat", "lid_pos", "lid_quat"];
        let exploration = ExplorationProtocol {
            horizon: 20,
            frames_per_step: steering::FRAMES,
            frame_period: steering::FRAME_PERIOD,
            action: steering::action(),
            start: vec![
                Coordinate::new("x", "m", [0.45, 0.65]),
                Coordinate::new("y", "m", [-0.1, 0.1]),
                Coordinate::new("yaw", "rad", [0.0, std::f64::consts::PI]),
                Coordinate::new("lid", "rad", [1.2, 2.5]),
            ],
            signals: difficulty::signals(&levels, &sensors)?,
            proprioception: panda::proprioception(),
            contact: hand_on("lid"),
        };
        let downstream = DownstreamProtocol {
            metric: "lid_error_rad".into(),
            unit: "rad".into(),
            rule: format!(
                "lid moved by over {} rad and within {angle_tolerance} rad of {} rad",
                metric::MIN_MOTION,
                metric::SET_ANGLE
            ),
            threshold: Some(angle_tolerance),
            frames: closing::frames(),
            frame_period: closing::FRAME_PERIOD,
            action: closing::action(),
            start: closing::start(),
            channels: sensors.map(str::to_owned).into(),
            phases: closing::phases(),
        };
        let spec = TaskSpec {
            requires: Capabilities::ARTICULATION
                | Capabilities::CONTACT
                | Capabilities::ACTUATORS
                | Capabilities::JOINT_FRICTION
                | Capabilities::JOINT_IMPEDANCE
                | Capabilities::MASS_PARAMETERS,
            parameters: parameters(),
            conditions: [("articulated", 1.0), ("rigid", 0.0)]
                .map(|(name, value)| Condition::fixed(name, &[("articulated", value)]))
                .into(),
            difficulty: levels.all().to_vec(),
            tracker_rate: Some(difficulty::rate(&levels)?),
            parts: Some(["base", "lid"].map(|part| TrackedPart {
                position: format!("{part}_pos"),
                orientation: format!("{part}_quat"),
            })),
            objects: objects(),
            top_view: top_view(),
            ..TaskSpec::new([NAME, ABOUT], scene, exploration, downstream)
        };
        Ok(Self {
            spec,
            angle_tolerance,
            hand_speed: levels.get("hand_speed")?,
            home,
        })
    }
}

/// Pairs of bodies that touch when the hand touches a part.
fn hand_on(part: &str) -> Vec<[String; 2]> {
    ["finger_left", "finger_right", "hand"]
        .map(|body| [body.into(), part.into()])
        .into()
}

/// The unknowns: whether the lid turns, and about which axis.
fn parameters() -> Vec<Parameter> {
    vec![
        Parameter {
            name: "articulated".into(),
            targets: crate::targets(["joint/hinge/frictionloss"]),
            range: [0.0, 1.0],
            scale: Scale::Binary(HINGE_FRICTION),
            unit: String::new(),
        },
        Parameter {
            name: "hinge_offset".into(),
            targets: crate::targets(["joint/hinge/pos/2"]),
            range: [-MAX_OFFSET, MAX_OFFSET],
            scale: Scale::Linear,
            unit: "m".into(),
        },
    ]
}

/// Both parts for the top view; the lid is drawn as it looks when it stands upright.
fn objects() -> Vec<TrackedObject> {
    let [x, y, z] = PLATE_HALF;
    [("base", y), ("lid", z)]
        .map(|(part, depth)| TrackedObject {
            outline: Outline {
                label: part.into(),
                corners: crate::rectangle([0.0, 0.0], [x, depth]),
            },
            position: format!("{part}_pos"),
            orientation: Some(format!("{part}_quat")),
            contact: hand_on(part),
            mass: None,
        })
        .into()
}

/// Top view with the base.
fn top_view() -> TopView {
    let [x, y, _] = PLATE_HALF;
    TopView {
        object: Outline {
            label: "base".into(),
            corners: vec![[-x, -y], [x, -y], [x, y], [-x, y]],
        },
        fixtures: Vec::new(),
        bounds: [[0.1, -0.6], [1.0, 0.5]],
    }
}

/// Difficulties of the task.
fn difficulties() -> Vec<Difficulty> {
    let about = "largest error of the lid's angle that is a success";
    let mut all = vec![
        Difficulty::new(
            "angle_tolerance",
            "rad",
            ANGLE_TOLERANCE,
            [0.005, 0.3],
            about,
        ),
        difficulty::hand_speed(HAND_SPEED),
    ];
    all.extend(difficulty::tracker());
    all.push(difficulty::angle_noise());
    all
}

impl Task for LaptopArticulation {
    fn spec(&self) -> &TaskSpec {
        &self.spec
    }

    /// Settings that suit the task better than the defaults.
    ///
    /// The angle to which a push turns the lid is random; the relative pose of the parts is not.
    /// Readings are therefore weighted by the whole covariance of the roughness along the episode.
    /// Some pushes determine the axis to millimetres: the solver uses more samples of the belief
    /// and more candidate actions.
    fn settings(&self, section: &str, algorithm: &str) -> Settings {
        let mut settings = Settings::new();
        match (section, algorithm) {
            ("identifier", "cem" | "reps") => {
                let sampling = Settings::from_iter([("correlated".to_owned(), true.into())]);
                settings.insert("sampling".to_owned(), sampling.into());
            }
            ("solver", "cem") => {
                for (key, n) in [
                    ("belief_samples", 10),
                    ("iterations", 6),
                    ("population", 16),
                ] {
                    settings.insert(key.to_owned(), i64::from(n).into());
                }
            }
            _ => {}
        }
        settings
    }

    fn adjusted(&self, values: &BTreeMap<String, f64>) -> Result<Option<Box<dyn Task>>> {
        let levels = Levels::new(difficulties()).with(values)?;
        Ok(Some(Box::new(Self::at(levels)?)))
    }

    fn place(&self, layout: &Layout, start: &[f64], qpos: &mut [f64]) -> Result<()> {
        crate::lay(layout, "base_free", start, PLATE_HALF[2], qpos)?;
        qpos[layout.joint("hinge")?.qpos] = 0.0;
        qpos[layout.joint("mount")?.qpos] = start[3];
        Ok(())
    }

    fn locate(&self, signals: &[f64]) -> Vec<f64> {
        metric::locate(signals)
    }

    fn commander(&self) -> Result<Box<dyn Commander>> {
        let steering = Steering {
            speed: self.hand_speed,
            ..STEERING
        };
        steering.commander(&self.spec.scene, &self.home)
    }

    fn attempt(&self, start: &[f64], action: &[f64]) -> Result<Vec<f64>> {
        closing::commands(&self.spec.scene, &self.home, start, action[0])
    }

    fn metric(&self, readings: &[f64]) -> Vec<f64> {
        metric::errors(readings)
    }

    fn outcome(&self, readings: &[f64]) -> Outcome {
        metric::outcome(readings, self.angle_tolerance)
    }

    fn side_view(&self, readings: &[f64]) -> Vec<Outline> {
        metric::side_view(readings)
    }
}
