//! Finds what this backend cannot simulate, in the document and before the loader reads it.
//!
//! Loaders skip what they do not know. A part that changes the physics must not be skipped
//! silently, so this module looks for it by name and refuses it with one line. Settings of another
//! engine's solver (`solref`, `solimp`, `impratio`, integrators) are not physics of the scene and
//! pass. The exception is a contact whose damping is so low that it makes bodies bounce.

mod attached;
mod attribute;

use std::collections::HashSet;

use asid_core::{Error, Result, Scene};
use asid_mjcf::document::is_of_higher_order;
use asid_mjcf::plant::law;
use mjcf_rs::Model;
use mjcf_rs::body::{GeomType, JointType};
use mjcf_rs::equality::Equality;
use mjcf_rs::extras::ActuatorKind;
use roxmltree::Node;

/// Elements that change the physics and that this backend lacks.
const ELEMENTS: [&str; 13] = [
    "tendon",
    "flex",
    "flexcomp",
    "composite",
    "plugin",
    "extension",
    "muscle",
    "adhesion",
    "cylinder",
    "damper",
    "intvelocity",
    "dcmotor",
    "replicate",
];

fn refuse(scene: &Scene, message: String) -> Error {
    Error::Scene {
        scene: scene.name().to_owned(),
        message: format!("backend `rapier` {message}"),
    }
}

/// Refuses a document with parts that this backend would omit.
///
/// # Errors
/// [`Error::Scene`], naming the first such part and its line.
pub fn check(scene: &Scene, model: &Model) -> Result<()> {
    check_document(scene, None)?;
    attached::check(scene)?;
    check_bodies(scene, model)?;
    check_actuators(scene, model)?;
    for equality in &model.equality {
        if let Equality::Tendon(_) = equality {
            return Err(refuse(scene, "has no tendons (<equality><tendon>)".into()));
        }
        if let Equality::Joint(joint) = equality
            && (joint.joint2.is_none() || joint.polycoef[2..].iter().any(|&c| c != 0.0))
        {
            return Err(refuse(
                scene,
                "couples joints only linearly and in pairs (<equality><joint>)".into(),
            ));
        }
    }
    Ok(())
}

/// The kind within which a name must be unique; `None` where names are not looked up.
fn named_kind(node: &Node<'_, '_>) -> Option<&'static str> {
    let within = |tag: &str| node.ancestors().skip(1).any(|a| a.has_tag_name(tag));
    match node.tag_name().name() {
        "body" if within("worldbody") => Some("body"),
        "geom" if within("worldbody") => Some("geom"),
        "site" if within("worldbody") => Some("site"),
        "joint" | "freejoint" if within("worldbody") => Some("joint"),
        _ if within("actuator") => Some("actuator"),
        _ if within("sensor") => Some("sensor"),
        _ => None,
    }
}

