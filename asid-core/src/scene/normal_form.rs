//! A document in the form in which the parser of descriptions reads it as MuJoCo does.
//!
//! The parser takes a list of numbers, and a place, from one element or one class. In MJCF the
//! later entries of a shorter list come from the class around, and so does the rotation beside a
//! position. In a `<frame>` the parser leaves ends (`fromto`) where they are and drops joints and
//! `<inertial>`. It refuses stiffness and damping of higher order. All of that is written out here,
//! as MuJoCo compiles it. Everything else stays as it is, to the letter. Documents that `<attach>`
//! brings in are read as they are.

mod edits;
mod rotation;

use std::borrow::Cow;

use asid_documents::xml::{Fault, parse};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use roxmltree::Node;

use edits::Edits;
use rotation::{ROTATIONS, rotation};

/// The normal form of a document; the document itself where it has that form.
///
/// # Errors
/// When a number is none, or a frame holds what cannot be moved out of it.
pub(super) fn normal_form<'x>(name: &str, xml: &'x str) -> Result<Cow<'x, str>, Fault> {
    let document = parse(name, xml)?;
    let root = document.root_element();
    let mut writer = Writer {
        name,
        root,
        edits: Edits::default(),
    };
    writer.first_orders();
    writer.unread();
    writer.actuators();
    for world in root.children().filter(|n| n.has_tag_name("worldbody")) {
        writer.parts(world, Around::default())?;
    }
    Ok(writer.edits.applied(xml))
}

/// Puts the actuators and sensors of attached documents behind those of the document, where MuJoCo
/// has them; the parser has them before.
///
/// # Errors
/// When the document is not well-formed.
pub(super) fn attached_last(
    name: &str,
    xml: &str,
    parsed: &mut mjcf_rs::Model,
) -> Result<(), Fault> {
    if !xml.contains("<attach") {
        return Ok(());
    }
    let document = parse(name, xml)?;
    let own = |section: &str| {
        let sections = document.root_element().children();
        let sections = sections.filter(|n| n.has_tag_name(section));
        let all = sections.flat_map(|s| s.children());
        all.filter(Node::is_element).count()
    };
    let attached = |all: usize, section: &str| all.saturating_sub(own(section));
    let (actuators, sensors) = (parsed.actuators.len(), parsed.sensors.len());
    parsed
        .actuators
        .rotate_left(attached(actuators, "actuator"));
    parsed.sensors.rotate_left(attached(sensors, "sensor"));
    Ok(())
}

/// Elements of a class that set its actuator (MuJoCo, XML reference, `default`).
const ACTUATORS: [&str; 9] = [
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
];
/// Attributes that mean the same in all kinds of actuator.
const OF_ANY_ACTUATOR: [&str; 5] = [
    "gear",
    "ctrlrange",
    "forcerange",
    "ctrllimited",
    "forcelimited",
];

/// What is around an element.
#[derive(Clone, Copy, Default)]
struct Around<'d> {
    /// Pose of the frames around it in its body; `None` without frames.
    frame: Option<Isometry3<f64>>,
    /// The nearest `childclass`.
    class: Option<&'d str>,
}

/// A document whose normal form is written.
struct Writer<'d> {
    /// Name of the document.
    name: &'d str,
    root: Node<'d, 'd>,
    edits: Edits,
}

impl<'d> Writer<'d> {
    /// Removes all but the linear coefficient of stiffness and damping.
    fn first_orders(&mut self) {
        for node in self.root.descendants().filter(|n| n.has_tag_name("joint")) {
            for attribute in ["stiffness", "damping"] {
                let all = node.attribute(attribute).and_then(numbers_of);
                if let Some([first, _, ..]) = all.as_deref() {
                    self.edits.set_numbers(node, attribute, &[*first]);
                }
            }
        }
    }

    /// Writes bit masks below zero as the masks that they are, and removes how a body may sleep,
    /// which changes no motion.
    fn unread(&mut self) {
        for node in self.root.descendants().filter(Node::is_element) {
            for attribute in ["contype", "conaffinity"] {
                let mask = node.attribute(attribute).map(str::trim);
                let negative = mask.and_then(|x| x.parse::<i32>().ok()).filter(|x| *x < 0);
                if let Some(mask) = negative {
                    let mask = mask.cast_unsigned().to_string();
                    self.edits.set(node, attribute, &mask);
                }
            }
            if node.has_tag_name("body") {
                self.edits.remove(node, "sleep");
            }
        }
    }

