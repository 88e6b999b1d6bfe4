//! Finds what no engine could interpret, before any engine is called.

use std::collections::HashSet;

use asid_core::layout::Layout;
use mjcf_rs::Model;
use mjcf_rs::body::{Geom, GeomType, JointType};

use super::{sites, tree};
use crate::table::{Body, Joint};

/// Smallest mass of a moving body, kg; the same as MuJoCo's.
const SMALLEST_MASS: f64 = 1e-15;

/// Refuses ambiguous names, and shapes, masses and numbers without a meaning.
///
/// # Errors
/// What is wrong, in one line.
pub fn check(model: &Model, layout: &Layout) -> Result<(), String> {
    let joints = layout.joints.iter().map(|j| &j.name);
    unique("body", layout.bodies.iter())?;
    unique("geom", layout.geoms.iter())?;
    unique("joint", joints)?;
    unique("site", sites(model).filter_map(|(_, s)| s.name.as_ref()))?;
    unique("actuator", layout.actuators.iter().map(|a| &a.name))?;
    unique("sensor", layout.sensors.iter().map(|s| &s.name))?;
    unique("key", layout.keyframes.iter().map(|k| &k.name))?;

    if !(layout.timestep.is_finite() && layout.timestep > 0.0) {
        return Err(format!("the time step is {} s", layout.timestep));
    }
    finite("the gravity", &model.option.gravity)?;
    let mut geom_names = layout.geoms.iter();
    let mut joint_names = layout.joints.iter();
    for (i, entry) in model.bodies.iter().enumerate() {
        let body = &entry.body;
        let name = format!("body `{}`", layout.bodies[i]);
        finite(&name, &numbers(&body.pose))?;
        if let Some(inertial) = &body.inertial {
            finite(&name, &numbers(&inertial.pose))?;
            if !(inertial.mass.is_finite() && inertial.mass >= 0.0) {
                return Err(format!("{name} has a mass of {} kg", inertial.mass));
            }
        }
        for (geom, name) in body.geoms.iter().zip(geom_names.by_ref()) {
            shape(geom, model).map_err(|why| format!("geom `{name}` {why}"))?;
        }
        for (joint, place) in body.joints.iter().zip(joint_names.by_ref()) {
            let name = format!("joint `{}`", place.name);
            finite(&name, &joint.pos)?;
            finite(&name, &joint.axis)?;
            finite(&name, &[joint.ref_, joint.springref, joint.stiffness])?;
            for value in [joint.damping, joint.armature, joint.frictionloss] {
                if !(value.is_finite() && value >= 0.0) {
                    return Err(format!("{name}: {value} is not zero or more"));
                }
            }
            let turns = matches!(joint.type_, JointType::Hinge | JointType::Slide);
            if turns && joint.axis.iter().all(|&a| a == 0.0) {
                return Err(format!("{name} has no axis"));
            }
            if joint.type_ == JointType::Free && (entry.parent != Some(0) || body.joints.len() > 1)
            {
                return Err(format!(
                    "{name} is a free joint, which must be the only one of a body in the world"
                ));
            }
        }
    }
    Ok(())
}

/// Refuses a duplicate name.
fn unique<'a>(kind: &str, names: impl Iterator<Item = &'a String>) -> Result<(), String> {
    let mut seen = HashSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(format!("the name {kind} `{name}` is there a second time"));
        }
    }
    Ok(())
}

fn finite(what: &str, values: &[f64]) -> Result<(), String> {
    match values.iter().find(|v| !v.is_finite()) {
        Some(value) => Err(format!("{what}: {value} is not a number to compute with")),
        None => Ok(()),
    }
}

fn numbers(pose: &mjcf_rs::Pose) -> [f64; 7] {
    let (p, q) = (pose.translation, pose.rotation);
    [p.x, p.y, p.z, q.w, q.x, q.y, q.z]
}

/// Refuses a shape without an extent, and a mesh or height field that does not exist.
fn shape(geom: &Geom, model: &Model) -> Result<(), String> {
    let size = tree::size(geom);
    finite("has a pose or size without a value", &numbers(&geom.pose))?;
    finite("has a size without a value", &size)?;
    let lengths = match geom.type_ {
        GeomType::Sphere => 1,
        GeomType::Capsule | GeomType::Cylinder => 2,
        GeomType::Box | GeomType::Ellipsoid => 3,
        GeomType::Plane | GeomType::Hfield | GeomType::Mesh | GeomType::Sdf => 0,
    };
    if size[..lengths].iter().any(|&s| s <= 0.0) {
        return Err(format!("needs {lengths} positive numbers for its size"));
    }
    if let Some(mass) = geom.mass.or(geom.density)
        && !(mass.is_finite() && mass >= 0.0)
    {
        return Err(format!("has a mass or density of {mass}"));
    }
    if let Some(mesh) = &geom.mesh
        && !model
            .assets
            .meshes
            .iter()
            .any(|m| m.name.as_ref() == Some(mesh))
    {
        return Err(format!("names mesh `{mesh}`, which is not there"));
    }
    Ok(())
}

/// Finds a moving body whose total mass, with its rigid attachments, is zero.
///
/// Meshes count as having a mass, which is not known here.
pub fn weightless(model: &Model, bodies: &[Body], joints: &[Joint]) -> Option<usize> {
    let moves = |body: usize| joints.iter().any(|j| j.body == body as u64);
    // The nearest body with a joint, itself or an ancestor, carries a body.
    let mut carried = vec![0.0; bodies.len()];
    for body in 1..bodies.len() {
        let mut carrier = body;
        while carrier != 0 && !moves(carrier) {
            carrier = usize::try_from(bodies[carrier].parent).unwrap_or(0);
        }
        let mut geoms = model.bodies[body].body.geoms.iter();
        let solid = geoms.any(|g| matches!(g.type_, GeomType::Mesh | GeomType::Sdf));
        carried[carrier] += bodies[body].mass + if solid { 1.0 } else { 0.0 };
    }
    (1..bodies.len()).find(|&b| moves(b) && carried[b] < SMALLEST_MASS)
}
