//! rapier as a backend of ASID: pure Rust, no native library.
//!
//! A scene goes through `rapier3d-mjcf` into rapier's multibodies (articulated trees in reduced
//! coordinates) and plain rigid bodies. A batch is a set of such worlds, each stepped by one thread
//! at a time. This crate adds what the loader leaves at a game's defaults or does not know: mass
//! properties, joint forces, drives, sensors, contact rules, friction.
//!
//! # What it computes
//!
//! - Time is divided into substeps of at most 1 ms (at least two a step), integrated
//!   semi-implicitly. Each solves its constraints once, warm-started.
//! - Springs, dampers and servos are implicit and solved together with the mass matrix (module
//!   `drive`), so gains may be stiff. `frictionloss` is a bounded constraint of each degree of
//!   freedom. Armature is added to the mass matrix.
//! - Friction of contacts is Coulomb's, point by point, with MuJoCo's rules for pairs (module
//!   `pairs`). rapier turns the friction of a sliding point away from its slip; module `slip` turns
//!   it back.
//! - Torsional and rolling friction are torques from the normal force of the previous step (module
//!   `contact`).
//! - A state is a copy of rapier's collections and continues to the bit. Setting a state starts
//!   from the world as built, so it has no memory. Contact forces that are read of it are those of
//!   the step that would follow.
//!
//! # Accuracy
//!
//! | what | error against theory |
//! |---|---|
//! | distance that a box or a rod slides, any direction, friction 0.1 to 0.5 | 0.1 to 0.5 % |
//! | incline at 0.97 of the angle of friction: creep | 0.02 mm at first, then none in 10 s |
//! | distance that a ball rolls out, `a = 5/7 mu_r g / R` | 0.2 % |
//! | spin-down of a ball, `mu_t N / I` | 0.1 % |
//! | normal force of a box at rest | 0.01 % |
//! | sinking in of a body under its own weight | 6 µm |
//! | energy of a pendulum of 0.5 rad | swings by 0.2 %, no drift in 10 s |
//! | servo at half of critical damping, step response | 0.4 % of the step (backward Euler) |
//! | slip of a 0.2 kg rod in a grip of 50 N, carried 0.6 m | 0.7 mm |
//!
//! # Differences from MuJoCo
//!
//! - Single precision: a finite-difference derivative needs steps of about a hundredth of a
//!   parameter's range.
//! - Contacts are equally stiff everywhere (200 Hz, overdamped). `solref` and `solimp` are not
//!   read, and restitution is zero; a `solref` that bounces is refused. Contacts do not lift a
//!   sliding body as MuJoCo's convex cone does, so trajectories depend on parameters more smoothly.
//! - Bounds of sliding, spinning and rolling friction are independent; a sliding contact resists
//!   spinning no less. A sphere touches in one point.
//! - In contacts with a moving link the direction of friction is corrected with the inertia of the
//!   free body alone; sticking contacts are not corrected. A contact with a tree solves its two
//!   directions separately.
//! - Statics do not determine how a face shares its load between its corners, and rapier's solution
//!   differs: the moment of a spinning rod's ends is 3 % lower.
//! - `margin` and `gap` are not read; joint limits are hard.
//! - `<equality><joint>` couples only joints of one tree, and only linearly.
//! - The saturation of a servo is judged by the force that it would reach at the end of the step,
//!   where MuJoCo takes that of the start.
//! - Not simulated, and refused: actuators with states, with a damping or an armature of their own,
//!   `<general>` ones with another law than that of a motor, a position or a velocity servo, groups
//!   of actuators that are switched off, tendons, flexes, stiffness and damping of higher order,
//!   meshes, height fields and ellipsoids in contact, fluids, damped free joints, springs and
//!   limits of ball joints, a `<pair>` whose friction differs by direction. Sensors other than
//!   positions, orientations and velocities of frames and joints, and sensors with a delay of their
//!   own, are refused when they are requested.
//!
//! # Speed
//!
//! A Panda at rest beside a rod on a table takes 35 thousand steps a second on one core at a step
//! of 2 ms, and about 28 thousand with a gripped or pushed rod. Most of the time goes into the mass
//! matrix of the arm. Saving or loading that state takes 8 µs, a quarter of a step.

#[doc(hidden)]
pub mod bare;
mod batch;
mod compile;
mod compiled;
mod contact;
mod convert;
mod coordinates;
mod document;
mod drive;
mod pairs;
mod parameter;
mod pool;
mod reading;
mod refusal;
mod sensor;
mod settings;
mod slip;
mod slot;
mod state;
mod structure;
mod tables;
mod world;

use std::sync::Arc;

use asid_core::backend::{Backend, Capabilities, Model};
use asid_core::{BatchConfig, Layout, Result, Scene, Simulator, Target};

use crate::batch::Batch;
use crate::compiled::Compiled;
use crate::parameter::ParameterSlot;

/// Version of rapier that this crate is built against.
const VERSION: &str = "0.36";

/// The engine.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rapier;

struct RapierModel(Arc<Compiled>);

impl Backend for Rapier {
    fn name(&self) -> &str {
        "rapier"
    }

    fn version(&self) -> String {
        VERSION.into()
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities::all()
            - Capabilities::CONTACT_STIFFNESS
            - Capabilities::DOUBLE_PRECISION
            - Capabilities::MESHES
    }

    fn load(&self, scene: &Scene) -> Result<Arc<dyn Model>> {
        Ok(Arc::new(RapierModel(Arc::new(Compiled::new(scene)?))))
    }
}

impl Model for RapierModel {
    fn layout(&self) -> &Layout {
        &self.0.layout
    }

    fn engine(&self) -> String {
        format!("rapier {VERSION}")
    }

    fn nominal(&self, target: &Target) -> Result<f64> {
        Ok(ParameterSlot::resolve(target, &self.0)?.get(&self.0.nominal, &self.0))
    }

    fn simulator(&self, config: &BatchConfig) -> Result<Box<dyn Simulator>> {
        Ok(Box::new(Batch::new(Arc::clone(&self.0), config)?))
    }
}

asid_core::register!(BackendEntry {
    name: "rapier",
    about: "rapier 0.36: pure Rust, single precision, always there",
    make: || Ok(Box::new(Rapier)),
});