    /// Completes actuators from what their classes say of any kind of actuator: a class has one
    /// actuator for all kinds. Coefficients come from `<general>` alone, since the other kinds state
    /// them under names of their own.
    fn actuators(&mut self) {
        let sections = self.root.children().filter(|n| n.has_tag_name("actuator"));
        let all = sections.flat_map(|s| s.children());
        for node in all.filter(Node::is_element) {
            let sources = self.sources(node, &["general"], None);
            for attribute in ["gainprm", "biasprm"] {
                self.list(node, &sources, attribute);
            }
            let sources = self.sources(node, &ACTUATORS, None);
            for attribute in OF_ANY_ACTUATOR {
                let said = said(&sources, attribute);
                if let (false, Some(value)) = (node.has_attribute(attribute), said) {
                    self.edits.set(node, attribute, value);
                }
            }
        }
    }

    /// Writes out the elements of a body or of a frame.
    fn parts(&mut self, node: Node<'d, 'd>, around: Around<'d>) -> Result<(), Fault> {
        for child in node.children().filter(Node::is_element) {
            let tag = child.tag_name().name();
            let class = child.attribute("childclass").or(around.class);
            match tag {
                "body" => {
                    self.place(child, &[child], around)?;
                    self.inherit(child, "childclass", around);
                    self.parts(child, Around { frame: None, class })?;
                }
                "frame" => {
                    let outer = around.frame.unwrap_or_else(Isometry3::identity);
                    let frame = Some(outer * self.pose(child, &[child])?);
                    self.edits.strip(child);
                    self.parts(child, Around { frame, class })?;
                }
                "inertial" => self.place(child, &[child], around)?,
                "joint" => self.joint(child, around)?,
                "geom" | "site" => {
                    let sources = self.sources(child, &[tag], around.class);
                    self.list(child, &sources, "friction");
                    self.list(child, &sources, "size");
                    self.place(child, &sources, around)?;
                    self.inherit(child, "class", around);
                }
                "attach" if around.frame.is_some() => {
                    return Err(self.fault(
                        child,
                        "<attach> in a <frame> cannot be read; put it directly into a <body>",
                    ));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// The elements that say something of `node`, what counts first: itself, then those of some `tags`
    /// in its class and in the classes around that.
    fn sources(
        &self,
        node: Node<'d, 'd>,
        tags: &[&str],
        around: Option<&str>,
    ) -> Vec<Node<'d, 'd>> {
        let is_default = |n: &Node<'d, 'd>| n.has_tag_name("default");
        let sections = || self.root.children().filter(is_default);
        let named = node.attribute("class").or(around).and_then(|class| {
            let mut all = sections().flat_map(|s| s.descendants());
            all.find(|n| is_default(n) && n.attribute("class") == Some(class))
        });
        let within = named.into_iter().flat_map(|n| n.ancestors());
        // Elements directly in a section are of the class of all.
        let classes = within.filter(is_default).chain(sections().rev());
        let said = classes.flat_map(|class| class.children().rev());
        std::iter::once(node)
            .chain(said.filter(|n| tags.contains(&n.tag_name().name())))
            .collect()
    }

    /// Completes a list of numbers whose later entries another source states.
    fn list(&mut self, node: Node<'d, 'd>, sources: &[Node<'d, 'd>], attribute: &str) {
        let said = sources.iter().filter_map(|n| n.attribute(attribute));
        let said: Vec<Vec<f64>> = said.filter_map(numbers_of).collect();
        let longest = said.iter().map(Vec::len).max().unwrap_or(0);
        if said.first().is_some_and(|first| first.len() < longest) {
            let entry = |i: usize| said.iter().find_map(|list| list.get(i)).copied();
            let whole: Vec<f64> = (0..longest).filter_map(entry).collect();
            self.edits.set_numbers(node, attribute, &whole);
        }
    }

    /// Writes out where an element is.
    fn place(
        &mut self,
        node: Node<'d, 'd>,
        sources: &[Node<'d, 'd>],
        around: Around<'d>,
    ) -> Result<(), Fault> {
        let Some(frame) = around.frame else {
            self.join(node, sources);
            return Ok(());
        };
        if let Some(text) = said(sources, "fromto") {
            let [a, b, c, d, e, f]: [f64; 6] = self.numbers(node, "fromto", text)?;
            let ends = [[a, b, c], [d, e, f]].map(|end| frame * Point3::from(end));
            let ends: [[f64; 3]; 2] = ends.map(|end| end.coords.into());
            self.edits.set_numbers(node, "fromto", &ends.concat());
            return Ok(());
        }
        let pose = frame * self.pose(node, sources)?;
        let q = pose.rotation;
        self.edits
            .set_numbers(node, "pos", pose.translation.vector.as_slice());
        self.edits.set_numbers(node, "quat", &[q.w, q.i, q.j, q.k]);
        for other in &ROTATIONS[1..] {
            self.edits.remove(node, other);
        }
        Ok(())
    }

    /// Writes position and rotation into an element that has them from two sources.
    fn join(&mut self, node: Node<'d, 'd>, sources: &[Node<'d, 'd>]) {
        let first = |names: &[&str]| {
            let has = |n: &Node<'d, 'd>| names.iter().any(|name| n.has_attribute(*name));
            sources.iter().position(has)
        };
        let (Some(position), Some(rotation)) = (first(&["pos"]), first(&ROTATIONS)) else {
            return;
        };
        if position == rotation {
            return;
        }
        for (source, names) in [(position, &["pos"][..]), (rotation, &ROTATIONS[..])] {
            for name in names.iter().filter(|_| source > 0) {
                if let Some(value) = sources[source].attribute(*name) {
                    self.edits.set(node, name, value);
                }
            }
        }
    }

    /// Moves the anchor and the axis of a joint out of its frames.
    fn joint(&mut self, node: Node<'d, 'd>, around: Around<'d>) -> Result<(), Fault> {
        let Some(frame) = around.frame else {
            return Ok(());
        };
        self.inherit(node, "class", around);
        let sources = self.sources(node, &["joint"], around.class);
        if said(&sources, "type") == Some("free") {
            return Ok(());
        }
        let vector = |attribute: &str, otherwise: [f64; 3]| match said(&sources, attribute) {
            Some(text) => self.numbers(node, attribute, text),
            None => Ok(otherwise),
        };
        let anchor = frame * Point3::from(vector("pos", [0.0; 3])?);
        let axis = frame * Vector3::from(vector("axis", [0.0, 0.0, 1.0])?);
        self.edits
            .set_numbers(node, "pos", anchor.coords.as_slice());
        self.edits.set_numbers(node, "axis", axis.as_slice());
        Ok(())
    }

    /// Gives an element in a frame the class that the frames pass on to it.
    fn inherit(&mut self, node: Node<'d, 'd>, attribute: &str, around: Around<'d>) {
        if let (Some(_), Some(class), false) =
            (around.frame, around.class, node.has_attribute(attribute))
        {
            self.edits.set(node, attribute, class);
        }
    }

    /// Pose that an element and its classes state.
    fn pose(&self, node: Node<'d, 'd>, sources: &[Node<'d, 'd>]) -> Result<Isometry3<f64>, Fault> {
        let [x, y, z]: [f64; 3] = match said(sources, "pos") {
            Some(text) => self.numbers(node, "pos", text)?,
            None => [0.0; 3],
        };
        let stated = |n: &Node<'d, 'd>| ROTATIONS.iter().find_map(|a| Some((*a, n.attribute(*a)?)));
        let turn = match sources.iter().find_map(stated) {
            Some((attribute, text)) => self.rotation(node, attribute, text)?,
            None => UnitQuaternion::identity(),
        };
        Ok(Isometry3::from_parts(Translation3::new(x, y, z), turn))
    }

    /// The rotation that an attribute states.
    fn rotation(
        &self,
        node: Node<'d, 'd>,
        attribute: &str,
        text: &str,
    ) -> Result<UnitQuaternion<f64>, Fault> {
        let unit = match self.compiler("angle") {
            Some("radian") => 1.0,
            _ => std::f64::consts::PI / 180.0,
        };
        let order = self.compiler("eulerseq").unwrap_or("xyz");
        let numbers = numbers_of(text).unwrap_or_default();
        let turn = rotation(attribute, &numbers, unit, order);
        turn.ok_or_else(|| self.fault(node, &format!("{attribute}=\"{text}\" is no rotation")))
    }

    /// A setting of the compiler: the last one in the document.
    fn compiler(&self, attribute: &str) -> Option<&'d str> {
        let sections = self.root.children().filter(|n| n.has_tag_name("compiler"));
        sections.rev().find_map(|n| n.attribute(attribute))
    }

    /// The numbers of an attribute.
    fn numbers<const N: usize>(
        &self,
        node: Node<'d, 'd>,
        attribute: &str,
        text: &str,
    ) -> Result<[f64; N], Fault> {
        let numbers = numbers_of(text).unwrap_or_default();
        let found = <[f64; N]>::try_from(numbers);
        found.map_err(|_| self.fault(node, &format!("{attribute}=\"{text}\" is not {N} numbers")))
    }

    fn fault(&self, node: Node<'d, 'd>, what: &str) -> Fault {
        let line = node.document().text_pos_at(node.range().start).row;
        Fault::new(self.name, format!("line {line}: {what}"))
    }
}

/// What the first source that has an attribute says.
fn said<'d>(sources: &[Node<'d, 'd>], attribute: &str) -> Option<&'d str> {
    sources.iter().find_map(|n| n.attribute(attribute))
}

/// The numbers of a text; `None` where one is none.
fn numbers_of(text: &str) -> Option<Vec<f64>> {
    text.split_whitespace().map(|x| x.parse().ok()).collect()
}

#[cfg(test)]
mod tests;
