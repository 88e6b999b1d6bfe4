//! rapier as a backend of ASID: pure Rust, no native library.
//!
//! A scene goes through `rapier3d-mjcf` into rapier's multibodies, and a batch
//! is a pool of such worlds.

mod batch;
mod compiled;
mod contact;
mod convert;
mod coordinates;
mod drive;
mod names;
mod parameter;
mod refusal;
mod sensor;
mod settings;
mod slip;
mod state;
mod structure;
mod world;

use std::sync::Arc;

use asid_core::backend::{Backend, Capabilities, Model};
use asid_core::registry::BackendEntry;
use asid_core::{BatchConfig, Layout, Result, Scene, Simulator, Target};

use crate::batch::Batch;
use crate::compiled::Compiled;
use crate::parameter::Knob;

/// Version of the rapier that this crate is built against.
const VERSION: &str = "rapier3d 0.36";

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

    fn nominal(&self, target: &Target) -> Result<f64> {
        Ok(Knob::resolve(target, &self.0)?.get(&self.0.nominal, &self.0))
    }

    fn simulator(&self, config: &BatchConfig) -> Result<Box<dyn Simulator>> {
        Ok(Box::new(Batch::new(Arc::clone(&self.0), config)?))
    }
}

inventory::submit! {
    BackendEntry {
        name: "rapier",
        about: "rapier 0.36: pure Rust, single precision, always there",
        make: || Ok(Box::new(Rapier)),
    }
}
