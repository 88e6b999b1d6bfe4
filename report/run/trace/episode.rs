//! The real episode: what was recorded, and its replays.

use serde::{Deserialize, Serialize};

use asid_results::nullable;

/// The real episode in the horizontal plane of the world, in m.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Episode {
    /// Objects that move.
    pub objects: Vec<ObjectTrack>,
    /// The end effector's path.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end_effector: Option<PlanarPath>,
    /// The workspace as `[x_low, x_high, y_low, y_high]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub workspace: Option<[f64; 4]>,
    /// Static things: table, walls, goal, ledge.
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
    /// Whether it has no visible heading, like a ball.
    pub round: bool,
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
pub struct PlanarPath {
    /// Times, s. A dot is drawn at each, so use control steps rather than physics steps.
    #[serde(deserialize_with = "nullable::list")]
    pub time: Vec<f64>,
    /// Position at each time in m.
    #[serde(deserialize_with = "nullable::rows")]
    pub position: Vec<[f64; 2]>,
}

/// What a shape represents, which determines its colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShapeKind {
    /// Table, wall, ledge: static things.
    #[default]
    Fixed,
    /// Where something should go.
    Goal,
    /// The object of the task.
    Object,
    /// A distinguishable part of the object, such as its movable mass.
    Part,
    /// The robot.
    Robot,
}

/// A polygon, or a circle if it has a radius.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Shape {
    /// Text for the legend; may be empty.
    pub label: String,
    /// What it represents.
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
    /// Standard deviation of a reading's noise, if known.
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
    /// Times, s, increasing; they may differ from those of the readings.
    #[serde(deserialize_with = "nullable::list")]
    pub time: Vec<f64>,
    /// Value at each time.
    #[serde(deserialize_with = "nullable::list")]
    pub value: Vec<f64>,
    /// `[low, high]` of 95 % of the posterior's replays at each time; may be empty.
    #[serde(deserialize_with = "nullable::rows")]
    pub band95: Vec<[f64; 2]>,
}
