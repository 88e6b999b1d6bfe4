//! Reads a plant from a scene's document.

use std::collections::BTreeMap;

use mjcf_rs::Model as Document;
use mjcf_rs::body::{Joint, JointType};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use super::drive::{Drive, Limits, law};
use super::limits;
use super::sensor::reads;
use super::{Plant, PlantBody, PlantGeom, PlantJoint};
use crate::document;
use crate::mass::{GeomMass, MassProperties};
use crate::memory;
use asid_core::error::Result;
use asid_core::layout::{JointKind, Layout};
use asid_core::scene::Scene;

impl Plant {
    /// Reads the plant of a scene.
    ///
    /// # Errors
    /// When the document is not valid MJCF.
    pub fn of(scene: &Scene) -> Result<Self> {
        let model = scene.description()?;
        let layout = document::layout(scene, &model)?;
        let mut bodies = Vec::with_capacity(model.bodies.len());
        let (mut joints, mut geoms) = (Vec::new(), Vec::new());
        for (i, entry) in model.bodies.iter().enumerate() {
            let body = &entry.body;
            let first = joints.len();
            joints.extend(body.joints.iter().map(|j| PlantJoint {
                body: i,
                anchor: j.pos,
                axis: unit(j.axis),
                reference: j.ref_,
                range: range(&model, j),
                damping: j.damping,
                frictionloss: j.frictionloss,
                armature: j.armature,
            }));
            geoms.extend(body.geoms.iter().map(|g| {
                let mass = GeomMass::of(g).filter(|_| i > 0 && body.inertial.is_none());
                PlantGeom {
                    body: i,
                    friction: g.friction,
                    condim: g.condim,
                    priority: g.priority,
                    has_mass: mass.is_some(),
                    mass: mass.as_ref().map_or(0.0, |m| m.mass),
                    center: mass.map_or([0.0; 3], |m| m.position.into()),
                }
            }));
            let (mass, center) = match &body.inertial {
                Some(inertial) => {
                    let p = inertial.pose.translation;
                    (inertial.mass, [p.x, p.y, p.z])
                }
                None => {
                    let masses: Vec<_> = body.geoms.iter().filter_map(GeomMass::of).collect();
                    let all = MassProperties::of_geoms(&masses);
                    (all.mass, all.center.into())
                }
            };
            let parent = entry.parent.unwrap_or(0);
            let weld = match entry.parent {
                Some(p) if body.joints.is_empty() => {
                    bodies.get(p).map_or(0, |b: &PlantBody| b.weld)
                }
                _ => i,
            };
            bodies.push(PlantBody {
                parent,
                joints: first..joints.len(),
                mass: if i == 0 { 0.0 } else { mass },
                center,
                weld,
            });
        }
        let sensors = model
            .sensors
            .iter()
            .map(|s| reads(&model, &layout, s))
            .collect();
        let contacts = contacts(&model, &layout, &bodies, &geoms);
        Ok(Self {
            drives: drives(scene, &model, &layout),
            layout,
            gravity: model.option.gravity,
            bodies,
            joints,
            geoms,
            sensors,
            contacts,
            force_limits: Vec::new(),
            poses: poses(&model),
        })
    }
}

/// Pose of each body in its parent.
fn poses(model: &Document) -> Vec<Isometry3<f64>> {
    let bodies = model.bodies.iter();
    bodies
        .map(|entry| {
            let (t, q) = (entry.body.pose.translation, entry.body.pose.rotation);
            let turn = Quaternion::new(q.w, q.x, q.y, q.z);
            Isometry3::from_parts(
                Translation3::new(t.x, t.y, t.z),
                UnitQuaternion::from_quaternion(turn),
            )
        })
        .collect()
}

/// An axis of length one, as engines compile it.
fn unit(axis: [f64; 3]) -> [f64; 3] {
    let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 {
        axis.map(|x| x / length)
    } else {
        axis
    }
}

/// The range of a limited hinge or slide.
fn range(model: &Document, joint: &Joint) -> Option<[f64; 2]> {
    let scalar = matches!(joint.type_, JointType::Hinge | JointType::Slide);
    let limited = joint
        .limited
        .resolve(model.compiler.autolimits, joint.range.is_some());
    joint
        .range
        .filter(|[low, high]| scalar && limited && low < high)
}

