//! MuJoCo as a backend of ASID.
//!
//! MuJoCo is the reference engine: double precision, every part of MJCF, exact snapshots. A batch
//! is one `mjBatch` of MuJoCo 3.17, which keeps a state row and the changed model fields of each
//! simulation and runs them on a thread pool. A rollout is one call. On its thread, each simulation
//! loops over frames and physics steps and writes its readings into its part of the output.
//!
//! Three things differ from a plain loop over `mj_step`:
//! - A reading is of the state at the end of its frame. After `mj_step`, `sensordata` still belongs
//!   to the state before that step, so the first half of the next step is taken early and
//!   continued, at no cost.
//! - MuJoCo silently restarts a simulation with a bad state. Here it is reported as diverged and
//!   stands still.
//! - Nothing is written to the console or to `MUJOCO_LOG.TXT`.

mod compiled;
mod contact;
mod ffi;
mod field;
mod history;
mod inertia;
mod layout;
mod model;
mod parameter;
mod rollout;
mod simulator;
mod state;
mod target;

use std::sync::Arc;

use asid_core::{Backend, Capabilities, Error, Model, Result, Scene};

/// Version of MuJoCo that the bindings are made for.
const VERSION: &str = "3.17.0";

asid_core::register!(BackendEntry {
    name: "mujoco",
    about: "MuJoCo 3.17, double precision, the reference engine",
    make: || MujocoBackend::new().map(|b| Box::new(b) as Box<dyn Backend>),
});

/// The engine.
#[derive(Debug)]
pub struct MujocoBackend {
    _private: (),
}

impl MujocoBackend {
    /// The engine, after checking that its library has the version of the bindings.
    ///
    /// From then on MuJoCo's messages reach neither the console nor a log file.
    ///
    /// # Errors
    /// [`Error::Missing`] when another version is linked.
    pub fn new() -> Result<Self> {
        let found = mujoco_rs::mujoco_version();
        if found != VERSION {
            return Err(Error::Missing {
                what: "MuJoCo".into(),
                message: format!(
                    "version {found} is linked where {VERSION} is needed; run `cargo xtask setup`"
                ),
            });
        }
        ffi::silence_log();
        Ok(Self { _private: () })
    }
}

impl Backend for MujocoBackend {
    fn name(&self) -> &str {
        "mujoco"
    }

    fn version(&self) -> String {
        VERSION.to_owned()
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities::all()
    }

    fn load(&self, scene: &Scene) -> Result<Arc<dyn Model>> {
        Ok(Arc::new(model::MujocoModel::load(scene)?))
    }
}