/// Checks the elements of a document; of one that another attaches, those that belong to `bodies`.
fn check_document(scene: &Scene, bodies: Option<&[&str]>) -> Result<()> {
    let document = roxmltree::Document::parse(scene.xml())
        .map_err(|e| refuse(scene, format!("cannot read it: {e}")))?;
    let place = |node: &Node<'_, '_>| {
        let name = node.attribute("name").map(|n| format!(" `{n}`"));
        let line = document.text_pos_at(node.range().start).row;
        format!(
            "<{}>{} on line {line}",
            node.tag_name().name(),
            name.unwrap_or_default()
        )
    };
    let mut names = HashSet::new();
    let counts = |n: &Node<'_, '_>| bodies.is_none_or(|bodies| attached::is_taken(n, bodies));
    let elements = document.descendants().filter(Node::is_element);
    for node in elements.filter(counts) {
        let tag = node.tag_name().name();
        if let (Some(kind), Some(name)) = (named_kind(&node), node.attribute("name"))
            && !names.insert((kind, name))
        {
            return Err(refuse(
                scene,
                format!("finds the name of {} a second time", place(&node)),
            ));
        }
        let in_actuators = node.parent().is_some_and(|p| p.has_tag_name("actuator"));
        // Mesh wrappers and defaults may share a name with an actuator.
        let ambiguous = ["cylinder", "plugin", "damper", "muscle"].contains(&tag);
        let in_defaults = node.ancestors().any(|a| a.has_tag_name("default"));
        if ELEMENTS.contains(&tag) && !in_defaults && (!ambiguous || in_actuators) {
            return Err(refuse(scene, format!("cannot simulate {}", place(&node))));
        }
        if let Some(attribute) = attribute::refused(&node, bodies.is_some()) {
            let what = format!("cannot honour `{attribute}` of {}", place(&node));
            return Err(refuse(scene, what));
        }
        if let Some(attribute) = of_higher_order(&node) {
            return Err(refuse(
                scene,
                format!(
                    "has only the linear coefficient of `{attribute}` of {}",
                    place(&node)
                ),
            ));
        }
        let collides = ["contype", "conaffinity"]
            .iter()
            .any(|a| node.attribute(*a) != Some("0"));
        if (tag == "geom" && collides || tag == "pair")
            && let Some(back) = node.attribute("solref").and_then(restitution)
            && back > BOUNCE
        {
            return Err(refuse(
                scene,
                format!(
                    "cannot bounce: by its `solref` {} throws bodies back with {back:.2} of their speed",
                    place(&node)
                ),
            ));
        }
        let fluid = ["wind", "density", "viscosity"];
        if tag == "option"
            && let Some(attribute) = fluid.iter().find(|a| {
                node.attribute(**a).is_some_and(|v| {
                    v.split_whitespace()
                        .any(|x| x.parse::<f64>().is_ok_and(|x| x != 0.0))
                })
            })
        {
            return Err(refuse(
                scene,
                format!("has no fluid: `{attribute}` of {}", place(&node)),
            ));
        }
        if tag == "flag"
            && let Some(flag) = refused_flag(&node)
        {
            let what = format!("cannot honour `{flag}` of {}", place(&node));
            return Err(refuse(scene, what));
        }
    }
    Ok(())
}

/// The attribute of a joint that has coefficients of higher order.
fn of_higher_order(node: &Node<'_, '_>) -> Option<&'static str> {
    let mut both = ["stiffness", "damping"].into_iter();
    both.find(|a| node.has_tag_name("joint") && node.attribute(*a).is_some_and(is_of_higher_order))
}

/// Flags of MuJoCo's solver, which do not affect the physics.
const SOLVER: [&str; 14] = [
    "warmstart",
    "filterparent",
    "refsafe",
    "energy",
    "midphase",
    "nativeccd",
    "island",
    "multiccd",
    "eulerdamp",
    "autoreset",
    "sensor",
    "invdiscrete",
    "fwdinv",
    "sleep",
];

/// The flag of a `<flag>` that disables physics which this backend always has.
fn refused_flag<'a>(node: &Node<'a, '_>) -> Option<&'a str> {
    let refused = node.attributes().find(|attribute| {
        let disables = attribute.value() == "disable" || attribute.name() == "override";
        let name = attribute.name();
        disables && (name == "filterparent" || !SOLVER.contains(&name))
    });
    refused.map(|attribute| attribute.name())
}

/// A contact is refused if its `solref` returns more than this share of the impact speed, because
/// rapier's contacts do not bounce.
const BOUNCE: f64 = 0.1;

/// Coefficient of restitution of an impact on a spring and damper, `exp(-pi z / sqrt(1 - z^2))`
/// with the damping ratio `z`.
///
/// `solref` holds the time constant and the damping ratio. If negative, it holds stiffness and
/// damping for a unit of mass, so that `z = damping / (2 sqrt(stiffness))`.
fn restitution(solref: &str) -> Option<f64> {
    let mut numbers = solref.split_whitespace().map(str::parse::<f64>);
    let (first, second) = (numbers.next()?.ok()?, numbers.next()?.ok()?);
    let ratio = if first < 0.0 {
        -second / (2.0 * (-first).sqrt())
    } else {
        second
    };
    Some(if ratio < 1.0 {
        (-std::f64::consts::PI * ratio / (1.0 - ratio * ratio).sqrt()).exp()
    } else {
        0.0
    })
}

