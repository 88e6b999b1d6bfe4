//! Finds by name what this engine would have to ignore, and refuses it.
//!
//! The lists hold what is known. The engine refuses everything else in a document, so that it never
//! silently ignores something that changes the motion.

use asid_core::{Scene, mjcf_rs};
use asid_mjcf::document::is_of_higher_order;
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

/// Attributes of `<compiler>` that the parser applies, or that find files. Others change masses.
const COMPILER: [&str; 8] = [
    "angle",
    "autolimits",
    "eulerseq",
    "coordinate",
    "assetdir",
    "meshdir",
    "texturedir",
    "strippath",
];

/// Elements of bodies that this engine reads, or that contain no physics. Others make more bodies.
const PARTS: [&str; 9] = [
    "body",
    "frame",
    "inertial",
    "joint",
    "freejoint",
    "geom",
    "site",
    "camera",
    "light",
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
///
/// It reads the document for what the parser skips, and the parsed model for the rest.
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
        let known = match name {
            "option" => &OPTIONS[..],
            "compiler" => &COMPILER[..],
            "worldbody" => match section.descendants().skip(1).find_map(strange) {
                Some(what) => return Some(what),
                None => continue,
            },
            _ => continue,
        };
        let mut attributes = section.attributes();
        if let Some(other) = attributes.find(|a| !known.contains(&a.name())) {
            return Some(format!("this engine has no <{name} {}>", other.name()));
        }
        if let Some(part) = section.children().find(Node::is_element) {
            let part = part.tag_name().name();
            return Some(format!("this engine has no <{part}> of <{name}>"));
        }
    }
    None
}

/// Describes what this engine lacks for an element of a body, except for values that the parser
/// resolves.
fn strange(node: Node<'_, '_>) -> Option<String> {
    let name = node.tag_name().name();
    if node.is_element() && !PARTS.contains(&name) {
        return Some(format!("this engine has no <{name}> in a body"));
    }
    let aligned = node.attribute("align").is_some_and(|a| a == "true");
    let curved = ["stiffness", "damping"]
        .iter()
        .any(|a| node.attribute(*a).is_some_and(is_of_higher_order));
    (aligned || curved)
        .then(|| format!("this engine has free joints without options, unlike <{name}>"))
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
        let timed = |joint: &mjcf_rs::body::Joint| joint.springdamper.unwrap_or_default();
        let all = body.joints.iter();
        let mut all = all.clone().flat_map(forces).chain(all.flat_map(timed));
        if all.any(|x| x != 0.0) {
            return Some(format!(
                "body `{name}`: this engine has no springs, dampers, friction or armature of joints"
            ));
        }
    }
    None
}
