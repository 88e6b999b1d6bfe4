//! What actuators and sensors of a document remember by themselves: filters and delays.

use roxmltree::{Document, Node};

use crate::classes::said;

/// What something of a document remembers by itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OwnMemory {
    /// Description, such as ``filter of `lift` ``.
    pub what: String,
    /// Whether it is a sensor's; otherwise an actuator's.
    pub of_sensor: bool,
}

/// The filters and delays that the actuators and sensors of a document have by themselves or by a
/// default class, in the document's order.
///
/// Their states are no part of positions and speeds. Empty where the document cannot be read.
#[must_use]
pub fn own_memory(xml: &str) -> Vec<OwnMemory> {
    let Ok(document) = Document::parse(xml) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    for (section, of_sensor) in [("actuator", false), ("sensor", true)] {
        for node in entries(&document, section) {
            let own = of_element(&document, node).map(|what| OwnMemory { what, of_sensor });
            found.extend(own);
        }
    }
    found
}

/// Whether each actuator of a document has a filter or a delay by itself or by a default class, in
/// the document's order.
#[must_use]
pub fn of_actuators(xml: &str) -> Vec<bool> {
    let Ok(document) = Document::parse(xml) else {
        return Vec::new();
    };
    let actuators = entries(&document, "actuator");
    let remembers = |node| of_element(&document, node).next().is_some();
    actuators.map(remembers).collect()
}

/// The elements of all sections of a name.
fn entries<'d>(
    document: &'d Document<'d>,
    section: &'static str,
) -> impl Iterator<Item = Node<'d, 'd>> {
    let sections = document.root_element().children();
    let sections = sections.filter(move |n| n.has_tag_name(section));
    sections.flat_map(|s| s.children().filter(Node::is_element))
}

/// The filters and delays of one element.
fn of_element<'d>(document: &'d Document<'d>, node: Node<'d, 'd>) -> impl Iterator<Item = String> {
    let place = match node.attribute("name") {
        Some(name) => format!("`{name}`"),
        None => format!("a <{}>", node.tag_name().name()),
    };
    let root = document.root_element();
    let of = [
        filter(root, node).map(|_| "filter"),
        (delay(root, node) != 0.0).then_some("delay"),
    ];
    let of = of.into_iter().flatten();
    of.map(move |what| format!("{what} of {place}"))
}

/// The kind of filter (`dyntype`) that the document gives an actuator; `None` without one.
///
/// Short forms take what a class says of `<general>`, but those not listed here have no filter.
#[must_use]
pub fn filter(root: Node<'_, '_>, actuator: Node<'_, '_>) -> Option<String> {
    const FILTERED: [&str; 4] = ["position", "intvelocity", "muscle", "general"];
    if !FILTERED.contains(&actuator.tag_name().name()) {
        return None;
    }
    let own = match actuator.tag_name().name() {
        "intvelocity" => return Some("integrator".into()),
        "muscle" => return Some("muscle".into()),
        _ => said(root, actuator, |n| match time_constant(n) {
            Some(lag) => Some(if lag > 0.0 { "filterexact" } else { "none" }.to_owned()),
            None => n.attribute("dyntype").map(str::to_owned),
        }),
    };
    own.filter(|kind| kind != "none")
}

/// The delay that the document gives an actuator or a sensor, s.
#[must_use]
pub fn delay(root: Node<'_, '_>, node: Node<'_, '_>) -> f64 {
    said(root, node, |n| n.attribute("delay")?.trim().parse().ok()).unwrap_or(0.0)
}

/// Time constant of the filter of a servo in its short form, s; `None` where it says none.
#[must_use]
pub fn time_constant(actuator: Node<'_, '_>) -> Option<f64> {
    actuator.attribute("timeconst")?.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_and_delays_of_a_document_are_found_by_themselves_and_in_classes() {
        let xml = r#"<mujoco><default><position timeconst="0.1"/>
            <default class="quick"><position timeconst="0"/></default></default>
          <actuator><position name="p" kp="5" delay="0.02" nsample="20"/>
            <position name="fast" class="quick"/>
            <general name="g" dyntype="none"/><motor name="m" delay="0"/>
            <general name="f" dyntype="filter"/></actuator>
          <sensor><jointpos name="q" joint="j" delay="0.01"/></sensor></mujoco>"#;
        let found = own_memory(xml);
        let words: Vec<(&str, bool)> = found.iter().map(|m| (&*m.what, m.of_sensor)).collect();
        let expected = [
            ("filter of `p`", false),
            ("delay of `p`", false),
            ("filter of `f`", false),
            ("delay of `q`", true),
        ];
        assert_eq!(words, expected);
        assert_eq!(of_actuators(xml), [true, false, false, false, true]);
        assert!(own_memory("<mujoco><actuator><motor name=\"m\"/></actuator></mujoco>").is_empty());
        assert!(own_memory("no document").is_empty());
    }
}
