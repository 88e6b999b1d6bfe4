//! The elements of a document, in the order of the layout.

use crate::classes;
use asid_core::Scene;
use asid_core::error::{Error, Result};
use asid_core::layout::Layout;
use roxmltree::{Document, Node};

/// Samples of a history of commands or readings beyond its delay.
///
/// Linear interpolation needs one more to either side, and a cubic two.
pub const HISTORY_MARGIN: f64 = 3.0;

/// Elements by their index in a layout.
pub struct Elements<'d> {
    /// The document's root.
    pub root: Node<'d, 'd>,
    /// All `<compiler>`.
    pub compilers: Vec<Node<'d, 'd>>,
    /// All `<option>`.
    pub options: Vec<Node<'d, 'd>>,
    /// Bodies, the world first.
    pub bodies: Vec<Node<'d, 'd>>,
    /// Geoms.
    pub geoms: Vec<Node<'d, 'd>>,
    /// Joints of all kinds.
    pub joints: Vec<Node<'d, 'd>>,
    /// Actuators.
    pub actuators: Vec<Node<'d, 'd>>,
    /// Sensors.
    pub sensors: Vec<Node<'d, 'd>>,
}

/// Elements that generate others.
const GENERATORS: [&str; 5] = ["replicate", "composite", "flexcomp", "attach", "model"];

impl<'d> Elements<'d> {
    /// Finds the elements.
    ///
    /// # Errors
    /// When the document does not contain each element of the layout itself.
    pub fn find(scene: &Scene, document: &'d Document<'d>, layout: &Layout) -> Result<Self> {
        let root = document.root_element();
        let sections = |tag: &'static str| {
            let all = root.children().filter(move |n| n.has_tag_name(tag));
            all.collect::<Vec<_>>()
        };
        let entries = |tag: &'static str| -> Vec<Node<'d, 'd>> {
            let all = sections(tag).into_iter().flat_map(|s| s.children());
            all.filter(Node::is_element).collect()
        };
        let mut found = Self {
            root,
            compilers: sections("compiler"),
            options: sections("option"),
            bodies: Vec::new(),
            geoms: Vec::new(),
            joints: Vec::new(),
            actuators: entries("actuator"),
            sensors: entries("sensor"),
        };
        let worlds = sections("worldbody");
        if let Some(first) = worlds.first() {
            found.bodies.push(*first);
        }
        // The world's own elements come first, whichever of its sections they are in.
        let mut below = Vec::new();
        for world in &worlds {
            found.parts(*world, &mut below);
        }
        for body in below {
            found.body(body);
        }
        for (what, have, want) in [
            ("bodies", found.bodies.len(), layout.bodies.len()),
            ("geoms", found.geoms.len(), layout.geoms.len()),
            ("joints", found.joints.len(), layout.joints.len()),
            ("actuators", found.actuators.len(), layout.actuators.len()),
            ("sensors", found.sensors.len(), layout.sensors.len()),
        ] {
            if have != want {
                let made = document
                    .descendants()
                    .find(|n| GENERATORS.iter().any(|g| n.has_tag_name(*g)));
                let why = made.map_or_else(String::new, |n| {
                    format!(", since <{}> makes some", n.tag_name().name())
                });
                return Err(Error::Scene {
                    scene: scene.name().to_owned(),
                    message: format!(
                        "the document holds {have} {what} where the model has {want}{why}; save it by MuJoCo \
                         (mj_saveLastXML) and use that document"
                    ),
                });
            }
        }
        Ok(found)
    }

    /// Adds a body and its descendants.
    fn body(&mut self, node: Node<'d, 'd>) {
        self.bodies.push(node);
        let mut below = Vec::new();
        self.parts(node, &mut below);
        for child in below {
            self.body(child);
        }
    }

    /// Adds the geoms and joints of a body, also those inside frames, and lists its child bodies.
    fn parts(&mut self, node: Node<'d, 'd>, below: &mut Vec<Node<'d, 'd>>) {
        for child in node.children() {
            match child.tag_name().name() {
                "geom" => self.geoms.push(child),
                "joint" | "freejoint" => self.joints.push(child),
                "body" => below.push(child),
                "frame" => self.parts(child, below),
                _ => {}
            }
        }
    }

    /// The value of an attribute of the compiler: the last one in the document.
    pub fn compiler(&self, attribute: &str) -> Option<&'d str> {
        let said = self.compilers.iter().rev();
        said.filter_map(|c| c.attribute(attribute)).next()
    }

    /// Whether any default class sets an attribute of an element.
    pub fn default_has(&self, tag: &str, attribute: &str) -> bool {
        let sections = self.root.children().filter(|n| n.has_tag_name("default"));
        let mut all = sections.flat_map(|s| s.descendants());
        all.any(|n| n.has_tag_name(tag) && n.has_attribute(attribute))
    }

    /// What an element or a default class of it says ([`classes::said`]).
    pub fn said<T>(&self, node: Node<'_, '_>, of: impl Fn(Node<'_, '_>) -> Option<T>) -> Option<T> {
        classes::said(self.root, node, of)
    }

    /// Unit of the document's angles per rad: 1, or 180/π where the document uses degrees.
    pub fn angle_unit(&self) -> f64 {
        match self.compiler("angle") {
            Some("radian") => 1.0,
            _ => 180.0 / std::f64::consts::PI,
        }
    }
}
