//! Shuffleboard: find how a puck slides by pushing it for two seconds, then shoot it into a zone
//! with one strike.
//!
//! The puck lies on a waxed board; its sliding and its torsional friction are unknown. The closed
//! gripper is the stick. The task's action is the strength of one strike from behind; the puck must
//! come to rest in the near or in the far zone. The real board wears: every shot raises its
//! friction by up to a few per cent, which the simulator does not model.
//!
//! Source: ASID (Memmel et al., ICLR 2024), section 5.2 and its appendix.

mod metric;
mod striking;

use std::collections::BTreeMap;

use asid_core::parameter::{Parameter, Scale};
use asid_core::rng::Rng;
use asid_core::signal::yaw;
use asid_core::task::{
    Commander, Condition, Coordinate, DownstreamProtocol, ExplorationProtocol, Outcome, Outline,
    Task, TaskSpec, TopView,
};
use asid_core::{Capabilities, Difficulty, Layout, Levels, Result, Scene};
use rand::Rng as _;

use crate::difficulty;
use crate::panda;
use crate::steering::{self, Steering};

/// Radius of the puck, m.
const PUCK_RADIUS: f64 = 0.0381;

/// Height of the puck's middle on the board, m.
const PUCK_REST_HEIGHT: f64 = 0.0127;

/// Middle of the board, m.
const LANE: [f64; 2] = [0.67, 0.0];

/// Half sizes of the board along and across its length, m.
const LANE_HALF: [f64; 2] = [0.505, 0.115];

/// Largest relative rise of the friction in one shot, unless the difficulty sets another.
const WEAR: f64 = 0.06;

/// Length of each zone along the board unless the difficulty sets another, m.
const ZONE_LENGTH: f64 = 0.25;

/// Speed of the hand unless the difficulty sets another, m/s.
const HAND_SPEED: f64 = 0.4;

/// The zone in which the puck must come to rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Zone {
    /// x from 0.675 to 0.925 m.
    Near,
    /// x from 0.925 to 1.175 m, the board's end.
    Far,
}

impl Zone {
    /// Both zones.
    pub const ALL: [Self; 2] = [Self::Near, Self::Far];

    /// Name of the zone, which is also that of the task's condition.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Near => "near",
            Self::Far => "far",
        }
    }

    /// Position of the zone's middle along the board, m.
    #[must_use]
    pub fn middle(self) -> f64 {
        match self {
            Self::Near => 0.8,
            Self::Far => 1.05,
        }
    }
}

/// Workspace of the closed gripper: the near end of the board.
const STEERING: Steering = Steering {
    speed: HAND_SPEED,
    x: [0.28, 0.50],
    y: [-0.115, 0.115],
    reach: f64::INFINITY,
    fingers: 0.0,
};

/// The task.
pub struct Shuffleboard {
    spec: TaskSpec,
    zone: Zone,
    levels: Levels,
    zone_length: f64,
    wear: f64,
    hand_speed: f64,
    home: Vec<f64>,
}

const NAME: &str = "shuffleboard";
const ABOUT: &str = "find a puck's friction by pushing it, then shoot it into a zone";

asid_core::register!(TaskEntry {
    name: NAME,
    about: ABOUT,
    make: || Ok(Box::new(Shuffleboard::new(Zone::Near)?)),
});

impl Shuffleboard {
    /// The task with this zone as its goal.
    ///
    /// # Errors
    /// When the built-in scene cannot be read.
    pub fn new(zone: Zone) -> Result<Self> {
        Self::at(zone, Levels::new(difficulties()))
    }

    /// The task at the given difficulty levels.
    fn at(zone: Zone, levels: Levels) -> Result<Self> {
        let (mut scene, home) = panda::scene(NAME, include_str!("scene.xml"))?;
        let zone_length = levels.get("zone_length")?;
        let size = format!("{:?} {:?} 0.001", 0.5 * zone_length, LANE_HALF[1]);
        for zone in Zone::ALL {
            let paint = format!("{}_zone", zone.name());
            scene = scene.with_attribute("geom", &paint, "size", &size)?;
        }
        let exploration = ExplorationProtocol {
            horizon: 20,
            frames_per_step: steering::FRAMES,
            frame_period: steering::FRAME_PERIOD,
            action: steering::action(),
            start: start(0.01),
            signals: difficulty::signals(&levels, &["puck_pos", "puck_quat"])?,
            proprioception: panda::proprioception(),
            contact: ["finger_left", "finger_right"]
                .map(|f| [f.into(), "puck".into()])
                .into(),
        };
        let downstream = DownstreamProtocol {
            metric: "zone_error_m".into(),
            unit: "m".into(),
            rule: format!(
                "at rest on the board within {} m of the {} zone's middle",
                0.5 * zone_length,
                zone.name()
            ),
            threshold: Some(0.5 * zone_length),
            frames: striking::frames(),
            frame_period: striking::FRAME_PERIOD,
            action: vec![Coordinate::new("strength", "", striking::STRENGTH)],
            start: start(0.005),
            channels: vec!["puck_pos".into()],
            phases: striking::phases(),
        };
        let spec = TaskSpec {
            requires: Capabilities::ARTICULATION
                | Capabilities::CONTACT
                | Capabilities::ACTUATORS
                | Capabilities::FREE_BODIES
                | Capabilities::TORSIONAL_FRICTION,
            parameters: frictions(),
            // Each condition sets its zone as the goal; the truth is drawn from the prior.
            conditions: Zone::ALL
                .map(|zone| Condition::drawn(zone.name(), &[]))
                .into(),
            difficulty: levels.all().to_vec(),
            tracker_rate: Some(difficulty::rate(&levels)?),
            // The reach of a puck that the hand throws, at the lowest friction.
            bounds: [[-0.3, -0.9, -0.02], [1.3, 0.9, 0.3]],
            top_view: top_view(zone_length),
            ..TaskSpec::new([NAME, ABOUT], scene, exploration, downstream)
        };
        Ok(Self {
            spec,
            zone,
            zone_length,
            wear: levels.get("wear")?,
            hand_speed: levels.get("hand_speed")?,
            levels,
            home,
        })
    }
}

