//! Runs MuJoCo, one simulation at a time. This is the crate's only module that uses pointers.
//!
//! rapier can move a free body instead. A step is taken in MuJoCo's two halves. After the first
//! half, positions, velocities and readings are those of the state before the step. Forces written
//! by hand are added between the halves, so that a law of position and speed is evaluated at the
//! state to which it belongs.

// The model of a running simulation can only be changed through an unsafe accessor.
#![allow(unsafe_code)]

mod rapier;

use std::sync::Once;

use mujoco_rs::mujoco_c::{mjLogMessage, mju_setLogHandler};
use mujoco_rs::wrappers::mj_data::MjData;
use mujoco_rs::wrappers::mj_model::{MjModel, MjtObjBase};

/// Name of the engine that takes a world's steps in place of an integrator of MuJoCo.
pub const RAPIER: &str = "rapier";

/// State beyond which a simulation has diverged, SI units. MuJoCo itself calls 1e10 huge.
const HUGE: f64 = 1e8;

/// Keeps MuJoCo's warnings away from the console and from a log file in the working directory.
fn silence() {
    static ONCE: Once = Once::new();
    unsafe extern "C" fn handler(message: *const mjLogMessage) {
        // SAFETY: MuJoCo passes a message that lives for this call.
        let Some(message) = (unsafe { message.as_ref() }) else {
            return;
        };
        // The C library does not allow a return from an error.
        assert!(
            message.level() != mujoco_rs::mujoco_c::mjtLogLevel::mjLOG_ERROR,
            "MuJoCo stopped: {}",
            message.subject()
        );
    }
    ONCE.call_once(|| {
        // SAFETY: the handler is a plain function that lives as long as the program.
        unsafe { mju_setLogHandler(Some(handler)) };
    });
}

/// Compiles a document.
///
/// # Errors
/// Returns MuJoCo's message, in one line.
pub fn compile(text: &str) -> Result<MjModel, String> {
    silence();
    MjModel::from_xml_string(text).map_err(|e| {
        let words: Vec<String> = e.to_string().split_whitespace().map(Into::into).collect();
        words.join(" ")
    })
}

/// Index of a named element.
#[must_use]
pub fn index(model: &MjModel, kind: MjtObjBase, name: &str) -> Option<usize> {
    model.name_to_id(kind, name)
}

/// Names of all elements of a kind, in order; an element without a name has an empty one.
#[must_use]
pub fn names(model: &MjModel, kind: MjtObjBase, count: i64) -> Vec<String> {
    (0..usize::try_from(count).unwrap_or(0))
        .map(|i| model.id_to_name(kind, i).unwrap_or_default().to_owned())
        .collect()
}

/// A running simulation.
pub struct Sim {
    data: MjData<Box<MjModel>>,
    /// The body in rapier, if rapier moves it.
    mover: Option<rapier::Mover>,
    /// Whether rapier moves it.
    by_rapier: bool,
    /// Time step, s.
    pub dt: f64,
    /// Time since the start of the episode, s.
    pub time: f64,
    /// Number of the episode, from 0.
    pub episode: usize,
    /// Dry friction of each degree of freedom in the model; the next field holds each geom's
    /// sliding friction.
    dry_base: Vec<f64>,
    sliding_base: Vec<f64>,
    /// What the present step adds to the dry friction; the next field holds its factors of the
    /// sliding friction.
    dry_extra: Vec<f64>,
    sliding_factor: Vec<f64>,
}

impl Sim {
    /// A simulation of a compiled model. With `by_rapier` its only body must be free.
    #[must_use]
    pub fn new(model: MjModel, by_rapier: bool) -> Self {
        let sliding = model.geom_friction().iter().map(|f| f[0]);
        Self {
            dt: model.opt().timestep,
            dry_base: model.dof_frictionloss().to_vec(),
            sliding_base: sliding.collect(),
            dry_extra: vec![0.0; model.dof_frictionloss().len()],
            sliding_factor: vec![1.0; model.geom_friction().len()],
            data: MjData::new(Box::new(model)),
            mover: None,
            by_rapier,
            time: 0.0,
            episode: 0,
        }
    }

    /// Begins an episode at an initial state.
    pub fn begin(&mut self, episode: usize, qpos: &[f64], qvel: &[f64]) {
        self.data.reset();
        self.data.qpos_mut().copy_from_slice(qpos);
        self.data.qvel_mut().copy_from_slice(qvel);
        self.time = 0.0;
        self.episode = episode;
        self.data.forward();
        let new = || rapier::Mover::new(self.data.model(), qpos, qvel);
        self.mover = self.by_rapier.then(new);
    }

    /// Takes the first half of a step: computes everything that follows from position and velocity.
    pub fn observe(&mut self) {
        self.set_coefficients();
        self.data.step1();
        self.data.qfrc_applied_mut().fill(0.0);
        self.data.xfrc_applied_mut().fill([0.0; 6]);
    }

    /// Takes the second half of a step: forces, and the state after the step.
    ///
    /// Returns `false` if the simulation has diverged.
    pub fn advance(&mut self) -> bool {
        match &mut self.mover {
            None => self.data.step2(),
            Some(mover) => {
                let (qpos, qvel) = mover.step(&self.data.xfrc_applied()[1]);
                self.data.qpos_mut().copy_from_slice(&qpos);
                self.data.qvel_mut().copy_from_slice(&qvel);
            }
        }
        self.time += self.dt;
        let fine = |x: &f64| x.abs() < HUGE;
        self.data.qpos().iter().all(fine) && self.data.qvel().iter().all(fine)
    }

    /// Positions.
    #[must_use]
    pub fn qpos(&self) -> &[f64] {
        self.data.qpos()
    }

