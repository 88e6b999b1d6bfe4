//! A loaded scene: what the engine keeps of a document.

use std::sync::Arc;

use asid_core::layout::{Channel, JointKind, Recording};
use asid_core::mjcf_rs::body::{GeomType, InertiaSpec};
use asid_core::nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use asid_core::{BatchConfig, Error, Layout, Model, Result, Scene, Simulator, Target, mjcf_rs};
use asid_mjcf::document;
use asid_mjcf::mass::{GeomMass, MassProperties};

use crate::flight::Body;
use crate::refusal;
use crate::simulator::FlightSimulator;

/// Data that all batches of a scene share.
pub struct Compiled {
    /// Names and indices.
    pub layout: Layout,
    /// Bodies on free joints, in the order of their joints.
    pub bodies: Vec<Body>,
    /// Index of each of these bodies in [`Layout::bodies`].
    pub places: Vec<usize>,
    /// Frame that each sensor reads; `None` if this engine cannot read it.
    pub frames: Vec<Option<Frame>>,
    /// Gravity, m/s².
    pub gravity: Vector3<f64>,
    /// Positions after a reset.
    pub start: Vec<f64>,
}

/// A frame on a flying body.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Index into [`Compiled::bodies`].
    pub body: usize,
    /// Its origin in the body's frame, m.
    pub position: Vector3<f64>,
    /// `body_from_frame`.
    pub rotation: UnitQuaternion<f64>,
}

/// The quantity that a parameter changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Column {
    /// A component of gravity.
    Gravity(usize),
    /// Mass of one of [`Compiled::bodies`]; its inertia scales with it.
    Mass(usize),
}

/// A loaded scene.
pub struct FlightModel {
    compiled: Arc<Compiled>,
}

impl FlightModel {
    /// Loads a scene.
    ///
    /// # Errors
    /// [`Error::Scene`] for everything that this engine would have to ignore: joints that are not
    /// free, shapes that could collide, and everything that `refusal` names.
    pub fn load(scene: &Scene) -> Result<Self> {
        let refuse = |message: String| Error::Scene {
            scene: scene.name().to_owned(),
            message,
        };
        let document = scene.description()?;
        let layout = document::layout(scene, &document)?;
        if let Some(joint) = layout.joints.iter().find(|j| j.kind != JointKind::Free) {
            return Err(refuse(format!(
                "joint `{}` is not free; this engine flies free bodies only",
                joint.name
            )));
        }
        if let Some(what) = refusal::lacking(scene, &document) {
            return Err(refuse(what));
        }
        let mut geoms = document.bodies.iter().flat_map(|b| &b.body.geoms);
        if geoms.any(|g| matches!(g.type_, GeomType::Mesh | GeomType::Hfield)) {
            return Err(refuse(
                "this engine has no meshes and no height fields".into(),
            ));
        }
        let meets = |g: &mjcf_rs::body::Geom| g.contype != 0 || g.conaffinity != 0;
        let with_geoms = document.bodies.iter();
        if with_geoms
            .filter(|b| b.body.geoms.iter().any(meets))
            .count()
            > 1
        {
            return Err(refuse(
                "this engine has no contact; give geoms contype=\"0\" conaffinity=\"0\"".into(),
            ));
        }
        let mut bodies = Vec::new();
        let mut places = Vec::new();
        for (i, entry) in document.bodies.iter().enumerate().skip(1) {
            if entry.body.joints.is_empty() {
                continue;
            }
            let mass = mass_of(&entry.body);
            let inverse = mass.inertia.try_inverse().filter(|_| mass.mass > 0.0);
            bodies.push(Body {
                mass: mass.mass,
                center: mass.center,
                inertia: mass.inertia,
                inverse: inverse.ok_or_else(|| {
                    refuse(format!("body `{}` flies without a mass", layout.bodies[i]))
                })?,
            });
            places.push(i);
        }
        let frames = frames(&document, &layout, &places, &bodies);
        let [x, y, z] = document.option.gravity;
        let start = match layout.keyframes.first() {
            Some(key) => key.qpos.clone(),
            None => document::default_qpos(&document, &layout),
        };
        Ok(Self {
            compiled: Arc::new(Compiled {
                gravity: Vector3::new(x, y, z),
                bodies,
                places,
                frames,
                start,
                layout,
            }),
        })
    }
}

/// Mass properties, as stated in the document or computed from the geoms.
fn mass_of(body: &mjcf_rs::body::Body) -> MassProperties {
    let Some(inertial) = &body.inertial else {
        let geoms: Vec<GeomMass> = body.geoms.iter().filter_map(GeomMass::of).collect();
        return MassProperties::of_geoms(&geoms);
    };
    let (center, rotation) = pose(&inertial.pose);
    let own = match inertial.inertia {
        InertiaSpec::Diagonal(d) => Matrix3::from_diagonal(&Vector3::from(d)),
        InertiaSpec::Full([xx, yy, zz, xy, xz, yz]) => {
            Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
        }
    };
    let turn = rotation.to_rotation_matrix().into_inner();
    MassProperties {
        mass: inertial.mass,
        center,
        inertia: turn * own * turn.transpose(),
    }
}

