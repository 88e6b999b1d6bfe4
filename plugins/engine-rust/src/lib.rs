//! An engine plugin in Rust: rigid bodies in free flight.
//!
//! It is the smallest engine that is still useful: bodies on free joints under gravity, pushes and
//! hooks, without contact. It is an example to copy. A [`Backend`] loads scenes ([`model`]) and
//! refuses what it lacks ([`refusal`]). A simulator (`simulator.rs`) makes whole-batch calls on as
//! many threads as there are, with the physics of one body in [`flight`]. One line makes the crate
//! a library for `asid --plugin`.

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
