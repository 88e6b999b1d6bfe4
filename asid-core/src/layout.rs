//! Names and places: how the rows of a simulator's arrays are laid out.
//!
//! Arrays follow MuJoCo's conventions whatever the engine: joints in the order
//! of the document (bodies depth first), a free joint takes seven entries of
//! `qpos` (position, then quaternion w x y z) and six of `qvel` (linear
//! velocity in the world frame, angular velocity in the body frame), a ball
//! joint four and three, a hinge (rad) or slide (m) one and one.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// What kind of motion a joint allows.
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
    /// Entries in `qpos`.
    #[must_use]
    pub fn qpos_len(self) -> usize {
        match self {
            Self::Free => 7,
            Self::Ball => 4,
            Self::Hinge | Self::Slide => 1,
        }
    }

    /// Entries in `qvel`.
    #[must_use]
    pub fn qvel_len(self) -> usize {
        match self {
            Self::Free => 6,
            Self::Ball => 3,
            Self::Hinge | Self::Slide => 1,
        }
    }
}

/// A joint and its place in `qpos` and `qvel`.
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

/// An actuator; its index is its place in a control row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Actuator {
    /// Name in the document; `actuator<i>` where it has none.
    pub name: String,
    /// Limits of the command, where it has any.
    pub ctrl_range: Option<[f64; 2]>,
}

/// A sensor and its place in a row of all sensors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// Name in the document; `sensor<i>` where it has none.
    pub name: String,
    /// MJCF element, such as `framepos`.
    pub kind: String,
    /// First entry in a row of all sensors.
    pub address: usize,
    /// Entries: 1 for a scalar, 3 for a vector, 4 for a quaternion.
    pub len: usize,
}

impl Sensor {
    /// Unit of a reading, in SI.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        sensor_unit(&self.kind)
    }
}

/// Unit of the readings of a sensor of this kind, in SI; empty where it has none.
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

/// Number of entries of a sensor of this kind.
#[must_use]
pub fn sensor_len(kind: &str) -> usize {
    match kind {
        "framepos" | "framelinvel" | "frameangvel" | "framelinacc" | "frameangacc" | "force"
        | "torque" | "accelerometer" | "gyro" | "velocimeter" | "magnetometer" | "framexaxis"
        | "frameyaxis" | "framezaxis" | "subtreecom" | "subtreelinvel" | "subtreeangmom"
        | "ballangvel" => 3,
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

/// Names and places of one scene. Every engine gives the same layout for the same scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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

    /// Resolves channel names into what a simulator records; see [`Channel`].
    ///
    /// # Errors
    /// When a name belongs to nothing in the scene.
    pub fn recording<S: AsRef<str>>(&self, names: &[S]) -> Result<Recording> {
        let mut channels = Vec::with_capacity(names.len());
        let mut offsets = vec![0];
        let mut width = 0;
        for name in names {
            let (channel, len) = self.channel(name.as_ref())?;
            channels.push(channel);
            width += len;
            offsets.push(width);
        }
        Ok(Recording { channels, offsets })
    }

    fn channel(&self, name: &str) -> Result<(Channel, usize)> {
        if let Some(joint) = name.strip_prefix("qpos.") {
            let j = self.joint(joint)?;
            let len = j.kind.qpos_len();
            return Ok((Channel::Position { start: j.qpos, len }, len));
        }
        if let Some(joint) = name.strip_prefix("qvel.") {
            let j = self.joint(joint)?;
            let len = j.kind.qvel_len();
            return Ok((Channel::Velocity { start: j.qvel, len }, len));
        }
        if let Some(pair) = name.strip_prefix("contact.") {
            let (a, b) = pair.split_once('/').ok_or_else(|| Error::Config {
                key: name.to_owned(),
                message: "a contact channel is written contact.<body>/<body>".into(),
            })?;
            let channel = Channel::ContactForce {
                bodies: [self.body(a)?, self.body(b)?],
            };
            return Ok((channel, 1));
        }
        let index = self
            .sensors
            .iter()
            .position(|s| s.name == name)
            .ok_or_else(|| Error::unknown("sensor", name, self.sensors.iter().map(|s| &*s.name)))?;
        Ok((Channel::Sensor { index }, self.sensors[index].len))
    }
}

/// Something a simulator can record.
///
/// By name: a sensor's name; `qpos.<joint>` and `qvel.<joint>`; or
/// `contact.<body>/<body>`, the sum of the normal forces between the geoms of
/// two bodies (N; their descendants are not counted).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// All entries of a sensor.
    Sensor {
        /// Index in [`Layout::sensors`].
        index: usize,
    },
    /// Entries of `qpos`.
    Position {
        /// First entry.
        start: usize,
        /// Entries.
        len: usize,
    },
    /// Entries of `qvel`.
    Velocity {
        /// First entry.
        start: usize,
        /// Entries.
        len: usize,
    },
    /// Normal force between two bodies, N.
    ContactForce {
        /// Indices in [`Layout::bodies`].
        bodies: [usize; 2],
    },
}

/// Channels to record, one after the other in a row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    channels: Vec<Channel>,
    offsets: Vec<usize>,
}

impl Recording {
    /// A recording of channels given by index.
    ///
    /// # Errors
    /// [`Error::Shape`] where one lies outside the layout.
    pub fn of(layout: &Layout, channels: &[Channel]) -> Result<Self> {
        let mut offsets = vec![0];
        let mut width = 0;
        for channel in channels {
            let within = |start: usize, len: usize, all: usize| {
                start.checked_add(len).is_some_and(|end| end <= all)
            };
            let (fits, len) = match *channel {
                Channel::Sensor { index } => (
                    index < layout.sensors.len(),
                    layout.sensors.get(index).map_or(0, |s| s.len),
                ),
                Channel::Position { start, len } => (within(start, len, layout.nq), len),
                Channel::Velocity { start, len } => (within(start, len, layout.nv), len),
                Channel::ContactForce { bodies } => {
                    (bodies.iter().all(|&b| b < layout.bodies.len()), 1)
                }
            };
            if !fits {
                return Err(Error::Shape(format!(
                    "channel {channel:?} lies outside the scene"
                )));
            }
            width += len;
            offsets.push(width);
        }
        Ok(Self {
            channels: channels.to_vec(),
            offsets,
        })
    }

    /// The channels in order.
    #[must_use]
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Entries of one row.
    #[must_use]
    pub fn width(&self) -> usize {
        self.offsets.last().copied().unwrap_or(0)
    }

    /// Where channel `i` lies in a row.
    #[must_use]
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        self.offsets[i]..self.offsets[i + 1]
    }
}