fn pose(pose: &mjcf_rs::Pose) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let (p, q) = (pose.translation, pose.rotation);
    (
        Vector3::new(p.x, p.y, p.z),
        UnitQuaternion::from_quaternion(Quaternion::new(q.w, q.x, q.y, q.z)),
    )
}

/// Axes of a body's principal moments, as stated in the document or computed from the inertia.
fn axes_of(body: &mjcf_rs::body::Body) -> UnitQuaternion<f64> {
    match &body.inertial {
        Some(inertial) if matches!(inertial.inertia, InertiaSpec::Diagonal(_)) => {
            pose(&inertial.pose).1
        }
        _ => mass_of(body).principal().1,
    }
}

/// The frame of every sensor.
///
/// A sensor of another kind does not make the engine refuse the scene. The engine refuses to record
/// it.
fn frames(
    document: &mjcf_rs::Model,
    layout: &Layout,
    places: &[usize],
    bodies: &[Body],
) -> Vec<Option<Frame>> {
    const KINDS: [&str; 4] = ["framepos", "framequat", "framelinvel", "frameangvel"];
    let frame = |sensor: &mjcf_rs::extras::Sensor| {
        let cut = sensor.cutoff.is_some_and(|cutoff| cutoff > 0.0);
        if !KINDS.contains(&sensor.kind.as_str()) || sensor.refname.is_some() || cut {
            return None;
        }
        let name = sensor.objname.as_deref()?;
        let flying = |body: usize| places.iter().position(|&p| p == body);
        match sensor.objtype.as_deref()? {
            kind @ ("body" | "xbody") => {
                let at = layout.bodies.iter().position(|body| body == name)?;
                let body = flying(at)?;
                let of_mass = kind == "body";
                Some(Frame {
                    body,
                    position: match of_mass {
                        true => bodies[body].center,
                        false => Vector3::zeros(),
                    },
                    rotation: match of_mass {
                        true => axes_of(&document.bodies[at].body),
                        false => UnitQuaternion::identity(),
                    },
                })
            }
            "site" => {
                let (at, site) = document.site_by_name(name)?;
                let (position, rotation) = pose(&document.bodies[at].body.sites[site].pose);
                Some(Frame {
                    body: flying(at)?,
                    position,
                    rotation,
                })
            }
            _ => None,
        }
    };
    document.sensors.iter().map(frame).collect()
}

impl Compiled {
    /// Refuses to record what this engine cannot read.
    ///
    /// # Errors
    /// [`Error::Incapable`], naming the sensor.
    pub fn check_readings(&self, record: &Recording) -> Result<()> {
        for channel in record.channels() {
            let what = match *channel {
                Channel::ContactForce { .. } => "record contact forces".to_owned(),
                Channel::Sensor { index } if self.frames[index].is_none() => {
                    let sensor = &self.layout.sensors[index];
                    format!("read sensor `{}` ({})", sensor.name, sensor.kind)
                }
                _ => continue,
            };
            return Err(Error::Incapable {
                backend: "free-flight".into(),
                what,
            });
        }
        Ok(())
    }

    /// The quantity that a target changes, and its value in the scene.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a target that this engine does not know.
    pub fn resolve(&self, target: &Target) -> Result<(Column, f64)> {
        let parts = (
            target.element.as_str(),
            target.attribute.as_str(),
            target.index,
        );
        let flying = || {
            let at = self.layout.body(&target.name).ok()?;
            self.places.iter().position(|&p| p == at)
        };
        match (parts, flying()) {
            (("option", "gravity", i @ 0..3), _) => Ok((Column::Gravity(i), self.gravity[i])),
            (("body", "mass", 0), Some(body)) => Ok((Column::Mass(body), self.bodies[body].mass)),
            _ => Err(Error::Parameter {
                parameter: target.to_string(),
                message: "this engine changes option/gravity/{0,1,2} and body/NAME/mass".into(),
            }),
        }
    }
}

impl Model for FlightModel {
    fn layout(&self) -> &Layout {
        &self.compiled.layout
    }

    fn nominal(&self, target: &Target) -> Result<f64> {
        Ok(self.compiled.resolve(target)?.1)
    }

    fn simulator(&self, config: &BatchConfig) -> Result<Box<dyn Simulator>> {
        Ok(Box::new(FlightSimulator::new(
            self.compiled.clone(),
            config,
        )?))
    }
}
