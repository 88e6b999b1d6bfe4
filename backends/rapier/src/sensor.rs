//! Sensors, with MuJoCo's meaning.
//!
//! As in MuJoCo, `objtype="body"` is the frame of the body's inertia, with its origin in the centre
//! of mass, and `xbody` is the frame of the body itself.

use asid_core::layout::Layout;
use asid_core::{Error, Result, Scene};
use asid_mjcf::memory;
use mjcf_rs::Model;
use nalgebra::{UnitQuaternion, Vector3};
use roxmltree::{Document, Node};

use crate::convert;
use crate::slot::Frame;

/// Quantity that is read of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// Position in the world, m.
    Position,
    /// Orientation w x y z.
    Orientation,
    /// One of its axes.
    Axis(usize),
    /// Velocity in the world frame, m/s.
    Velocity,
    /// Angular velocity in the world frame, rad/s.
    Rate,
    /// Velocity in its own frame, m/s.
    OwnVelocity,
    /// Angular velocity in its own frame, rad/s.
    OwnRate,
}

/// A sensor resolved in the scene.
#[derive(Clone, Debug)]
pub enum SensorSlot {
    /// Of a frame fixed in a body.
    Frame(Reading, Frame),
    /// Of a geom, which a parameter may move.
    Geom(Reading, usize),
    /// Of a body's centre of mass and principal axes.
    Inertia(Reading, usize),
    /// Coordinate of a joint.
    JointPosition(usize),
    /// Velocity of a joint.
    JointVelocity(usize),
    /// Simulated time, s.
    Clock,
    /// A sensor that this engine cannot read, with the reason.
    Unread(String),
}

impl SensorSlot {
    /// The sensors of a parsed scene, in its order.
    pub fn of_scene(scene: &Scene, model: &Model, layout: &Layout) -> Vec<Self> {
        // Sensors of attached documents come after those of this one.
        let late = late(scene.xml()).into_iter();
        let late = late.chain(std::iter::repeat(false));
        let sensors = model.sensors.iter().zip(late);
        sensors
            .map(|(sensor, late)| {
                if late {
                    Self::Unread("with a delay or an interval of its own".into())
                } else {
                    Self::of(sensor, model, layout)
                }
            })
            .collect()
    }

    fn of(sensor: &mjcf_rs::extras::Sensor, model: &Model, layout: &Layout) -> Self {
        let object = sensor.objname.as_deref().unwrap_or_default();
        let kind = sensor.kind.as_str();
        if sensor.refname.is_some() {
            return Self::Unread("relative to another frame".into());
        }
        if sensor.cutoff.is_some_and(|c| c > 0.0) {
            return Self::Unread("with a cutoff".into());
        }
        let joint = || layout.joints.iter().position(|j| j.name == object);
        let reading = match kind {
            "clock" => return Self::Clock,
            "jointpos" | "ballquat" => {
                return joint().map_or_else(|| missing("joint", object), Self::JointPosition);
            }
            "jointvel" | "ballangvel" => {
                return joint().map_or_else(|| missing("joint", object), Self::JointVelocity);
            }
            "framepos" => Reading::Position,
            "framequat" => Reading::Orientation,
            "framexaxis" => Reading::Axis(0),
            "frameyaxis" => Reading::Axis(1),
            "framezaxis" => Reading::Axis(2),
            "framelinvel" => Reading::Velocity,
            "frameangvel" => Reading::Rate,
            "velocimeter" => Reading::OwnVelocity,
            "gyro" => Reading::OwnRate,
            _ => return Self::Unread("of this kind".into()),
        };
        let body = || layout.bodies.iter().position(|b| b == object);
        match sensor.objtype.as_deref().unwrap_or_default() {
            "body" => body().map_or_else(|| missing("body", object), |b| Self::Inertia(reading, b)),
            "xbody" => body().map_or_else(
                || missing("body", object),
                |body| {
                    Self::Frame(
                        reading,
                        Frame {
                            body,
                            position: Vector3::zeros(),
                            rotation: UnitQuaternion::identity(),
                        },
                    )
                },
            ),
            "site" => model.site_by_name(object).map_or_else(
                || missing("site", object),
                |(body, i)| {
                    let (position, rotation) =
                        convert::parts(&model.bodies[body].body.sites[i].pose);
                    Self::Frame(
                        reading,
                        Frame {
                            body,
                            position,
                            rotation,
                        },
                    )
                },
            ),
            "geom" => layout
                .geoms
                .iter()
                .position(|g| g == object)
                .map_or_else(|| missing("geom", object), |g| Self::Geom(reading, g)),
            other => Self::Unread(format!("on objects of type `{other}`")),
        }
    }

    /// Refuses a sensor that this engine cannot read.
    ///
    /// # Errors
    /// [`Error::Incapable`], naming the sensor.
    pub fn check(&self, name: &str, kind: &str) -> Result<()> {
        match self {
            Self::Unread(why) => Err(Error::Incapable {
                backend: "rapier".into(),
                what: format!("read sensor `{name}` (<{kind}>): it reads none {why}"),
            }),
            _ => Ok(()),
        }
    }
}

/// Whether each sensor of a document reads an earlier moment: by its `delay`, or between two of its
/// `interval`.
fn late(xml: &str) -> Vec<bool> {
    let Ok(document) = Document::parse(xml) else {
        return Vec::new();
    };
    let root = document.root_element();
    let pauses = |node: Node<'_, '_>| {
        let interval = node.attribute("interval").unwrap_or("0");
        let first = interval.split_whitespace().next().map(str::parse::<f64>);
        first.is_some_and(|interval| interval != Ok(0.0))
    };
    let sections = root.children().filter(|n| n.has_tag_name("sensor"));
    let sensors = sections.flat_map(|s| s.children());
    sensors
        .filter(Node::is_element)
        .map(|node| memory::delay(root, node) != 0.0 || pauses(node))
        .collect()
}

fn missing(kind: &str, name: &str) -> SensorSlot {
    SensorSlot::Unread(format!("of a {kind} that is not there (`{name}`)"))
}
