//! Prepares the document for rapier's loader, and hides from it what this crate does itself.

use asid_core::layout::Layout;
use asid_core::{Result, Scene};
use asid_mjcf::mass::GeomMass;
use asid_mjcf::plant::{DriveLaw, law};
use mjcf_rs::Model;
use mjcf_rs::equality::Equality;
use mjcf_rs::extras::ActuatorKind;
use rapier3d::dynamics::RigidBodyBuilder;
use rapier3d::geometry::{Group, InteractionGroups, InteractionTestMode};
use rapier3d_mjcf::{MjcfBody, MjcfRobot};

use crate::convert;
use crate::slot::{ActuatorSlot, Frame};

/// Contact bits of each geom. Geoms of an explicit pair pass them all, and the table of pairs
/// decides.
pub fn groups(model: &Model) -> Vec<InteractionGroups> {
    let paired: Vec<&str> = model
        .contact
        .pairs
        .iter()
        .flat_map(|p| [p.geom1.as_str(), p.geom2.as_str()])
        .collect();
    let geoms = model.bodies.iter().flat_map(|b| &b.body.geoms);
    geoms
        .map(|geom| {
            let named = geom.name.as_deref();
            let (member, filter) = if named.is_some_and(|n| paired.contains(&n)) {
                (Group::ALL, Group::ALL)
            } else {
                (Group::from(geom.contype), Group::from(geom.conaffinity))
            };
            InteractionGroups::new(member, filter, InteractionTestMode::Or)
        })
        .collect()
}

/// Gives each tree that stands on the world a fixed root body of its own.
///
/// With the world's body as a common root, all trees would form one tree with one large mass
/// matrix. Objects on the floor would then be solved as if they touched a link. Trees whose joints
/// are coupled by an equality must be in one tree and stay together.
pub fn give_roots(robot: &mut MjcfRobot) {
    let together = !robot.joint_couplings.is_empty();
    let mut root = None;
    for joint in 0..robot.joints.len() {
        if robot.joints[joint].link1 != 0 {
            continue;
        }
        let at = match root {
            Some(at) if together => at,
            _ => {
                robot.bodies.push(MjcfBody {
                    name: None,
                    is_intermediate: true,
                    mjcf_body_id: 0,
                    body: RigidBodyBuilder::fixed().build(),
                    colliders: Vec::new(),
                    gravcomp: 0.0,
                    mass: 0.0,
                    visual_meshes: Vec::new(),
                });
                robot.bodies.len() - 1
            }
        };
        root = Some(at);
        robot.joints[joint].link1 = at;
    }
}

/// Frame of every geom in its body, with `fromto` resolved.
pub fn geom_frames(model: &Model) -> Vec<Frame> {
    let mut frames = Vec::new();
    for (body, entry) in model.bodies.iter().enumerate() {
        for geom in &entry.body.geoms {
            let (position, rotation) = match GeomMass::of(geom) {
                Some(mass) => (mass.position, mass.rotation),
                None => convert::parts(&geom.pose),
            };
            frames.push(Frame {
                body,
                position,
                rotation,
            });
        }
    }
    frames
}

/// Actuators with their joints and limits.
///
/// # Errors
/// When one names a joint that does not exist.
pub fn actuators(model: &Model, layout: &Layout) -> Result<Vec<ActuatorSlot>> {
    let mut slots = Vec::with_capacity(model.actuators.len());
    for (actuator, place) in model.actuators.iter().zip(&layout.actuators) {
        let name = actuator.joint.as_deref().unwrap_or_default();
        layout.joint(name)?;
        let force_range = asid_mjcf::document::range(actuator.force_range);
        let limited = actuator
            .force_limited
            .resolve(model.compiler.autolimits, force_range.is_some());
        // Other laws are refused before.
        let (law, gain) = law(actuator).unwrap_or((DriveLaw::Motor, 1.0));
        slots.push(ActuatorSlot {
            kind: match law {
                DriveLaw::Motor => ActuatorKind::Motor,
                DriveLaw::Position { .. } => ActuatorKind::Position,
                DriveLaw::Velocity { .. } => ActuatorKind::Velocity,
            },
            gain,
            joint: layout
                .joints
                .iter()
                .position(|j| j.name == name)
                .unwrap_or_default(),
            ctrl_range: place.ctrl_range,
            force_range: force_range.filter(|_| limited),
        });
    }
    Ok(slots)
}