fn check_bodies(scene: &Scene, model: &Model) -> Result<()> {
    for entry in &model.bodies {
        let body = &entry.body;
        let name = body.name.as_deref().unwrap_or("without a name");
        if body.mocap {
            return Err(refuse(scene, format!("cannot move mocap body `{name}`")));
        }
        for joint in &body.joints {
            let joint_name = joint.name.as_deref().unwrap_or("without a name");
            let limited = joint
                .limited
                .resolve(model.compiler.autolimits, joint.range.is_some());
            let passive = joint.damping != 0.0
                || joint.armature != 0.0
                || joint.frictionloss != 0.0
                || joint.stiffness != 0.0;
            // Zeros of a joint overrule what its class says.
            let timed = joint
                .springdamper
                .is_some_and(|s| s.iter().any(|x| *x != 0.0));
            match joint.type_ {
                _ if timed => {
                    return Err(refuse(
                        scene,
                        format!("cannot honour `springdamper` of joint `{joint_name}`"),
                    ));
                }
                JointType::Free if body.joints.len() > 1 => {
                    return Err(refuse(
                        scene,
                        format!("allows no other joint beside free joint `{joint_name}`"),
                    ));
                }
                JointType::Free if passive => {
                    return Err(refuse(
                        scene,
                        format!("cannot damp, spring or weigh down free joint `{joint_name}`"),
                    ));
                }
                JointType::Ball if limited || joint.stiffness != 0.0 => {
                    return Err(refuse(
                        scene,
                        format!("cannot limit or spring ball joint `{joint_name}`"),
                    ));
                }
                _ => {}
            }
        }
        for geom in &body.geoms {
            let paired = (model.contact.pairs.iter())
                .any(|p| [Some(&p.geom1), Some(&p.geom2)].contains(&geom.name.as_ref()));
            let collides = paired || geom.contype != 0 || geom.conaffinity != 0;
            let primitive = !matches!(
                geom.type_,
                GeomType::Mesh | GeomType::Hfield | GeomType::Sdf | GeomType::Ellipsoid
            );
            if collides && !primitive {
                return Err(refuse(
                    scene,
                    format!(
                        "has no contact for geom `{}` ({:?}): use boxes, spheres, capsules, cylinders and planes",
                        geom.name.as_deref().unwrap_or("without a name"),
                        geom.type_
                    ),
                ));
            }
        }
    }
    Ok(())
}

fn check_actuators(scene: &Scene, model: &Model) -> Result<()> {
    for (i, actuator) in model.actuators.iter().enumerate() {
        let name = actuator.name.clone().unwrap_or(format!("actuator{i}"));
        // A servo without a gain is none, and does nothing.
        let servo = matches!(
            actuator.kind,
            ActuatorKind::Position | ActuatorKind::Velocity
        );
        if !servo && law(actuator).is_none() {
            return Err(refuse(
                scene,
                format!("drives only motors, position and velocity servos, not actuator `{name}`"),
            ));
        }
        let slope = actuator.biasprm.get(2).is_some_and(|slope| *slope > 0.0);
        if slope && actuator.kv.is_none() && actuator.kind != ActuatorKind::Motor {
            return Err(refuse(
                scene,
                format!("cannot honour the damping ratio (`biasprm`) of actuator `{name}`"),
            ));
        }
        let Some(joint) = actuator.joint.as_deref() else {
            return Err(refuse(
                scene,
                format!("drives joints only: actuator `{name}` names none"),
            ));
        };
        let Some((body, index)) = model.joint_by_name(joint) else {
            return Err(refuse(
                scene,
                format!("cannot find joint `{joint}` of actuator `{name}`"),
            ));
        };
        let kind = model.bodies[body].body.joints[index].type_;
        if !matches!(kind, JointType::Hinge | JointType::Slide) {
            return Err(refuse(
                scene,
                format!("drives only hinges and slides, not joint `{joint}` of actuator `{name}`"),
            ));
        }
    }
    Ok(())
}
