//! What a document holds beyond the header's structure.
//!
//! The list contains everything that is not known here, so an attribute of a later MJCF is reported
//! until this module knows it. A whole element is written `section/element`, such as
//! `equality/weld`. An attribute is written `element/name attribute`, such as `geom/arm solref`,
//! without `/name` if the element has none, and with `default/` before it in a class of defaults.

use asid_mjcf::document::is_of_higher_order;
use mjcf_rs::Model;
use mjcf_rs::body::GeomType;
use roxmltree::{Document, Node};

/// Sections without physics, or whose content the structure holds in another form.
const NEUTRAL_SECTIONS: [&str; 6] = [
    "visual",
    "statistic",
    "custom",
    "size",
    "asset",
    "extension",
];

/// Attributes of poses.
const POSE: [&str; 6] = ["pos", "quat", "axisangle", "euler", "xyaxes", "zaxis"];

/// Attributes that name, group or draw elements.
const LABELS: [&str; 7] = [
    "name",
    "class",
    "childclass",
    "group",
    "rgba",
    "material",
    "user",
];

/// Settings of numerical accuracy.
const PRECISION: [&str; 14] = [
    "apirate",
    "jacobian",
    "solver",
    "iterations",
    "tolerance",
    "ls_iterations",
    "ls_tolerance",
    "noslip_tolerance",
    "ccd_iterations",
    "ccd_tolerance",
    "sdf_iterations",
    "sdf_initpoints",
    "mpr_iterations",
    "mpr_tolerance",
];

/// Flags that do not affect the motion.
const FLAGS: [&str; 11] = [
    "warmstart",
    "refsafe",
    "energy",
    "midphase",
    "nativeccd",
    "island",
    "multiccd",
    "autoreset",
    "invdiscrete",
    "fwdinv",
    "sleep",
];

/// Attributes of an element that the structure carries; `None` for an unknown element.
fn known(tag: &str) -> Option<&'static [&'static str]> {
    Some(match tag {
        "compiler" => &[
            "angle",
            "eulerseq",
            "coordinate",
            "autolimits",
            "inertiafromgeom",
            "boundmass",
            "boundinertia",
            "inertiadensity",
            "meshdir",
            "texturedir",
            "assetdir",
            "strippath",
            "convexhull",
            "exactmeshinertia",
            "usethread",
            "saveinertial",
        ],
        "option" => &["timestep", "gravity"],
        "worldbody" | "frame" | "default" => &[],
        "body" => &["sleep"],
        "inertial" => &["mass", "diaginertia", "fullinertia"],
        "freejoint" => &[],
        "joint" => &[
            "type",
            "axis",
            "limited",
            "range",
            "ref",
            "springref",
            "stiffness",
            "damping",
            "armature",
            "frictionloss",
        ],
        "geom" => &[
            "type",
            "size",
            "fromto",
            "mass",
            "density",
            "friction",
            "contype",
            "conaffinity",
            "condim",
            "priority",
        ],
        "site" => &["type", "size"],
        "motor" | "position" | "velocity" => &[
            "joint",
            "gear",
            "ctrlrange",
            "ctrllimited",
            "forcerange",
            "forcelimited",
            "lengthrange",
            "kp",
            "kv",
        ],
        "key" => &["qpos", "qvel", "ctrl", "time"],
        _ => return None,
    })
}

/// Attributes of a sensor that the structure carries.
const SENSOR: [&str; 9] = [
    "objtype", "objname", "joint", "body", "geom", "site", "actuator", "tendon", "noise",
];

/// Sensors whose number of entries is known to match the layout.
const SENSOR_KINDS: [&str; 37] = [
    "touch",
    "accelerometer",
    "velocimeter",
    "gyro",
    "force",
    "torque",
    "magnetometer",
    "rangefinder",
    "jointpos",
    "jointvel",
    "tendonpos",
    "tendonvel",
    "actuatorpos",
    "actuatorvel",
    "actuatorfrc",
    "jointactuatorfrc",
    "tendonactuatorfrc",
    "ballquat",
    "ballangvel",
    "jointlimitpos",
    "jointlimitvel",
    "jointlimitfrc",
    "framepos",
    "framequat",
    "framexaxis",
    "frameyaxis",
    "framezaxis",
    "framelinvel",
    "frameangvel",
    "framelinacc",
    "frameangacc",
    "subtreecom",
    "subtreelinvel",
    "subtreeangmom",
    "clock",
    "e_potential",
    "e_kinetic",
];

