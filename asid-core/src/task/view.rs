//! What a task's pictures and figures show.

use crate::target::Target;

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
