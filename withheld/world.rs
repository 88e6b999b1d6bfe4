//! A world: a machine's model with edits, and forces and filters outside the engine.
//!
//! A cause changes a world in one of four ways. It edits the model's text, filters a command, adds
//! a force between the two halves of a step, or distorts a sensor's reading.

use crate::anatomy::Anatomy;
use crate::document::Element;
use crate::engine::{self, Sim};
use crate::error::{Error, Result};
use mujoco_rs::wrappers::mj_model::MjModel;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion};

/// Transforms a command on its way to the actuator.
pub trait CommandPath: Send {
    /// Announces the number of the episode that begins.
    fn episode(&mut self, _number: usize) {}
    /// Begins an episode before which the command was `first`.
    fn begin(&mut self, first: f64, dt: f64);
    /// Returns the command that arrives during the next step, given the command sent in it.
    fn next(&mut self, sent: f64) -> f64;
}

/// A force, or a change of contact coefficients, that is computed outside the engine.
pub trait Force: Send {
    /// Begins an episode.
    fn begin(&mut self, _sim: &mut Sim) {}
    /// Acts before the step: changes coefficients that the engine reads while it finds contacts.
    fn before(&mut self, _sim: &mut Sim) {}
    /// Acts between the halves of the step: adds forces at the present position and velocity.
    fn act(&mut self, sim: &mut Sim);
}

/// Distorts one value of a reading.
pub trait ReadingPath: Send {
    /// Distorts the value over an episode: one entry per time step of `dt` s.
    fn distort(&self, values: &mut [f64], dt: f64, episode: usize);
}

/// A change of a body's mass, centre of mass and moments of inertia.
#[derive(Clone, Debug)]
pub struct InertiaEdit {
    /// Body.
    pub body: String,
    /// Factor of the mass; the moments of inertia scale with it.
    pub mass: f64,
    /// Added mass with the same distribution as the body's, kg.
    pub payload: f64,
    /// Shift of the centre of mass in the body's frame, m.
    pub shift: [f64; 3],
    /// Factor of the moments of inertia about the centre of mass.
    pub moments: f64,
}

impl InertiaEdit {
    /// An edit that changes nothing.
    #[must_use]
    pub fn of(body: &str) -> Self {
        Self {
            body: body.to_owned(),
            mass: 1.0,
            payload: 0.0,
            shift: [0.0; 3],
            moments: 1.0,
        }
    }
}

/// A world, ready to be run.
pub struct World {
    /// Whether rapier moves it instead of MuJoCo.
    pub by_rapier: bool,
    /// The model.
    pub document: Element,
    /// Changes of the bodies' inertias.
    pub inertias: Vec<InertiaEdit>,
    /// Command filters, applied in order, each with the index of its actuator.
    pub commands: Vec<(usize, Box<dyn CommandPath>)>,
    /// Forces that act between the halves of a step.
    pub forces: Vec<Box<dyn Force>>,
    /// Distortions of readings, applied in order, each with its index in the row of readings.
    pub readings: Vec<(usize, Box<dyn ReadingPath>)>,
    /// Quantisation steps of readings: index in the row of readings, and size of the step.
    pub steps: Vec<(usize, f64)>,
}

impl World {
    /// The machine of the study's model with the true values of the study's parameters.
    ///
    /// It runs at another time step, with an integrator of MuJoCo or moved by
    /// [rapier](engine::RAPIER).
    ///
    /// # Errors
    /// If a parameter's target is not in the model.
    pub fn new(anatomy: &Anatomy, truth: &[f64], timestep: f64, integrator: &str) -> Result<Self> {
        let mut world = Self {
            by_rapier: integrator == engine::RAPIER,
            document: anatomy.document.clone(),
            inertias: Vec::new(),
            commands: Vec::new(),
            forces: Vec::new(),
            readings: Vec::new(),
            steps: Vec::new(),
        };
        for (parameter, &value) in anatomy.machine.parameters.iter().zip(truth) {
            set_target(&mut world.document, parameter.target, value).ok_or_else(|| {
                Error::Element {
                    machine: anatomy.machine.name.to_owned(),
                    element: "target".into(),
                    name: parameter.target.into(),
                }
            })?;
        }
        if let Some(option) = world.document.find_mut("option", None) {
            option.set_numbers("timestep", &[timestep]);
            if !world.by_rapier {
                option.set("integrator", integrator);
            }
            if !option.children.iter().any(|c| c.tag == "flag") {
                option.children.push(Element::new("flag"));
            }
            // A diverged simulation must be seen, not restarted.
            for flag in option.children.iter_mut().filter(|c| c.tag == "flag") {
                flag.set("autoreset", "disable");
            }
        }
        Ok(world)
    }