    /// Velocities.
    #[must_use]
    pub fn qvel(&self) -> &[f64] {
        self.data.qvel()
    }

    /// Commands, writable.
    pub fn ctrl(&mut self) -> &mut [f64] {
        self.data.ctrl_mut()
    }

    /// Readings of all sensors at the state before the step.
    #[must_use]
    pub fn readings(&self) -> &[f64] {
        self.data.sensordata()
    }

    /// Generalised forces of the actuators in the last complete step.
    #[must_use]
    pub fn drive_forces(&self) -> &[f64] {
        self.data.qfrc_actuator()
    }

    /// Gravity, centrifugal and Coriolis forces, with the sign of a resistance.
    #[must_use]
    pub fn bias_forces(&self) -> &[f64] {
        self.data.qfrc_bias()
    }

    /// Inertia that a joint moves while the others are held: a diagonal entry of the mass matrix.
    #[must_use]
    pub fn inertia(&self, dof: usize) -> f64 {
        let nv = self.data.qvel().len();
        let mut all = vec![0.0; nv * nv];
        match self.data.full_m(&mut all) {
            Ok(()) => all[dof * nv + dof],
            Err(_) => 1.0,
        }
    }

    /// Adds a generalised force, N or N m.
    pub fn push_joint(&mut self, dof: usize, force: f64) {
        self.data.qfrc_applied_mut()[dof] += force;
    }

    /// Adds a force at a body's centre of mass, in the world's frame, N.
    pub fn push_body(&mut self, body: usize, force: [f64; 3]) {
        let wrench = &mut self.data.xfrc_applied_mut()[body];
        for (w, f) in wrench.iter_mut().zip(force) {
            *w += f;
        }
    }

    /// Adds a torque to a body, in the world's frame, N m.
    pub fn twist_body(&mut self, body: usize, torque: [f64; 3]) {
        let wrench = &mut self.data.xfrc_applied_mut()[body];
        for (w, t) in wrench[3..].iter_mut().zip(torque) {
            *w += t;
        }
    }

    /// Angular and linear velocity of a body at its centre of mass, in the world's frame.
    #[must_use]
    pub fn body_velocity(&self, body: usize) -> ([f64; 3], [f64; 3]) {
        let v = self
            .data
            .object_velocity(MjtObjBase::mjOBJ_BODY, body, false);
        ([v[0], v[1], v[2]], [v[3], v[4], v[5]])
    }

    /// Centre of mass of a body in the world's frame, m.
    #[must_use]
    pub fn body_position(&self, body: usize) -> [f64; 3] {
        self.data.xipos()[body]
    }

    /// Whether an actuator's command is at its limit, or its force was at its limit in the last
    /// step.
    #[must_use]
    pub fn saturated(&self, drive: usize) -> bool {
        let model = self.model();
        let at = |limited: bool, [low, high]: [f64; 2], x: f64| limited && (x <= low || x >= high);
        at(
            model.actuator_ctrllimited()[drive],
            model.actuator_ctrlrange()[drive],
            self.data.ctrl()[drive],
        ) || at(
            model.actuator_forcelimited()[drive],
            model.actuator_forcerange()[drive],
            self.data.actuator_force()[drive],
        )
    }

    /// The body on which a body pressed hardest in the last step. Moving bodies take precedence
    /// over fixed ones.
    #[must_use]
    pub fn touches(&self, body: usize) -> Option<usize> {
        let model = self.model();
        let of = |geom: i32| Some(model.geom_bodyid()[usize::try_from(geom).ok()?]);
        let mut touched: Option<(bool, f64, usize)> = None;
        for (i, contact) in self.data.contact().iter().enumerate() {
            let (Some(a), Some(b)) = (of(contact.geom1), of(contact.geom2)) else {
                continue;
            };
            let [Ok(a), Ok(b)] = [a, b].map(usize::try_from) else {
                continue;
            };
            // Contacts without force have no row among the constraints.
            if (a != body && b != body) || contact.efc_address < 0 {
                continue;
            }
            let other = if a == body { b } else { a };
            let force = match self.mover {
                None => self.data.contact_force(i)[0],
                // For a body moved by rapier, MuJoCo knows the penetration depth but not the force.
                Some(_) => -contact.dist,
            };
            let moves = model.body_weldid()[other] != 0;
            let firmer = touched.is_none_or(|(m, f, _)| (moves, force) > (m, f));
            if force > 0.0 && firmer {
                touched = Some((moves, force, other));
            }
        }
        touched.map(|(_, _, other)| other)
    }

    /// The compiled model.
    #[must_use]
    pub fn model(&self) -> &MjModel {
        self.data.model()
    }

    /// Adds to the dry friction of a degree of freedom during the next step, N or N m.
    pub fn add_dry_friction(&mut self, dof: usize, force: f64) {
        self.dry_extra[dof] += force;
    }

    /// Multiplies the sliding friction of a geom during the next step.
    pub fn scale_sliding_friction(&mut self, geom: usize, factor: f64) {
        self.sliding_factor[geom] *= factor;
    }

    /// Writes the coefficients of the next step into the model and resets them.
    fn set_coefficients(&mut self) {
        // SAFETY: only numbers of the model change; no size and no index changes.
        let model = unsafe { self.data.model_mut() };
        let dry = model.dof_frictionloss_mut().iter_mut();
        for ((to, base), extra) in dry.zip(&self.dry_base).zip(&mut self.dry_extra) {
            *to = (base + std::mem::take(extra)).max(0.0);
        }
        let sliding = model.geom_friction_mut().iter_mut();
        for ((to, base), factor) in sliding
            .zip(&self.sliding_base)
            .zip(&mut self.sliding_factor)
        {
            to[0] = base * std::mem::replace(factor, 1.0);
        }
    }
}