/// The unknowns: friction of the puck on the board.
fn frictions() -> Vec<Parameter> {
    [
        (
            "sliding_friction",
            "geom/puck/friction/0",
            [0.01, 0.035],
            "",
        ),
        (
            "torsional_friction",
            "geom/puck/friction/1",
            [5e-4, 5e-3],
            "m",
        ),
    ]
    .into_iter()
    .map(|(name, target, range, unit)| Parameter {
        name: name.into(),
        targets: target.parse().into_iter().collect(),
        range,
        scale: Scale::Log,
        unit: unit.into(),
    })
    .collect()
}

/// Top view of puck, board and zones.
fn top_view(zone_length: f64) -> TopView {
    let zone = |z: Zone| Outline {
        label: format!("{} zone", z.name()),
        corners: crate::rectangle([z.middle(), 0.0], [0.5 * zone_length, LANE_HALF[1]]),
    };
    TopView {
        object: Outline {
            label: "puck".into(),
            corners: crate::circle([0.0, 0.0], PUCK_RADIUS),
        },
        fixtures: vec![
            Outline {
                label: "board".into(),
                corners: crate::rectangle(LANE, LANE_HALF),
            },
            zone(Zone::Near),
            zone(Zone::Far),
        ],
        bounds: [[0.1, -0.25], [1.25, 0.25]],
    }
}

/// Difficulties of the task.
fn difficulties() -> Vec<Difficulty> {
    let zone = "length of each zone along the board";
    let wear = "largest rise of the friction in one shot, as a share";
    let mut all = vec![
        Difficulty::new("zone_length", "m", ZONE_LENGTH, [0.02, 0.25], zone).published(0.25),
        Difficulty::new("wear", "", WEAR, [0.0, 0.3], wear),
        difficulty::hand_speed(HAND_SPEED),
    ];
    all.extend(difficulty::tracker());
    all.push(difficulty::angle_noise());
    all
}

/// Start poses: the puck lies at x = 0.4 m in the middle of the board, within `slack`.
fn start(slack: f64) -> Vec<Coordinate> {
    vec![
        Coordinate::new("x", "m", [0.4 - slack, 0.4 + slack]),
        Coordinate::new("y", "m", [-slack, slack]),
        Coordinate::new("yaw", "rad", [-0.1, 0.1]),
    ]
}

impl Task for Shuffleboard {
    fn spec(&self) -> &TaskSpec {
        &self.spec
    }

    fn adjusted(&self, values: &BTreeMap<String, f64>) -> Result<Option<Box<dyn Task>>> {
        let levels = Levels::new(difficulties()).with(values)?;
        Ok(Some(Box::new(Self::at(self.zone, levels)?)))
    }

    fn under(&self, condition: &str) -> Result<Option<Box<dyn Task>>> {
        let zone = Zone::ALL.into_iter().find(|z| z.name() == condition);
        zone.map(|z| Ok(Box::new(Self::at(z, self.levels.clone())?) as Box<dyn Task>))
            .transpose()
    }

    fn wear(&self, parameters: &[Parameter], truth: &mut [f64], rng: &mut Rng) {
        let factor = 1.0 + self.wear * rng.random::<f64>();
        for (p, x) in parameters.iter().zip(truth) {
            if p.name.ends_with("_friction") {
                *x *= factor;
            }
        }
    }

    /// Another puck: 15 % lighter and 1 mm smaller in radius. The board wears in this world as in
    /// every other.
    fn stand_in(&self) -> Result<Option<Scene>> {
        let size = format!("{} {PUCK_REST_HEIGHT}", PUCK_RADIUS - 0.001);
        let puck = self
            .spec
            .scene
            .with_attribute("geom", "puck", "size", &size)?;
        puck.with_attribute("geom", "puck", "mass", "0.034")
            .map(Some)
    }

    fn place(&self, layout: &Layout, start: &[f64], qpos: &mut [f64]) -> Result<()> {
        crate::lay(layout, "puck_free", start, PUCK_REST_HEIGHT, qpos)
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
        striking::commands(&self.spec.scene, &self.home, start, action[0])
    }

    fn metric(&self, readings: &[f64]) -> Vec<f64> {
        readings
            .chunks_exact(3)
            .map(|row| metric::zone_error(self.zone, row))
            .collect()
    }

    fn outcome(&self, readings: &[f64]) -> Outcome {
        metric::outcome(self.zone, self.zone_length, readings)
    }

    fn goal_reward(&self, reading: &[f64]) -> Option<f64> {
        Some(-metric::zone_error(self.zone, reading))
    }
}
