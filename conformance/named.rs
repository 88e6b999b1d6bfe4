//! An engine as one check sees it: scenes carry the check's name and are kept.

use std::sync::{Arc, Mutex};

use asid_core::{Backend, Capabilities, Model, Result, Scene};

/// A wrapper around an engine that names the scenes it loads.
pub struct Named<'a> {
    inner: &'a dyn Backend,
    check: &'static str,
    scenes: Mutex<Vec<String>>,
}

impl<'a> Named<'a> {
    /// Wraps an engine for a check.
    pub fn new(inner: &'a dyn Backend, check: &'static str) -> Self {
        Self {
            inner,
            check,
            scenes: Mutex::default(),
        }
    }

    /// The documents that it has loaded, each once.
    pub fn scenes(self) -> Vec<String> {
        self.scenes.into_inner().unwrap_or_default()
    }
}

impl Backend for Named<'_> {
    fn name(&self) -> &str {
        self.inner.name()
    }

    fn version(&self) -> String {
        self.inner.version()
    }

    fn capabilities(&self) -> Capabilities {
        self.inner.capabilities()
    }

    fn load(&self, scene: &Scene) -> Result<Arc<dyn Model>> {
        if let Ok(mut scenes) = self.scenes.lock()
            && !scenes.iter().any(|known| known == scene.xml())
        {
            scenes.push(scene.xml().to_owned());
        }
        // An error reads "scene of family/check: what is wrong".
        let named = Scene::from_xml(&format!("of {}", self.check), scene.xml(), &[])?;
        let folder = scene.directory().map(std::path::Path::to_path_buf);
        self.inner.load(&named.in_directory(folder))
    }
}
