//! Limits of joints that the parser of the document leaves out.

use std::collections::BTreeMap;

use roxmltree::{Document, Node};

use crate::classes::said;
use crate::document::range;

/// The limit of the sum of the drives' forces on each joint that has one (`actuatorfrcrange`), N or
/// N m, by the joint's name.
///
/// `autolimits` is the compiler's. Empty where the document cannot be read.
pub(super) fn of_joints(xml: &str, autolimits: bool) -> BTreeMap<String, [f64; 2]> {
    let mut found = BTreeMap::new();
    if !xml.contains("actuatorfrcrange") {
        return found;
    }
    let Ok(document) = Document::parse(xml) else {
        return found;
    };
    let root = document.root_element();
    let worlds = root.children().filter(|n| n.has_tag_name("worldbody"));
    for joint in worlds.flat_map(|w| w.descendants()).filter(is_joint) {
        let limited = match said(root, joint, is_limited).as_deref() {
            Some("true") => true,
            Some("false") => false,
            _ => autolimits,
        };
        let limit = range(said(root, joint, force_range)).filter(|_| limited);
        if let (Some(name), Some(limit)) = (joint.attribute("name"), limit) {
            found.insert(name.to_owned(), limit);
        }
    }
    found
}

fn is_joint(node: &Node<'_, '_>) -> bool {
    node.has_tag_name("joint")
}

/// The limit that a joint states, or a class for joints.
fn force_range(node: Node<'_, '_>) -> Option<[f64; 2]> {
    let text = node.attribute("actuatorfrcrange");
    let ends = text.filter(|_| is_joint(&node))?.split_whitespace();
    let ends: Vec<f64> = ends.filter_map(|end| end.parse().ok()).collect();
    ends.try_into().ok()
}

/// Whether a joint is limited, as it states it, or a class for joints.
fn is_limited(node: Node<'_, '_>) -> Option<String> {
    let text = node.attribute("actuatorfrclimited");
    text.filter(|_| is_joint(&node)).map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use asid_core::scene::Scene;

    use crate::Plant;

    /// Ends of the force of the first actuator, before its gear.
    fn ends(joint: &str, actuators: &str) -> Option<[f64; 2]> {
        let xml = format!(
            r#"<mujoco><default><joint actuatorfrcrange="-3 4"/>
            <default class="weak"><joint actuatorfrcrange="-1 1"/></default></default>
            <worldbody><body childclass="weak"><joint name="j" {joint}/><geom size="0.1"/></body>
            <body><joint name="k"/><geom size="0.1"/></body></worldbody><actuator>{actuators}</actuator></mujoco>"#
        );
        let plant = Plant::of(&Scene::from_xml("limits", &xml, &[]).unwrap()).unwrap();
        plant.drives[0].unwrap().force_range
    }

    /// Symptom: a spring between a drive and its joint was pulled with hundreds of times the force
    /// that the joint's `actuatorfrcrange` allows. Cause: the parser of the document does not read
    /// that attribute.
    #[test]
    fn the_limit_of_a_joint_is_one_of_its_drive() {
        let motor = r#"<motor joint="j"/>"#;
        assert_eq!(ends("", motor), Some([-1.0, 1.0]));
        assert_eq!(ends("", r#"<motor joint="k"/>"#), Some([-3.0, 4.0]));
        assert_eq!(ends(r#"actuatorfrcrange="-2 2""#, motor), Some([-2.0, 2.0]));
        assert_eq!(ends(r#"actuatorfrcrange="0 0""#, motor), None);
        assert_eq!(ends(r#"actuatorfrclimited="false""#, motor), None);
        let geared = r#"<general joint="j" gainprm="-2" gear="5" forcerange="-9 0.1"/>"#;
        assert_eq!(ends("", geared), Some([-0.05, 0.1]));
        // The sum of two drives is limited, and not each of them.
        let two = r#"<motor joint="j" forcerange="-9 9"/><motor joint="j"/>"#;
        assert_eq!(ends("", two), Some([-9.0, 9.0]));
    }

    /// Symptom: of two sections of defaults the first counted. Cause: they were looked through in
    /// the document's order, and MuJoCo lets the later one override.
    #[test]
    fn the_last_section_of_defaults_counts() {
        let xml = r#"<mujoco><default><joint actuatorfrcrange="-3 4"/></default>
            <default><joint actuatorfrcrange="-2 2"/></default>
            <worldbody><body><joint name="k"/><geom size="0.1"/></body></worldbody>
            <actuator><motor joint="k"/></actuator></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("limits", xml, &[]).unwrap()).unwrap();
        assert_eq!(plant.drives[0].unwrap().force_range, Some([-2.0, 2.0]));
    }

    #[test]
    fn a_range_without_width_is_no_limit() {
        let motor = r#"<motor joint="k" forcerange="0 0" ctrlrange="0 0"/>"#;
        let xml = format!(
            r#"<mujoco><worldbody><body><joint name="k"/><geom size="0.1"/></body></worldbody>
            <actuator>{motor}</actuator></mujoco>"#
        );
        let plant = Plant::of(&Scene::from_xml("limits", &xml, &[]).unwrap()).unwrap();
        let drive = plant.drives[0].unwrap();
        assert_eq!(drive.force(7.0, 0.0, 0.0), 7.0);
        assert_eq!(plant.layout.actuators[0].ctrl_range, None);
    }

    #[test]
    fn limits_follow_the_values_of_a_gear_and_of_a_range() {
        let motor = r#"<general joint="j" gainprm="4" gear="2" forcerange="-8 2"/>"#;
        let xml = format!(
            r#"<mujoco><worldbody><body><joint name="j" actuatorfrcrange="-5 5"/><geom size="0.1"/></body></worldbody>
            <actuator>{motor}</actuator></mujoco>"#
        );
        let plant = Plant::of(&Scene::from_xml("limits", &xml, &[]).unwrap()).unwrap();
        let drive = plant.drives[0].unwrap();
        let limits = |drive: &super::super::Drive| [-9.0, 9.0].map(|u| drive.force(u, 0.0, 0.0));
        assert_eq!(limits(&drive), [-5.0, 4.0]);
        let strong = drive.with("forcerange", 1, [2.0, 4.0]);
        assert_eq!(limits(&strong), [-5.0, 5.0]);
        let low = drive.with("gear", 0, [2.0, 0.5]);
        assert_eq!(limits(&low), [-4.0, 1.0]);
        assert_eq!(low.own_force_range(), Some([-8.0, 2.0]));
    }
}