/// Corrects what the parser misreads: the friction of a `<pair>` has two sliding and two rolling
/// entries, and an equality may name the world.
///
/// # Errors
/// A pair whose friction differs by direction, or is left to a default class.
pub fn correct(scene: &Scene, model: &mut Model) -> std::result::Result<(), String> {
    for equality in &mut model.equality {
        let second = match equality {
            Equality::Connect(c) => &mut c.body2,
            Equality::Weld(w) => &mut w.body2,
            Equality::Joint(_) | Equality::Tendon(_) => continue,
        };
        if second.as_deref() == Some("world") {
            *second = None;
        }
    }
    let document = roxmltree::Document::parse(scene.xml()).map_err(|e| e.to_string())?;
    let nodes = document.descendants().filter(|n| n.has_tag_name("pair"));
    let (elements, defaults): (Vec<_>, Vec<_>) =
        nodes.partition(|n| n.parent().is_some_and(|p| p.has_tag_name("contact")));
    if defaults.iter().any(|n| n.has_attribute("friction")) {
        return Err("takes the friction of a <pair> from itself, not from a default".into());
    }
    for (node, pair) in elements.iter().zip(&mut model.contact.pairs) {
        let Some(text) = node.attribute("friction") else {
            continue;
        };
        let values: Vec<f64> = text
            .split_whitespace()
            .filter_map(|v| v.parse().ok())
            .collect();
        let entry = |i: usize, otherwise: f64| values.get(i).copied().unwrap_or(otherwise);
        let rolling = entry(3, 1e-4);
        if entry(0, 1.0) != entry(1, 1.0) || rolling != entry(4, rolling) {
            return Err(format!(
                "has the same friction in both directions, unlike <pair> `{}` `{}`",
                pair.geom1, pair.geom2
            ));
        }
        pair.friction = Some([entry(0, 1.0), entry(2, 0.005), rolling]);
    }
    Ok(())
}

/// Checks that equalities name existing bodies and joints.
///
/// # Errors
/// The missing name.
pub fn check_equalities(model: &Model) -> std::result::Result<(), String> {
    let body = |name: &str| {
        model.body_id_by_name(name).map(|_| ()).ok_or(format!(
            "an equality names body `{name}`, which is not there"
        ))
    };
    let joint = |name: &str| {
        model.joint_by_name(name).map(|_| ()).ok_or(format!(
            "an equality names joint `{name}`, which is not there"
        ))
    };
    for equality in &model.equality {
        match equality {
            Equality::Connect(c) => {
                body(&c.body1)?;
                c.body2.as_deref().map_or(Ok(()), body)?;
            }
            Equality::Weld(w) => {
                body(&w.body1)?;
                w.body2.as_deref().map_or(Ok(()), body)?;
            }
            Equality::Joint(j) => {
                joint(&j.joint1)?;
                j.joint2.as_deref().map_or(Ok(()), joint)?;
            }
            Equality::Tendon(_) => {}
        }
    }
    Ok(())
}

/// Names that the loader sees. The loader finds elements by name and skips unnamed ones, so every
/// geom and joint gets a unique name.
pub struct Places;

impl Places {
    /// Name of a geom.
    pub fn geom(&self, index: usize) -> String {
        format!("\u{1}geom{index}")
    }

    /// Name of a joint.
    pub fn joint(&self, index: usize) -> String {
        format!("\u{1}joint{index}")
    }
}

/// Gives every geom and joint its name for the loader, and removes what this backend does itself:
/// actuators, sensors, keyframes, contact filters, and springs, damping and friction of joints.
pub fn rename(model: &mut Model) -> Places {
    let places = Places;
    let paired: Vec<String> = (model.contact.pairs.iter())
        .flat_map(|p| [p.geom1.clone(), p.geom2.clone()])
        .collect();
    let (mut geom_count, mut joint_count) = (0, 0);
    let mut new_names = Vec::new();
    for entry in &mut model.bodies {
        for geom in &mut entry.body.geoms {
            // A geom that touches only by an explicit pair needs a shape too.
            if geom.name.as_ref().is_some_and(|n| paired.contains(n)) && geom.conaffinity == 0 {
                geom.contype = geom.contype.max(1);
            }
            geom.name = Some(places.geom(geom_count));
            geom_count += 1;
        }
        for joint in &mut entry.body.joints {
            let name = places.joint(joint_count);
            joint_count += 1;
            if let Some(old) = joint.name.replace(name.clone()) {
                new_names.push((old, name));
            }
            joint.damping = 0.0;
            joint.stiffness = 0.0;
            joint.frictionloss = 0.0;
            joint.armature = 0.0;
        }
    }
    let renamed = |old: &str| {
        new_names
            .iter()
            .find(|(name, _)| name == old)
            .map_or_else(|| old.to_owned(), |(_, new)| new.clone())
    };
    for equality in &mut model.equality {
        if let Equality::Joint(joint) = equality {
            joint.joint1 = renamed(&joint.joint1);
            joint.joint2 = joint.joint2.as_deref().map(renamed);
            // The loader takes the second joint as a function of the first; in MJCF the first is a
            // function of the second.
            if let Some(second) = joint.joint2.as_mut() {
                std::mem::swap(&mut joint.joint1, second);
            }
        }
    }
    model.actuators.clear();
    model.sensors.clear();
    model.keyframes.clear();
    model.contact = mjcf_rs::contact::Contact::default();
    places
}
