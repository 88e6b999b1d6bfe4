//! What actuators and sensors of a document remember by themselves: filters and delays.

use roxmltree::{Document, Node};

/// Descriptions of the filters and delays that the actuators and sensors of a document have by
/// themselves or by a default class, such as ``timeconst of `lift` ``.
///
/// Their states are no part of positions and speeds. Empty where the document cannot be read.
#[must_use]
pub fn own_memory(xml: &str) -> Vec<String> {
    let Ok(document) = Document::parse(xml) else {
        return Vec::new();
    };
    let is_in = |node: &Node<'_, '_>, section: &str| {
        node.ancestors().skip(1).any(|a| a.has_tag_name(section))
    };
    let remembers = |node: &Node<'_, '_>| {
        ["actuator", "sensor", "default"]
            .iter()
            .any(|section| is_in(node, section))
    };
    let elements = document.descendants().filter(Node::is_element);
    elements.filter(remembers).flat_map(of_element).collect()
}

/// The filters and delays of one element.
fn of_element(node: Node<'_, '_>) -> Vec<String> {
    let place = match node.attribute("name") {
        Some(name) => format!("`{name}`"),
        None => format!("a <{}>", node.tag_name().name()),
    };
    let is_set = |attribute: &&str| match node.attribute(*attribute) {
        None | Some("none") => false,
        // A zero is no filter and no delay; a word, such as `filterexact`, is one.
        Some(value) => value.trim().parse::<f64>() != Ok(0.0),
    };
    let attributes = ["timeconst", "dyntype", "delay"];
    let set = attributes.iter().copied().filter(is_set);
    set.map(|attribute| format!("{attribute} of {place}"))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_and_delays_of_a_document_are_found_by_themselves_and_in_classes() {
        let xml = r#"<mujoco><default><position timeconst="0.1"/></default>
          <actuator><position name="p" kp="5" delay="0.02" nsample="20"/>
            <general name="g" dyntype="none"/><motor name="m" delay="0"/></actuator>
          <sensor><jointpos name="q" joint="j" delay="0.01"/></sensor></mujoco>"#;
        let found = own_memory(xml);
        let expected = ["timeconst of a <position>", "delay of `p`", "delay of `q`"];
        assert_eq!(found, expected);
        assert!(own_memory("<mujoco><actuator><motor name=\"m\"/></actuator></mujoco>").is_empty());
        assert!(own_memory("no document").is_empty());
    }
}
