//! A world: a machine's model with edits, and what was written by hand beside the engine.
//!
//! A cause changes a world in one of four ways: it edits the model's text, it filters a command, it
//! adds a force between the two halves of a step, or it distorts what a sensor reads.

use crate::anatomy::Anatomy;
use crate::document::Element;
use crate::engine::{self, Sim};
use crate::error::{Error, Result};
use mujoco_rs::wrappers::mj_model::MjModel;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion};

/// What happens to a command on its way.
pub trait CommandPath: Send {
    /// Says which episode begins.
    fn episode(&mut self, _number: usize) {}
    /// Begins an episode whose command was `first` before it.
    fn begin(&mut self, first: f64, dt: f64);
    /// The command that arrives during the next step, of the one that is sent in it.
    fn next(&mut self, sent: f64) -> f64;
}

/// A force, or a change of the contacts, by hand.
pub trait Force: Send {
    /// Begins an episode.
    fn begin(&mut self, _sim: &mut Sim) {}
    /// Before the step: changes of coefficients that the engine reads while it finds contacts.
    fn before(&mut self, _sim: &mut Sim) {}
    /// Between the halves of the step: forces at the present position and velocity.
    fn act(&mut self, sim: &mut Sim);
}

/// What happens to one number of a reading on its way.
pub trait ReadingPath: Send {
    /// Distorts the number over an episode, one value a time step of `dt` s.
    fn distort(&self, values: &mut [f64], dt: f64, episode: usize);
}

/// A change of a body's mass, centre and moments.
#[derive(Clone, Debug)]
pub struct InertiaEdit {
    /// Body.
    pub body: String,
    /// Factor of the mass; the moments grow with it.
    pub mass: f64,
    /// Mass that is added in proportion, kg.
    pub payload: f64,
    /// Shift of the centre in the body's frame, m.
    pub shift: [f64; 3],
    /// Factor of the moments about the centre.
    pub moments: f64,
}

impl InertiaEdit {
    /// No change of a body.
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
    /// Whether rapier moves it, and not MuJoCo.
    pub by_rapier: bool,
    /// The model.
    pub document: Element,
    /// Changes of bodies.
    pub inertias: Vec<InertiaEdit>,
    /// What happens to commands: index of the actuator, and how; in order.
    pub commands: Vec<(usize, Box<dyn CommandPath>)>,
    /// Forces by hand.
    pub forces: Vec<Box<dyn Force>>,
    /// What happens to readings: index in the row of readings, and how; in order.
    pub readings: Vec<(usize, Box<dyn ReadingPath>)>,
    /// Steps of readings: index in the row of readings, size of a step.
    pub steps: Vec<(usize, f64)>,
}

impl World {
    /// The machine as its model has it, but with the true values of the study's parameters, at
    /// another time step, by an integrator of MuJoCo's or by [rapier](engine::RAPIER).
    ///
    /// # Errors
    /// Where a parameter's target is not in the model.
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
            // A simulation that went bad must be seen, not restarted.
            for flag in option.children.iter_mut().filter(|c| c.tag == "flag") {
                flag.set("autoreset", "disable");
            }
        }
        Ok(world)
    }

    /// Compiles the model with all its edits.
    ///
    /// # Errors
    /// MuJoCo's message.
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

    /// Changes an attribute of a joint: the old value, 0 where there is none, to the new one.
    pub fn edit_joint(&mut self, name: &str, attribute: &str, change: impl Fn(f64) -> f64) {
        if let Some(joint) = self.document.find_mut("joint", Some(name)) {
            let old = joint.number(attribute).unwrap_or(0.0);
            joint.set_numbers(attribute, &[change(old)]);
        }
    }

    /// Changes a number of an attribute of a geom; one that is not there stays so.
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

    /// Adds dry friction to a joint (0 where a law adds it from step to step): the engine's, stiff enough
    /// that what it holds creeps by less than a thousandth of what the load would accelerate it to in 1 ms.
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

/// Sets what a study's parameter names.
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
