//! Geometry for a task's pictures and figures.

use crate::target::Target;

/// A shape seen from above or from the side, for pictures; m.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outline {
    /// Name of the thing.
    pub label: String,
    /// Corners, in order.
    pub corners: Vec<[f64; 2]>,
}

/// Content of a picture of the scene from above.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TopView {
    /// The object in its own frame.
    pub object: Outline,
    /// Static things, in the world frame.
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

/// A tracked thing, as used by pictures and figures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrackedObject {
    /// Its name, and its shape in its own frame.
    pub outline: Outline,
    /// Sensor of its position; the first two entries are its position in the plane, m.
    pub position: String,
    /// Sensor of its orientation, if that is tracked.
    pub orientation: Option<String>,
    /// Pairs of bodies whose contact counts as the machine touching it.
    pub contact: Vec<[String; 2]>,
    /// Its mass in the scene, if a single number sets it.
    pub mass: Option<Target>,
}
