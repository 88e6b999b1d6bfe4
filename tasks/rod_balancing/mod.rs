//! Rod balancing: find the offset of a rod's centre of mass by pushing it, then lay it on a ledge
//! so that it stays level.
//!
//! The rod is 0.04 x 0.3 x 0.04 m: 0.05 kg are spread along it and 0.15 kg sit at `mass_offset`.
//! Its centre of mass therefore lies at three quarters of that offset. The closed gripper pushes it
//! around on a table; its rotation reveals the offset. The task's action is the point along the rod
//! at which it is picked up and which is laid over the middle of a ledge 0.04 m wide. All motion is
//! by simulated contact, and the tilt is read from the rod's pose.
//!
//! Source: ASID (Memmel et al., ICLR 2024), section 5.1 and its appendix.

mod metric;
mod placing;
mod stand_in;

use std::collections::BTreeMap;

use asid_core::parameter::{Parameter, Scale};
use asid_core::signal::yaw;
use asid_core::task::{
    Commander, Condition, Coordinate, DownstreamProtocol, ExplorationProtocol, Outcome, Outline,
    Task, TaskSpec, TopView,
};
use asid_core::{Capabilities, Difficulty, Layout, Levels, Result, Scene};

use crate::difficulty;
use crate::panda;
use crate::steering::{self, Steering};

/// Speed of the hand unless the difficulty sets another, m/s. Faster pushes make the rod hop.
const HAND_SPEED: f64 = 0.4;

/// Workspace of the closed gripper, which pushes the rod around on the table.
const STEERING: Steering = Steering {
    speed: HAND_SPEED,
    x: [0.30, 0.70],
    y: [-0.4, 0.4],
    reach: 0.74,
    fingers: 0.0,
};

/// Half sizes of the rod along its axes, m; the long one is y.
const ROD_HALF: [f64; 3] = [0.02, 0.15, 0.02];

/// Middle of the ledge's top, m.
const LEDGE: [f64; 3] = [0.2, -0.5, 0.15];

/// Half length of the ledge and half its height, m.
const LEDGE_HALF: [f64; 2] = [0.05, 0.075];

/// Width of the ledge unless the difficulty sets another, m.
const LEDGE_WIDTH: f64 = 0.04;

/// Height of the rod's middle when it rests on the table, m.
const ROD_REST_HEIGHT: f64 = 0.02;

/// The task.
pub struct RodBalancing {
    spec: TaskSpec,
    ledge_width: f64,
    hand_speed: f64,
    home: Vec<f64>,
}

const NAME: &str = "rod-balancing";
const ABOUT: &str = "find a rod's centre of mass by pushing it, then balance it on a ledge";

asid_core::register!(TaskEntry {
    name: NAME,
    about: ABOUT,
    make: || Ok(Box::new(RodBalancing::new()?)),
});

impl RodBalancing {
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
        let ledge_width = levels.get("ledge_width")?;
        let [half_length, half_height] = LEDGE_HALF;
        let size = format!("{:?} {half_length:?} {half_height:?}", 0.5 * ledge_width);
        let scene = scene.with_attribute("geom", "ledge", "size", &size)?;
        let pi = std::f64::consts::PI;
        let exploration = ExplorationProtocol {
            horizon: 20,
            frames_per_step: steering::FRAMES,
            frame_period: steering::FRAME_PERIOD,
            action: steering::action(),
            start: vec![
                Coordinate::new("x", "m", [0.5, 0.6]),
                Coordinate::new("y", "m", [-0.2, 0.2]),
                Coordinate::new("yaw", "rad", [0.0, pi]),
            ],
            signals: difficulty::signals(&levels, &["rod_pos", "rod_quat"])?,
            proprioception: panda::proprioception(),
            contact: ["finger_left", "finger_right"]
                .map(|f| [f.into(), "rod".into()])
                .into(),
        };
        let downstream = DownstreamProtocol {
            metric: "tilt_deg".into(),
            unit: "deg".into(),
            rule: "tilt below 5° and still on the ledge".into(),
            threshold: Some(metric::MAX_TILT),
            frames: placing::frames(),
            frame_period: placing::FRAME_PERIOD,
            action: vec![Coordinate::new("pick", "m", [-0.1, 0.1])],
            start: placing::start(),
            channels: vec!["rod_pos".into(), "rod_quat".into()],
            phases: placing::phases(),
        };
        let spec = TaskSpec {
            requires: Capabilities::ARTICULATION | Capabilities::CONTACT | Capabilities::ACTUATORS,
            parameters: vec![mass_offset()],
            optional_parameters: vec![friction()],
            conditions: [("left", -0.08), ("middle", 0.0), ("right", 0.08)]
                .map(|(name, offset)| Condition::fixed(name, &[("mass_offset", offset)]))
                .into(),
            difficulty: levels.all().to_vec(),
            tracker_rate: Some(difficulty::rate(&levels)?),
            top_view: top_view(ledge_width),
            ..TaskSpec::new([NAME, ABOUT], scene, exploration, downstream)
        };
        Ok(Self {
            spec,
            ledge_width,
            hand_speed: levels.get("hand_speed")?,
            home,
        })
    }
}

