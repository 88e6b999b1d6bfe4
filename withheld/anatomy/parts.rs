//! Joints, actuators and sensors, as the model describes them.

use mujoco_rs::wrappers::mj_model::{MjModel, MjtObjBase};

use crate::document::Element;

/// Kind of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about an axis.
    Hinge,
    /// Moves along an axis.
    Slide,
    /// A free body.
    Free,
}

/// A joint.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Name.
    pub name: String,
    /// Kind.
    pub kind: JointKind,
    /// Body that it moves.
    pub body: String,
    /// Index of its first position in `qpos`.
    pub qpos: usize,
    /// Index of its first velocity in `qvel`.
    pub dof: usize,
    /// Rotor inertia, kg m² or kg.
    pub armature: f64,
    /// Viscous friction, N m s/rad or N s/m.
    pub damping: f64,
}

/// Force law of an actuator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriveKind {
    /// The command is the force.
    Motor,
    /// A position servo.
    Position,
    /// A velocity servo.
    Velocity,
    /// A force at a site of a body.
    Thrust,
}

/// An actuator.
#[derive(Clone, Debug)]
pub struct Drive {
    /// Name.
    pub name: String,
    /// Law.
    pub kind: DriveKind,
    /// The only joint that it drives, as an index of `Anatomy::joints`; `None` for a tendon or a
    /// site.
    pub joint: Option<usize>,
    /// Gear ratio.
    pub gear: f64,
    /// `kp` of a position servo.
    pub kp: f64,
    /// `kv` of a servo.
    pub kv: f64,
    /// Largest force, if it is limited.
    pub limit: f64,
}

/// The part of the machine that a sensor reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reads {
    /// A joint, as an index of `Anatomy::joints`.
    Joint(usize),
    /// A body, or something that is fixed to it, as an index of `Anatomy::bodies`.
    Body(usize),
    /// Something else.
    Other,
}

/// A sensor.
#[derive(Clone, Debug)]
pub struct Sensor {
    /// Name.
    pub name: String,
    /// Tag in the model.
    pub kind: String,
    /// The part that it reads.
    pub reads: Reads,
    /// Index of the first value of its reading in a row of readings.
    pub address: usize,
    /// Number of values of its reading.
    pub len: usize,
    /// Standard deviation of the noise of each value.
    pub noise: f64,
}

impl Sensor {
    /// Names of its columns in a log.
    #[must_use]
    pub fn columns(&self) -> Vec<String> {
        match self.len {
            1 => vec![self.name.clone()],
            n => (0..n).map(|i| format!("{}.{i}", self.name)).collect(),
        }
    }

    /// Whether it reads an orientation.
    #[must_use]
    pub fn is_orientation(&self) -> bool {
        self.kind == "framequat"
    }
}

/// Kind of joint that an element defines; `None` if the element is no supported joint.
pub(super) fn joint_kind(tag: &str, element: &Element) -> Option<JointKind> {
    match (tag, element.get("type")) {
        ("freejoint", _) => Some(JointKind::Free),
        ("joint", Some("free")) => Some(JointKind::Free),
        ("joint", Some("slide")) => Some(JointKind::Slide),
        ("joint", None | Some("hinge")) => Some(JointKind::Hinge),
        _ => None,
    }
}

/// The part of the machine that a sensor of a compiled model reads.
pub(super) fn reads(model: &MjModel, sensor: usize, joints: &[Joint]) -> Reads {
    let Ok(id) = usize::try_from(model.sensor_objid()[sensor]) else {
        return Reads::Other;
    };
    let body = |id: i32| usize::try_from(id).map_or(Reads::Other, Reads::Body);
    match model.sensor_objtype()[sensor] {
        MjtObjBase::mjOBJ_JOINT => {
            let name = model.id_to_name(MjtObjBase::mjOBJ_JOINT, id);
            let joint = joints.iter().position(|j| Some(&*j.name) == name);
            joint.map_or(Reads::Other, Reads::Joint)
        }
        MjtObjBase::mjOBJ_BODY | MjtObjBase::mjOBJ_XBODY => Reads::Body(id),
        MjtObjBase::mjOBJ_GEOM => body(model.geom_bodyid()[id]),
        MjtObjBase::mjOBJ_SITE => body(model.site_bodyid()[id]),
        _ => Reads::Other,
    }
}

/// The actuator that an element defines.
pub(super) fn drive(e: &Element, joints: &[Joint]) -> Drive {
    let joint = e.get("joint");
    let joint = joint.and_then(|name| joints.iter().position(|j| j.name == name));
    let kind = match e.tag.as_str() {
        "position" => DriveKind::Position,
        "velocity" => DriveKind::Velocity,
        _ if e.get("site").is_some() => DriveKind::Thrust,
        _ => DriveKind::Motor,
    };
    Drive {
        name: e.get("name").unwrap_or_default().to_owned(),
        kind,
        joint,
        gear: e.number("gear").unwrap_or(1.0),
        kp: e.number("kp").unwrap_or(1.0),
        kv: e
            .number("kv")
            .unwrap_or(f64::from(u8::from(kind == DriveKind::Velocity))),
        limit: match e.numbers("forcerange")[..] {
            [_, high] => high,
            _ => f64::INFINITY,
        },
    }
}