    /// Compiles the model with all its edits.
    ///
    /// # Errors
    /// Returns MuJoCo's message.
    pub fn compile(&self, machine: &str) -> Result<MjModel> {
        let refused = |message: String| Error::Model {
            machine: machine.to_owned(),
            message,
        };
        let plain = engine::compile(&self.document.text()).map_err(refused)?;
        if self.inertias.is_empty() {
            return Ok(plain);
        }
        let mut document = self.document.clone();
        let mut bodies: Vec<&str> = self.inertias.iter().map(|i| i.body.as_str()).collect();
        bodies.sort_unstable();
        bodies.dedup();
        for name in bodies {
            let edits = self.inertias.iter().filter(|i| i.body == name);
            let inertial = inertial(&plain, name, edits);
            if let (Some(body), Some(inertial)) = (document.find_mut("body", Some(name)), inertial)
            {
                body.children.retain(|c| c.tag != "inertial");
                body.children.insert(0, inertial);
            }
        }
        engine::compile(&document.text()).map_err(refused)
    }

    /// Changes an attribute of a joint; a missing attribute counts as 0.
    pub fn edit_joint(&mut self, name: &str, attribute: &str, change: impl Fn(f64) -> f64) {
        if let Some(joint) = self.document.find_mut("joint", Some(name)) {
            let old = joint.number(attribute).unwrap_or(0.0);
            joint.set_numbers(attribute, &[change(old)]);
        }
    }

    /// Changes one value of an attribute of a geom; a missing value stays missing.
    pub fn edit_geom(
        &mut self,
        name: &str,
        attribute: &str,
        at: usize,
        change: impl Fn(f64) -> f64,
    ) {
        if let Some(geom) = self.document.find_mut("geom", Some(name)) {
            let mut values = geom.numbers(attribute);
            if let Some(value) = values.get_mut(at) {
                *value = change(*value);
                geom.set_numbers(attribute, &values);
            }
        }
    }

    /// Adds dry friction to a joint; 0 if a law adds it at each step.
    ///
    /// The friction is the engine's own. It is so stiff that a held joint creeps by less than a
    /// thousandth of the speed that its load would give it in 1 ms.
    pub fn dry_joint(&mut self, name: &str, force: f64, timestep: f64) {
        if let Some(joint) = self.document.find_mut("joint", Some(name)) {
            let old = joint.number("frictionloss").unwrap_or(0.0);
            joint.set_numbers("frictionloss", &[old + force]);
            joint.set_numbers("solreffriction", &[2.0 * timestep, 1.0]);
            joint.set_numbers("solimpfriction", &[0.999, 0.999, 0.001]);
        }
    }

    /// Time step, s.
    #[must_use]
    pub fn timestep(&self) -> f64 {
        let option = self.document.find("option", None);
        option.and_then(|o| o.number("timestep")).unwrap_or(0.002)
    }
}

/// Sets the value of a study's parameter.
fn set_target(document: &mut Element, target: &str, value: f64) -> Option<()> {
    let mut parts = target.split('/');
    let (tag, name, attribute) = (parts.next()?, parts.next()?, parts.next()?);
    let element = document.find_mut(tag, Some(name))?;
    let mut values = element.numbers(attribute);
    let at: usize = parts.next().map_or(Ok(0), str::parse).ok()?;
    *values.get_mut(at)? = value;
    element.set_numbers(attribute, &values);
    Some(())
}

/// The `<inertial>` of a body after some edits.
fn inertial<'a>(
    model: &MjModel,
    name: &str,
    edits: impl Iterator<Item = &'a InertiaEdit>,
) -> Option<Element> {
    use mujoco_rs::wrappers::mj_model::MjtObjBase;
    let id = engine::index(model, MjtObjBase::mjOBJ_BODY, name)?;
    let (mut mass, mut center) = (model.body_mass()[id], model.body_ipos()[id]);
    let [w, x, y, z] = model.body_iquat()[id];
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_rotation_matrix();
    let [a, b, c] = model.body_inertia()[id];
    let mut moments =
        turn.matrix() * Matrix3::from_diagonal(&[a, b, c].into()) * turn.matrix().transpose();
    for edit in edits {
        let factor = edit.mass * (mass * edit.mass + edit.payload) / (mass * edit.mass);
        mass *= factor;
        moments *= factor * edit.moments;
        for (c, s) in center.iter_mut().zip(edit.shift) {
            *c += s;
        }
    }
    let mut element = Element::new("inertial");
    element.set_numbers("pos", &center);
    element.set_numbers("mass", &[mass]);
    let m = moments;
    let full = [
        m[(0, 0)],
        m[(1, 1)],
        m[(2, 2)],
        m[(0, 1)],
        m[(0, 2)],
        m[(1, 2)],
    ];
    element.set_numbers("fullinertia", &full);
    Some(element)
}
