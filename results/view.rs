//! What the 3-D view of a report shows: the shapes of a scene, and how its machines moved.
//!
//! A machine is seen several times over in the same scene: as logged, and as simulated. What does not move is
//! there once. Bodies that are rigidly joined to each other are one *part*; part 0 is the world.
//!
//! Numbers that come by the thousand are 16-bit integers, little-endian, in base64 without padding: a pose is
//! seven (position, then quaternion `w x y z`), a contact point three, a vertex three, a triangle three. A position
//! or point `n` lies at `low + n / 65534 * size` ([`Take::low`], [`Mesh::low`]); a component of a quaternion is
//! `n / 32767 - 1`. A pose that begins with 65535 is missing: the simulation had diverged, or nothing was logged.

use serde::{Deserialize, Serialize};

/// A scene and what happened in it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct View {
    /// Names of the parts; 0 is the world.
    pub parts: Vec<String>,
    /// Shapes, each in the frame of its part.
    pub shapes: Vec<Shape>,
    /// Triangles of the shapes that are meshes.
    pub meshes: Vec<Mesh>,
    /// Episodes, the one to begin with first.
    pub takes: Vec<Take>,
    /// Remarks for the reader, such as joints that no sensor reads.
    pub notes: Vec<String>,
}

/// Kind of a shape. Sizes are MJCF's: half lengths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShapeKind {
    /// Radius.
    #[default]
    Sphere,
    /// Half lengths along x, y and z.
    Box,
    /// Radius, and half the length of the straight part along z.
    Capsule,
    /// Radius, and half the length along z.
    Cylinder,
    /// Semi-axes.
    Ellipsoid,
    /// Half lengths along x and y, 0 for no end; its normal is z.
    Plane,
    /// As its mesh says.
    Mesh,
}

/// A rigid shape of a part.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Shape {
    /// Index in [`View::parts`].
    pub part: usize,
    /// Kind.
    pub kind: ShapeKind,
    /// Size by kind, m.
    pub size: [f32; 3],
    /// Position in the part's frame, m.
    pub position: [f32; 3],
    /// Orientation in the part's frame, quaternion `w x y z`.
    pub rotation: [f32; 4],
    /// Colour and opacity, 0 to 1; `None` where the scene says nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rgba: Option<[f32; 4]>,
    /// Index in [`View::meshes`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<usize>,
}

/// Triangles.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Mesh {
    /// Lowest corner of the vertices, m.
    pub low: [f32; 3],
    /// Longest side of the box around the vertices, m.
    pub size: f32,
    /// Vertices.
    pub vertices: String,
    /// Three vertices a triangle, by index.
    pub triangles: String,
}

/// An episode in the scene. All lists have one entry a frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Take {
    /// Episode, as plots name it.
    pub name: String,
    /// What it is, in a few words, such as `held out`.
    pub what: String,
    /// Times since its first row, s.
    pub time: Vec<f32>,
    /// Lowest corner of all positions, m.
    pub low: [f32; 3],
    /// Longest side of the box around them, m.
    pub size: f32,
    /// The machine as logged, and as simulated.
    pub machines: Vec<Machine>,
    /// Forces that the model lacks.
    pub forces: Vec<Force>,
}

/// Where a machine's motion is from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// The real one, as logged.
    #[default]
    Real,
    /// Simulated with the model as given.
    Nominal,
    /// Simulated before: with the prior's centre, or with the study's parameters fitted and no effect.
    Before,
    /// Simulated after: with the estimate, or with the effects of the verdict.
    After,
    /// As the simulator expects it; nothing was played yet.
    Predicted,
}

/// A machine's motion.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Machine {
    /// Where it is from.
    pub origin: Origin,
    /// Name, such as `refined model`.
    pub label: String,
    /// Poses of all parts but the world, frame by frame.
    pub poses: String,
    /// Number of contact points of each frame.
    pub touching: Vec<u16>,
    /// Contact points, frame by frame.
    pub contacts: String,
}

/// A generalized force at one degree of freedom that the model lacks.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Force {
    /// Degree of freedom.
    pub dof: String,
    /// Unit: `N` or `N m`.
    pub unit: String,
    /// Part that it acts on.
    pub part: usize,
    /// Whether it turns about the axis; it pushes along it otherwise.
    pub turns: bool,
    /// Where it is drawn, in the part's frame, m.
    pub at: [f32; 3],
    /// Direction, a unit vector.
    pub axis: [f32; 3],
    /// Whether the axis is the world's; it is the part's otherwise.
    pub in_world: bool,
    /// What is missing without effects, N or N m; 0 where it is not known.
    pub before: Vec<f32>,
    /// What is missing with the verdict's effects; empty where there are none.
    pub after: Vec<f32>,
}