/// The unknown offset of the rod's mass.
fn mass_offset() -> Parameter {
    Parameter {
        name: "mass_offset".into(),
        targets: crate::targets(["geom/rod_mass/pos/1"]),
        range: [-0.1, 0.1],
        scale: Scale::Linear,
        unit: "m".into(),
    }
}

/// Optional unknown: friction of the rod. The table's own coefficient is the lower end of the
/// range, so that the rod's coefficient prevails everywhere in it.
fn friction() -> Parameter {
    Parameter {
        name: "friction".into(),
        targets: crate::targets(["geom/rod_1/friction/0", "geom/rod_5/friction/0"]),
        range: [0.2, 0.5],
        scale: Scale::Linear,
        unit: String::new(),
    }
}

/// Top view of rod and ledge.
fn top_view(ledge_width: f64) -> TopView {
    let [x, y, _] = ROD_HALF;
    TopView {
        object: Outline {
            label: "rod".into(),
            corners: vec![[-x, -y], [x, -y], [x, y], [-x, y]],
        },
        fixtures: vec![Outline {
            label: "ledge".into(),
            corners: crate::rectangle([LEDGE[0], LEDGE[1]], [0.5 * ledge_width, LEDGE_HALF[0]]),
        }],
        bounds: [[0.1, -0.6], [0.8, 0.5]],
    }
}

/// Difficulties of the task.
fn difficulties() -> Vec<Difficulty> {
    let about = "width of the ledge that the rod is laid across";
    let mut all = vec![
        Difficulty::new("ledge_width", "m", LEDGE_WIDTH, [0.004, 0.1], about),
        difficulty::hand_speed(HAND_SPEED),
    ];
    all.extend(difficulty::tracker());
    all.push(difficulty::angle_noise());
    all
}

impl Task for RodBalancing {
    fn spec(&self) -> &TaskSpec {
        &self.spec
    }

    fn adjusted(&self, values: &BTreeMap<String, f64>) -> Result<Option<Box<dyn Task>>> {
        let levels = Levels::new(difficulties()).with(values)?;
        Ok(Some(Box::new(Self::at(levels)?)))
    }

    /// Another rod: shorter, a quarter heavier, with more friction below, and with its mass less
    /// concentrated.
    fn stand_in(&self) -> Result<Option<Scene>> {
        stand_in::scene(&self.spec.scene).map(Some)
    }

    fn place(&self, layout: &Layout, start: &[f64], qpos: &mut [f64]) -> Result<()> {
        crate::lay(layout, "rod_free", start, ROD_REST_HEIGHT, qpos)
    }

    fn locate(&self, signals: &[f64]) -> Vec<f64> {
        vec![signals[0], signals[1], yaw(&signals[3..7])]
    }

    fn commander(&self) -> Result<Box<dyn Commander>> {
        let steering = Steering {
            speed: self.hand_speed,
            ..STEERING
        };
        steering.commander(&self.spec.scene, &self.home)
    }

    fn attempt(&self, start: &[f64], action: &[f64]) -> Result<Vec<f64>> {
        placing::commands(&self.spec.scene, &self.home, start, action[0])
    }

    fn metric(&self, readings: &[f64]) -> Vec<f64> {
        readings.chunks_exact(7).map(metric::tilt_deg).collect()
    }

    fn outcome(&self, readings: &[f64]) -> Outcome {
        metric::outcome(readings)
    }

    fn side_view(&self, readings: &[f64]) -> Vec<Outline> {
        metric::side_view(readings, self.ledge_width)
    }
}
