//! Any table as a [`Backend`].

use std::sync::Arc;

use asid_core::{
    Backend, BatchConfig, Capabilities, Layout, Model, Result, Scene, Simulator, Target,
};

use crate::engine::Engine;
use crate::failure::{broken, decode};
use crate::handle::{ModelHandle, NamedTarget, about, function};
use crate::simulator::LoadedSimulator;
use crate::table;

impl Engine {
    /// The engine as a backend under a name that the host chooses; it differs from the engine's own
    /// if that is taken.
    #[must_use]
    pub fn backend(&self, name: &str) -> Box<dyn Backend> {
        Box::new(LoadedBackend::new(self.clone(), name))
    }
}

/// An engine of a plugin under its registered name.
pub struct LoadedBackend {
    engine: Engine,
    name: String,
}

impl LoadedBackend {
    /// Wraps the engine under a name.
    #[must_use]
    pub fn new(engine: Engine, name: &str) -> Self {
        Self {
            engine,
            name: name.to_owned(),
        }
    }
}

impl Backend for LoadedBackend {
    fn name(&self) -> &str {
        &self.name
    }

    fn version(&self) -> String {
        self.engine.version().to_owned()
    }

    fn capabilities(&self) -> Capabilities {
        self.engine.capabilities()
    }

    fn load(&self, scene: &Scene) -> Result<Arc<dyn Model>> {
        let handle = ModelHandle::load(self.engine.checked().clone(), scene)?;
        Ok(Arc::new(LoadedModel {
            handle: Arc::new(handle),
        }))
    }
}

/// A scene compiled by an engine of a plugin.
pub struct LoadedModel {
    handle: Arc<ModelHandle>,
}

impl Model for LoadedModel {
    fn layout(&self) -> &Layout {
        self.handle.layout()
    }

    fn nominal(&self, target: &Target) -> Result<f64> {
        let engine = &self.handle.engine;
        let nominal = function(engine.table.nominal, "nominal", engine)?;
        let named = NamedTarget::new(target, &self.handle);
        let mut value = f64::NAN;
        let mut error = table::Error::empty();
        let model = self.handle.pointer();
        let code = engine.action("nominal").run(|| {
            // SAFETY: everything pointed to lives until the call returns.
            unsafe { nominal(model, &named.table(), &mut value, &mut error) }
        });
        let about = about(code, engine, &target.to_string());
        decode(code, &error, "nominal", &about, &engine.path)?;
        if !value.is_finite() {
            return Err(broken(
                &engine.path,
                "nominal",
                &format!("gives {value} for {target}"),
            ));
        }
        Ok(value)
    }

    fn simulator(&self, config: &BatchConfig) -> Result<Box<dyn Simulator>> {
        Ok(Box::new(LoadedSimulator::new(self.handle.clone(), config)?))
    }
}
