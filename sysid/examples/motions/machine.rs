//! A machine of the comparison: its model and the settings of its motion.

use std::path::Path;

use asid::cli::{MotionConfig, MotionSetup, Subject};

use crate::Outcome;

/// A machine with its settings.
pub struct Machine {
    /// The model on its engine.
    pub subject: Subject,
    /// Unknowns, limits, noise and times.
    pub config: MotionConfig,
}

impl Machine {
    /// Opens a model with a file of settings.
    pub fn open(model: &Path, settings: &Path) -> Outcome<Self> {
        let config = MotionConfig::of_file(model, settings)?;
        Ok(Self {
            subject: Subject::open(model, config.backend.as_deref())?,
            config,
        })
    }

    /// Prepares the design of motions, with the machine at rest.
    pub fn setup(&self, threads: usize) -> Outcome<MotionSetup<'_>> {
        Ok(MotionSetup::new(&self.subject, &self.config, threads)?)
    }
}
