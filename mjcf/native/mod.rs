//! Writes values and effects back into a plain MJCF document.
//!
//! A [`NativeModel`] collects the content: values of targets, and what effects require of
//! actuators, joints, bodies and sensors. [`NativeModel::write`] writes it with MJCF's own elements
//! and attributes, so that any program that loads MJCF can simulate it. Elements are changed in
//! place ([`crate::markup`]). What MJCF cannot express is left out and reported, one sentence each.

mod actuator;
mod assets;
mod elements;
mod frame;
mod joint;
mod mass;
mod transmission;

use std::collections::BTreeMap;
use std::path::Path;

use asid_core::error::{Error, Result};
use asid_core::{Model, Scene, Target};
use roxmltree::{Document, Node};

use crate::Plant;
use crate::markup::Markup;
use crate::memory;
pub use assets::way;
use elements::Elements;

/// Changes of an actuator's command and force, beside its gains.
#[derive(Clone, Debug, PartialEq)]
pub struct NativeActuator {
    /// Factor of the command, after the command's range.
    pub gain: f64,
    /// Offset of the command, in its unit.
    pub bias: f64,
    /// Pure delay of the command, s.
    pub delay: f64,
    /// Time constant of a first-order lag, s.
    pub lag: f64,
    /// Largest force on the joint (N or N m), gear included.
    pub limit: Option<f64>,
}

impl Default for NativeActuator {
    fn default() -> Self {
        Self {
            gain: 1.0,
            bias: 0.0,
            delay: 0.0,
            lag: 0.0,
            limit: None,
        }
    }
}

/// A spring in parallel with a joint: force `-(stiffness d + cubic d³)`, `d = q - rest`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// N m/rad or N/m.
    pub stiffness: f64,
    /// Position without force, rad or m.
    pub rest: f64,
    /// N m/rad³ or N/m³.
    pub cubic: f64,
}

/// Play and elasticity between a drive and its joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Series {
    /// Play, rad or m from end to end.
    pub gap: f64,
    /// Compliance, rad/(N m) or m/N.
    pub compliance: f64,
    /// Damping ratio of the rotor's swing on the compliance.
    pub loss: f64,
}

/// Additions to a joint, beside its own attributes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NativeJoint {
    /// Dry friction to add, N or N m.
    pub friction: f64,
    /// Springs to add.
    pub springs: Vec<Spring>,
    /// Play or elasticity between it and its drive.
    pub series: Option<Series>,
}

/// The content of a document to be written.
#[derive(Clone, Debug)]
pub struct NativeModel<'p> {
    /// The machine.
    pub plant: &'p Plant,
    /// Values of the document's targets.
    pub values: Vec<(Target, f64)>,
    actuators: BTreeMap<usize, NativeActuator>,
    joints: BTreeMap<usize, NativeJoint>,
    /// Share of a body's weight in the scene that is compensated, to add.
    gravity_compensation: BTreeMap<usize, f64>,
    /// Delays of sensors, s.
    sensor_delays: BTreeMap<usize, f64>,
}

/// A document that was written.
#[derive(Clone, Debug)]
pub struct Written {
    /// Its text.
    pub xml: String,
    /// What it leaves out, a sentence each.
    pub left_out: Vec<String>,
}

impl<'p> NativeModel<'p> {
    /// The machine without changes.
    #[must_use]
    pub fn new(plant: &'p Plant) -> Self {
        Self {
            plant,
            values: Vec::new(),
            actuators: BTreeMap::new(),
            joints: BTreeMap::new(),
            gravity_compensation: BTreeMap::new(),
            sensor_delays: BTreeMap::new(),
        }
    }

    /// Additions to an actuator.
    ///
    /// # Errors
    /// When there is no such actuator.
    pub fn actuator(&mut self, name: &str) -> Result<&mut NativeActuator> {
        let index = self.plant.layout.actuator(name)?;
        Ok(self.actuators.entry(index).or_default())
    }

    /// Additions to a joint.
    ///
    /// # Errors
    /// When there is no such joint.
    pub fn joint(&mut self, name: &str) -> Result<&mut NativeJoint> {
        self.plant.layout.joint(name)?;
        let joints = &self.plant.layout.joints;
        let index = joints.iter().position(|j| j.name == name).unwrap_or(0);
        Ok(self.joints.entry(index).or_default())
    }

    /// Adds to the share of a body's weight in the scene that is compensated (`gravcomp`).
    ///
    /// It is a constant force: another mass of the body leaves it as it is.
    ///
    /// # Errors
    /// When there is no such body.
    pub fn carry(&mut self, body: &str, share: f64) -> Result<()> {
        let index = self.plant.layout.body(body)?;
        *self.gravity_compensation.entry(index).or_default() += share;
        Ok(())
    }

    /// Adds a delay (s) to a sensor's reading.
    ///
    /// # Errors
    /// When there is no such sensor.
    pub fn delay_sensor(&mut self, name: &str, delay: f64) -> Result<()> {
        self.plant.layout.sensor(name)?;
        let sensors = &self.plant.layout.sensors;
        let index = sensors.iter().position(|s| s.name == name).unwrap_or(0);
        *self.sensor_delays.entry(index).or_default() += delay;
        Ok(())
    }

