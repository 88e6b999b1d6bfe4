//! Names and indices: the layout of a simulator's arrays.
//!
//! Arrays follow MuJoCo's conventions, whatever the engine. Joints are in the order of the document
//! (bodies depth first). A free joint takes seven entries of `qpos` (position, then quaternion w x
//! y z) and six of `qvel` (linear velocity in the world frame, angular velocity in the body frame).
//! A ball joint takes four and three, a hinge (rad) or slide (m) one and one.

mod recording;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
pub use recording::{Channel, Recording};

/// The kind of motion that a joint allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JointKind {
    /// Six degrees of freedom.
    Free,
    /// Three rotations.
    Ball,
    /// One rotation, rad.
    Hinge,
    /// One translation, m.
    Slide,
}

impl JointKind {
    /// Number of entries in `qpos`.
    #[must_use]
    pub fn qpos_len(self) -> usize {
        match self {
            Self::Free => 7,
            Self::Ball => 4,
            Self::Hinge | Self::Slide => 1,
        }
    }

    /// Number of entries in `qvel`.
    #[must_use]
    pub fn qvel_len(self) -> usize {
        match self {
            Self::Free => 6,
            Self::Ball => 3,
            Self::Hinge | Self::Slide => 1,
        }
    }
}

/// A joint and its indices in `qpos` and `qvel`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// Name in the document; `joint<i>` where it has none.
    pub name: String,
    /// Kind.
    pub kind: JointKind,
    /// Name of the body that it moves.
    pub body: String,
    /// First entry in `qpos`.
    pub qpos: usize,
    /// First entry in `qvel`.
    pub qvel: usize,
}

/// An actuator; its index is its position in a control row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Actuator {
    /// Name in the document; `actuator<i>` where it has none.
    pub name: String,
    /// Limits of the command, if any.
    pub ctrl_range: Option<[f64; 2]>,
}

/// A sensor and its position in a row of all sensors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// Name in the document; `sensor<i>` where it has none.
    pub name: String,
    /// MJCF element, such as `framepos`.
    pub kind: String,
    /// First entry in a row of all sensors.
    pub address: usize,
    /// Number of entries: 1 for a scalar, 3 for a vector, 4 for a quaternion.
    pub len: usize,
}

impl Sensor {
    /// Unit of a reading, in SI.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        sensor_unit(&self.kind)
    }

    /// Whether it reads an orientation, as a quaternion `w x y z`.
    #[must_use]
    pub fn is_orientation(&self) -> bool {
        self.len == 4
    }
}

/// Unit of the readings of a sensor of this kind, in SI; empty if there is none.
#[must_use]
pub fn sensor_unit(kind: &str) -> &'static str {
    match kind {
        "framepos" | "subtreecom" | "tendonpos" | "rangefinder" => "m",
        "framelinvel" | "velocimeter" | "subtreelinvel" => "m/s",
        "frameangvel" | "gyro" => "rad/s",
        "accelerometer" | "framelinacc" => "m/s²",
        "frameangacc" => "rad/s²",
        "force" | "touch" => "N",
        "torque" => "N m",
        _ => "",
    }
}

/// Whether a sensor of this kind reads forces or accelerations, which jump where a command does.
#[must_use]
pub fn reads_forces(kind: &str) -> bool {
    matches!(
        kind,
        "accelerometer"
            | "framelinacc"
            | "frameangacc"
            | "force"
            | "torque"
            | "touch"
            | "actuatorfrc"
            | "jointactuatorfrc"
            | "tendonactuatorfrc"
            | "jointlimitfrc"
            | "tendonlimitfrc"
    )
}

/// Number of entries of a sensor of this kind.
#[must_use]
pub fn sensor_len(kind: &str) -> usize {
    match kind {
        "framepos" | "framelinvel" | "frameangvel" | "framelinacc" | "frameangacc" | "force"
        | "torque" | "accelerometer" | "gyro" | "velocimeter" | "magnetometer" | "framexaxis"
        | "frameyaxis" | "framezaxis" | "subtreecom" | "subtreelinvel" | "subtreeangmom"
        | "ballangvel" | "normal" => 3,
        "camprojection" => 2,
        "fromto" => 6,
        "framequat" | "ballquat" => 4,
        _ => 1,
    }
}

