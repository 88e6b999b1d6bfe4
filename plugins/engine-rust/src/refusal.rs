//! Finds by name what this engine would have to ignore, and refuses it.
//!
//! The lists hold what is known. The engine refuses everything else in a document, so that it never
//! silently ignores something that changes the motion.

use asid_core::{Scene, mjcf_rs};
use roxmltree::{Document, Node};

/// Sections of a document that this engine reads, or that contain no physics.
const SECTIONS: [&str; 12] = [
    "compiler",
    "option",
    "default",
    "asset",
    "worldbody",
    "contact",
    "sensor",
    "keyframe",
    "visual",
    "statistic",
    "size",
    "custom",
];

/// Attributes of `<option>` that this engine reads, or that concern the numerics of other engines.
const OPTIONS: [&str; 11] = [
    "timestep",
    "gravity",
    "integrator",
    "cone",
    "impratio",
    "solver",
    "iterations",
    "tolerance",
    "ls_iterations",
    "ls_tolerance",
    "jacobian",
];

/// Describes what this engine lacks for a document; `None` if it can simulate all of it.
#[must_use]
pub fn lacking(scene: &Scene, model: &mjcf_rs::Model) -> Option<String> {
    of_document(scene).or_else(|| of_bodies(model))
}

fn of_document(scene: &Scene) -> Option<String> {
    // A document that cannot be parsed has already been refused.
    let document = Document::parse(scene.xml()).ok()?;
    let elements = |node: Node<'_, '_>| node.children().any(|child| child.is_element());
    let sections = document.root_element().children();
    for section in sections.filter(Node::is_element) {
        let name = section.tag_name().name();
        if !SECTIONS.contains(&name) && elements(section) {
            return Some(format!("this engine has no <{name}>"));
        }
        if name != "option" {
            continue;
        }
        let mut attributes = section.attributes();
        if let Some(other) = attributes.find(|a| !OPTIONS.contains(&a.name())) {
            return Some(format!("this engine has no <option {}>", other.name()));
        }
        if let Some(flag) = section.children().find(Node::is_element) {
            let name = flag.tag_name().name();
            return Some(format!("this engine has no <{name}> of <option>"));
        }
    }
    None
}

fn of_bodies(model: &mjcf_rs::Model) -> Option<String> {
    for body in model.bodies.iter().map(|entry| &entry.body) {
        let name = body.name.as_deref().unwrap_or("without a name");
        if body.gravcomp != 0.0 || body.mocap {
            return Some(format!(
                "body `{name}`: this engine has no gravcomp and no mocap"
            ));
        }
        let forces = |joint: &mjcf_rs::body::Joint| {
            [
                joint.damping,
                joint.stiffness,
                joint.armature,
                joint.frictionloss,
            ]
        };
        if body.joints.iter().flat_map(forces).any(|x| x != 0.0) {
            return Some(format!(
                "body `{name}`: this engine has no springs, dampers, friction or armature of joints"
            ));
        }
    }
    None
}