/// Lists what is left out, in the document's order and without duplicates.
pub fn list(xml: &Document<'_>, model: &Model) -> Vec<String> {
    let mut found = Vec::new();
    for section in xml.root_element().children().filter(Node::is_element) {
        let tag = section.tag_name().name();
        if !NEUTRAL_SECTIONS.contains(&tag) {
            visit(section, tag, &mut found);
        }
    }
    for actuator in &model.actuators {
        if actuator.gear[1..].iter().any(|&g| g != 0.0) {
            found.push(labelled("actuator", actuator.name.as_deref(), "gear"));
        }
    }
    for joint in model.bodies.iter().flat_map(|entry| &entry.body.joints) {
        if (joint.springdamper).is_some_and(|s| s.iter().any(|x| *x != 0.0)) {
            found.push(labelled("joint", joint.name.as_deref(), "springdamper"));
        }
    }
    for geom in model.bodies.iter().flat_map(|entry| &entry.body.geoms) {
        let shape = match geom.type_ {
            GeomType::Mesh => "mesh",
            GeomType::Hfield => "hfield",
            GeomType::Sdf => "sdf",
            _ if geom.mesh.is_some() => "mesh",
            _ => continue,
        };
        found.push(labelled("geom", geom.name.as_deref(), shape));
    }
    let mut once = Vec::new();
    for text in found {
        if !once.contains(&text) {
            once.push(text);
        }
    }
    once
}

/// Adds what is left out of an element and of its children.
fn visit(node: Node<'_, '_>, section: &str, found: &mut Vec<String>) {
    let tag = node.tag_name().name();
    let parent = node.parent().map(|p| p.tag_name().name());
    match (section, tag) {
        ("actuator" | "sensor" | "keyframe", _) if tag == section => {}
        ("option", "flag") => {
            flags(node, found);
            return;
        }
        ("sensor", _) if SENSOR_KINDS.contains(&tag) => attributes(node, "sensor", &SENSOR, found),
        ("actuator", _) => {
            let known = known(tag).unwrap_or(&["joint", "gear"]);
            attributes(node, "actuator", known, found);
        }
        ("default", "general" | "intvelocity" | "damper") => {
            let known = known("motor").unwrap_or_default();
            attributes(node, &format!("default/{tag}"), known, found);
        }
        // A class for an unknown element matters where it is used, and is reported there.
        ("default", _) if known(tag).is_none() => return,
        (_, "camera" | "light") => return,
        (_, _) => match known(tag) {
            Some(known) if section != "contact" && section != "equality" && section != "tendon" => {
                let default = if section == "default" { "default/" } else { "" };
                attributes(node, &format!("{default}{tag}"), known, found);
            }
            _ if tag == section => {}
            _ => {
                found.push(format!("{}/{tag}", parent.unwrap_or(section)));
                return;
            }
        },
    }
    for child in node.children().filter(Node::is_element) {
        visit(child, section, found);
    }
}

/// Adds the attributes of an element that are unknown and not at their default.
fn attributes(node: Node<'_, '_>, element: &str, known: &[&str], found: &mut Vec<String>) {
    for attribute in node.attributes() {
        let (name, value) = (attribute.name(), attribute.value());
        // The structure carries the linear coefficient alone.
        let beyond = ["stiffness", "damping"].contains(&name) && is_of_higher_order(value);
        let carried = (known.contains(&name) && !beyond)
            || LABELS.contains(&name)
            || POSE.contains(&name)
            || (element == "option" && PRECISION.contains(&name))
            || at_rest(name, value);
        // The mesh of a geom is reported with its shape, after defaults are resolved, and so is what
        // a class says of joints that may overrule it.
        let found_elsewhere = (element.ends_with("geom") && ["mesh", "hfield"].contains(&name))
            || (element, name) == ("default/joint", "springdamper");
        if !carried && !found_elsewhere {
            found.push(labelled(element, node.attribute("name"), name));
        }
    }
}

/// Whether a value is MJCF's default.
fn at_rest(name: &str, value: &str) -> bool {
    let mut numbers = value.split_whitespace().map(str::parse::<f64>);
    match name {
        "integrator" => value == "Euler",
        "cone" => value == "pyramidal",
        "impratio" => numbers.all(|n| n == Ok(1.0)),
        "settotalmass" => numbers.all(|n| n.is_ok_and(|n| n <= 0.0)),
        "inertiagrouprange" => numbers.eq([Ok(0.0), Ok(5.0)]),
        // Group 0 is that of elements without one.
        "actuatorgroupdisable" => value.trim().is_empty(),
        "align" => value == "false" || value == "auto",
        _ if name.starts_with("sol") || name.starts_with("o_") => false,
        _ => {
            ["false", "none", "auto", "disable", ""].contains(&value)
                || numbers.all(|n| n == Ok(0.0))
        }
    }
}

/// Adds the flags that disable a part of the physics, or enable an override.
fn flags(node: Node<'_, '_>, found: &mut Vec<String>) {
    for flag in node.attributes() {
        let switched = match flag.name() {
            "override" => flag.value() == "enable",
            name => flag.value() == "disable" && !FLAGS.contains(&name),
        };
        if switched {
            found.push(labelled("flag", None, flag.name()));
        }
    }
}

fn labelled(element: &str, name: Option<&str>, what: &str) -> String {
    match name {
        Some(name) => format!("{element}/{name} {what}"),
        None => format!("{element} {what}"),
    }
}