/// A named starting state of the document (`<key>`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Keyframe {
    /// Name; `key<i>` where it has none.
    pub name: String,
    /// Positions, `nq`.
    pub qpos: Vec<f64>,
    /// Velocities, `nv`.
    pub qvel: Vec<f64>,
    /// Commands, `nu`.
    pub ctrl: Vec<f64>,
}

/// Names and indices of one scene. Every engine gives the same layout for the same scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Layout {
    /// Physics time step, s.
    pub timestep: f64,
    /// Length of `qpos`.
    pub nq: usize,
    /// Length of `qvel`.
    pub nv: usize,
    /// Bodies in document order, the world first as `world`.
    pub bodies: Vec<String>,
    /// Geoms in document order; `geom<i>` where one has no name.
    pub geoms: Vec<String>,
    /// Joints in document order.
    pub joints: Vec<Joint>,
    /// Actuators in document order.
    pub actuators: Vec<Actuator>,
    /// Sensors in document order.
    pub sensors: Vec<Sensor>,
    /// Keyframes in document order.
    pub keyframes: Vec<Keyframe>,
}

impl Layout {
    /// Length of a control row, `nu`.
    #[must_use]
    pub fn nu(&self) -> usize {
        self.actuators.len()
    }

    /// Length of a row of all sensors.
    #[must_use]
    pub fn nsensordata(&self) -> usize {
        self.sensors.iter().map(|s| s.len).sum()
    }

    /// First entry in `qpos` of each quaternion.
    #[must_use]
    pub fn quaternions(&self) -> Vec<usize> {
        let of = |joint: &Joint| match joint.kind {
            JointKind::Free => Some(joint.qpos + 3),
            JointKind::Ball => Some(joint.qpos),
            JointKind::Hinge | JointKind::Slide => None,
        };
        self.joints.iter().filter_map(of).collect()
    }

    /// The joint of this name.
    ///
    /// # Errors
    /// When there is none; the message lists near names.
    pub fn joint(&self, name: &str) -> Result<&Joint> {
        self.joints
            .iter()
            .find(|j| j.name == name)
            .ok_or_else(|| Error::unknown("joint", name, self.joints.iter().map(|j| &*j.name)))
    }

    /// The sensor of this name.
    ///
    /// # Errors
    /// When there is none; the message lists near names.
    pub fn sensor(&self, name: &str) -> Result<&Sensor> {
        self.sensors
            .iter()
            .find(|s| s.name == name)
            .ok_or_else(|| Error::unknown("sensor", name, self.sensors.iter().map(|s| &*s.name)))
    }

    /// Index of the actuator of this name in a control row.
    ///
    /// # Errors
    /// When there is none; the message lists near names.
    pub fn actuator(&self, name: &str) -> Result<usize> {
        self.actuators
            .iter()
            .position(|a| a.name == name)
            .ok_or_else(|| {
                Error::unknown("actuator", name, self.actuators.iter().map(|a| &*a.name))
            })
    }

    /// Index of the body of this name.
    ///
    /// # Errors
    /// When there is none; the message lists near names.
    pub fn body(&self, name: &str) -> Result<usize> {
        self.bodies
            .iter()
            .position(|b| b == name)
            .ok_or_else(|| Error::unknown("body", name, self.bodies.iter().map(String::as_str)))
    }

    /// The keyframe of this name.
    ///
    /// # Errors
    /// When there is none; the message lists near names.
    pub fn keyframe(&self, name: &str) -> Result<&Keyframe> {
        self.keyframes
            .iter()
            .find(|k| k.name == name)
            .ok_or_else(|| {
                Error::unknown("keyframe", name, self.keyframes.iter().map(|k| &*k.name))
            })
    }
}
