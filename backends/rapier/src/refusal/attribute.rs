//! Attributes that change the physics and that this backend or its loader lacks.

use roxmltree::Node;

/// Elements with such an attribute. Those of actuators are reflected to the joint that they drive.
const ATTRIBUTES: [(&str, &str); 28] = [
    ("position", "dampratio"),
    ("position", "timeconst"),
    ("position", "inheritrange"),
    ("position", "delay"),
    ("velocity", "delay"),
    ("motor", "delay"),
    ("general", "delay"),
    ("general", "dyntype"),
    ("motor", "dyntype"),
    ("joint", "actuatorfrcrange"),
    ("joint", "actuatorgravcomp"),
    ("motor", "damping"),
    ("motor", "armature"),
    ("position", "damping"),
    ("position", "armature"),
    ("velocity", "damping"),
    ("velocity", "armature"),
    ("general", "damping"),
    ("general", "armature"),
    ("option", "actuatorgroupdisable"),
    ("freejoint", "align"),
    ("geom", "fluidshape"),
    ("geom", "gap"),
    ("geom", "shellinertia"),
    ("compiler", "settotalmass"),
    ("compiler", "balanceinertia"),
    ("compiler", "inertiagrouprange"),
    ("compiler", "alignfree"),
];

/// The attribute of an element that this backend lacks.
///
/// The total mass that an attached document states counts for nothing, as in MuJoCo.
pub(super) fn refused(node: &Node<'_, '_>, is_attached: bool) -> Option<&'static str> {
    let mut own = ATTRIBUTES.iter().filter(|(element, attribute)| {
        node.has_tag_name(*element) && !(is_attached && *attribute == "settotalmass")
    });
    let found = own.find(|(_, attribute)| {
        let value = node.attribute(*attribute);
        value.is_some_and(|value| !is_neutral(attribute, value))
    });
    found.map(|(_, attribute)| *attribute)
}

/// Whether a value of one of [`ATTRIBUTES`] means what its absence means.
fn is_neutral(attribute: &str, value: &str) -> bool {
    let mut numbers = value.split_whitespace().map(str::parse::<f64>);
    match attribute {
        // Group 0 is that of elements without one.
        "actuatorgroupdisable" => value.trim().is_empty(),
        "inertiagrouprange" => numbers.eq([Ok(0.0), Ok(5.0)]),
        "settotalmass" => numbers.all(|n| n.is_ok_and(|n| n <= 0.0)),
        _ => ["false", "none", "auto"].contains(&value) || numbers.all(|n| n == Ok(0.0)),
    }
}