    /// Writes the document for a folder, with paths from there to the scene's assets.
    ///
    /// `model` is the compiled scene without values or effects.
    ///
    /// # Errors
    /// When the document has elements that generate others (`replicate`, `composite`, `attach`), or
    /// a value has no target in it.
    pub fn write(&self, scene: &Scene, model: &dyn Model, folder: &Path) -> Result<Written> {
        let parse = |e: roxmltree::Error| Error::Scene {
            scene: scene.name().to_owned(),
            message: e.to_string(),
        };
        let document = Document::parse(scene.xml()).map_err(parse)?;
        let elements = Elements::find(scene, &document, &self.plant.layout)?;
        let mut writer = Writer {
            native: self,
            model,
            scene,
            elements,
            markup: Markup::new(&document),
            left_out: Vec::new(),
        };
        writer.write_bodies()?;
        writer.write_geoms()?;
        writer.write_joints()?;
        writer.write_actuators()?;
        writer.write_sensors();
        writer.write_gravity()?;
        writer.write_assets(folder);
        writer.write_transmissions()?;
        Ok(Written {
            xml: writer.markup.text(),
            left_out: writer.left_out,
        })
    }
}

/// A document being written.
struct Writer<'w, 'd> {
    native: &'w NativeModel<'w>,
    model: &'w dyn Model,
    scene: &'w Scene,
    elements: Elements<'d>,
    markup: Markup<'d>,
    left_out: Vec<String>,
}

impl Writer<'_, '_> {
    /// The requested value of a target, if there is one and it differs from the document's.
    fn changed(&self, target: &Target) -> Result<Option<f64>> {
        let found = self.native.values.iter().find(|(t, _)| t == target);
        match found {
            Some((_, value)) if *value != self.model.nominal(target)? => Ok(Some(*value)),
            _ => Ok(None),
        }
    }

    /// The value that a target will have.
    fn value(&self, target: &Target) -> Result<f64> {
        match self.changed(target)? {
            Some(value) => Ok(value),
            None => self.model.nominal(target),
        }
    }

    /// The entries of an attribute, if one of them is to change.
    fn entries(
        &self,
        element: &str,
        name: &str,
        attribute: &str,
        len: usize,
    ) -> Result<Option<Vec<f64>>> {
        let targets: Vec<Target> = (0..len)
            .map(|i| Target::new(element, name, attribute, i))
            .collect();
        let asked = targets
            .iter()
            .any(|t| self.native.values.iter().any(|(other, _)| other == t));
        if !asked {
            return Ok(None);
        }
        let mut any = false;
        for t in &targets {
            any |= self.changed(t)?.is_some();
        }
        if !any {
            return Ok(None);
        }
        targets
            .iter()
            .map(|t| self.value(t))
            .collect::<Result<_>>()
            .map(Some)
    }

    /// Reports what the document leaves out.
    fn leave_out(&mut self, sentence: String) {
        self.left_out.push(sentence);
    }

    fn write_geoms(&mut self) -> Result<()> {
        for i in 0..self.native.plant.layout.geoms.len() {
            let name = self.native.plant.layout.geoms[i].clone();
            let node = self.elements.geoms[i];
            for (attribute, len) in [("friction", 3), ("solref", 2), ("mass", 1), ("pos", 3)] {
                let Some(values) = self.entries("geom", &name, attribute, len)? else {
                    continue;
                };
                let has = |n: Node<'_, '_>| n.has_attribute("fromto");
                if attribute == "pos" && (has(node) || self.elements.default_has("geom", "fromto"))
                {
                    self.leave_out(format!(
                        "geom `{name}` lies between two points (`fromto`): its new place {values:?} is not written"
                    ));
                    continue;
                }
                if attribute == "pos" {
                    self.write_place(&format!("geom `{name}`"), node, attribute, &values);
                } else {
                    self.markup.set_numbers(node, attribute, &values);
                }
            }
        }
        Ok(())
    }

    fn write_sensors(&mut self) {
        let timestep = self.native.plant.layout.timestep;
        for (&i, &delay) in &self.native.sensor_delays {
            let node = self.elements.sensors[i];
            let delay = memory::delay(self.elements.root, node) + delay;
            self.markup.set_numbers(node, "delay", &[delay]);
            let samples = (delay / timestep).ceil() + elements::HISTORY_MARGIN;
            self.markup.set_numbers(node, "nsample", &[samples]);
            self.markup.set(node, "interp", "cubic");
        }
    }

    fn write_gravity(&mut self) -> Result<()> {
        let Some(gravity) = self.entries("option", "", "gravity", 3)? else {
            return Ok(());
        };
        match self.elements.options.last().copied() {
            Some(node) => self.markup.set_numbers(node, "gravity", &gravity),
            None => {
                let text = crate::markup::numbers(&gravity);
                let root = self.elements.root;
                self.markup
                    .append(root, &format!("  <option gravity=\"{text}\"/>\n"));
            }
        }
        Ok(())
    }
}