/// The drives of all actuators.
fn drives(scene: &Scene, model: &Document, layout: &Layout) -> Vec<Option<Drive>> {
    // Actuators that are attached from another document come after those of this one.
    let remember = memory::of_actuators(scene.xml()).into_iter();
    let remember = remember.chain(std::iter::repeat(false));
    let of_joints = limits::of_joints(scene.xml(), model.compiler.autolimits);
    let actuators = model.actuators.iter().zip(&layout.actuators);
    actuators
        .zip(remember)
        .map(|((a, place), remembers)| {
            let drive = drive(model, layout, a, (place.ctrl_range, &of_joints))?;
            Some(Drive { remembers, ..drive })
        })
        .collect()
}

/// The drive of an actuator with a range of its command; `of_joints` are limits of joints.
fn drive(
    model: &Document,
    layout: &Layout,
    actuator: &mjcf_rs::extras::Actuator,
    (ctrl_range, of_joints): (Option<[f64; 2]>, &BTreeMap<String, [f64; 2]>),
) -> Option<Drive> {
    let name = actuator.joint.as_deref()?;
    let joint = layout.joints.iter().position(|j| j.name == name)?;
    if !matches!(
        layout.joints[joint].kind,
        JointKind::Hinge | JointKind::Slide
    ) {
        return None;
    }
    let (law, gain) = law(actuator)?;
    let range = document::range(actuator.force_range);
    let limited = actuator
        .force_limited
        .resolve(model.compiler.autolimits, range.is_some());
    // The limit of a joint is one of the sum of its drives' forces.
    let others = model.actuators.iter().filter(|a| a.joint == actuator.joint);
    let alone = others.count() == 1;
    let limits = Limits {
        gain,
        own: range.filter(|_| limited),
        joint: of_joints.get(name).copied().filter(|_| alone),
    };
    let gear = gain * actuator.gear[0];
    Some(Drive {
        joint,
        law,
        gear,
        ctrl_range,
        force_range: limits.before(gear),
        remembers: false,
        limits,
    })
}

/// Pairs of geoms that can touch, by MuJoCo's rules.
///
/// Contact bits count in either direction. A body does not touch what it is welded to, nor its
/// parent (unless that is fixed). Excluded and explicit pairs are applied.
fn contacts(
    model: &Document,
    layout: &Layout,
    bodies: &[PlantBody],
    geoms: &[PlantGeom],
) -> Vec<[usize; 2]> {
    let all: Vec<_> = model.bodies.iter().flat_map(|b| &b.body.geoms).collect();
    let body = |name: &str| layout.bodies.iter().position(|b| b == name);
    let excluded: Vec<_> = model
        .contact
        .excludes
        .iter()
        .map(|e| (body(&e.body1), body(&e.body2)))
        .collect();
    let explicit: Vec<_> = model
        .contact
        .pairs
        .iter()
        .map(|p| {
            let find = |name: &str| layout.geoms.iter().position(|g| g == name);
            (find(&p.geom1), find(&p.geom2))
        })
        .collect();
    let mut found = Vec::new();
    for a in 0..geoms.len() {
        for b in a + 1..geoms.len() {
            let (p, q) = (geoms[a].body, geoms[b].body);
            let (u, v) = (bodies[p].weld, bodies[q].weld);
            let above = |w: usize| bodies[bodies[w].parent].weld;
            let family = (u != 0 && v != 0) && (u == above(v) || v == above(u));
            let bits = all[a].contype & all[b].conaffinity != 0
                || all[b].contype & all[a].conaffinity != 0;
            let among = |pairs: &[(Option<usize>, Option<usize>)], x: usize, y: usize| {
                pairs.contains(&(Some(x), Some(y))) || pairs.contains(&(Some(y), Some(x)))
            };
            let meets = bits && u != v && !family && !among(&excluded, p, q);
            if meets || among(&explicit, a, b) {
                found.push([a, b]);
            }
        }
    }
    found
}
