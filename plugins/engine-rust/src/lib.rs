//! An engine plugin in Rust: rigid bodies in free flight.
//!
//! The smallest engine that is still worth simulating with: bodies on free joints
//! under gravity, pushes and hooks, without contact. It is here to be copied: a
//! [`Backend`] that loads scenes ([`model`]) and refuses what it lacks ([`refusal`]),
//! a simulator (`simulator.rs`) of whole-batch calls on as many threads as there are, the physics
//! of one body ([`flight`]), and one line that makes it a library for `asid --plugin`.

pub mod flight;
pub mod model;
pub mod refusal;
pub mod simulation;
mod simulator;

use std::sync::Arc;

use asid_core::{Backend, Capabilities, Model, Result, Scene};

/// The engine.
#[derive(Clone, Copy, Debug, Default)]
pub struct FreeFlight;

impl Backend for FreeFlight {
    fn name(&self) -> &str {
        "free-flight"
    }

    fn version(&self) -> String {
        env!("CARGO_PKG_VERSION").to_owned()
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities::FREE_BODIES
            | Capabilities::EXTERNAL_FORCES
            | Capabilities::PARAMETER_CHANGES
            | Capabilities::STEP_HOOKS
            | Capabilities::EXACT_SNAPSHOT
            | Capabilities::DOUBLE_PRECISION
    }

    fn load(&self, scene: &Scene) -> Result<Arc<dyn Model>> {
        Ok(Arc::new(model::FlightModel::load(scene)?))
    }
}

asid_abi::export_backend!("rigid bodies in free flight, an example", Ok(FreeFlight));
