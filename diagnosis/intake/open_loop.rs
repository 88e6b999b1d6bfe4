//! Residuals of the readings in replays of the model as given, before any fit.

use asid_core::Result;

use crate::bench::Bench;
use crate::data::Logs;
use crate::machine::Machine;
use crate::predict::Point;
use crate::prepare::{dataset, plain_residuals, set_reading_noise};
use crate::study::Study;

/// Replays of the training logs.
pub(super) struct OpenLoop {
    bench: Bench,
    residuals: Vec<Vec<f64>>,
}

impl OpenLoop {
    /// Replays the logs of a study.
    ///
    /// # Errors
    /// When the engine fails.
    pub(super) fn of(study: &Study, machine: &Machine) -> Result<Self> {
        let (mut bench, theta) = dataset(study, machine.clone())?;
        set_reading_noise(&mut bench, &study.noise);
        let point = Point {
            theta,
            starts: bench.train.starts.clone(),
        };
        let residuals = plain_residuals(&bench, &bench.train, &[], &point)?;
        Ok(Self { bench, residuals })
    }

    /// The logs.
    pub(super) fn logs(&self) -> &Logs {
        &self.bench.train.logs
    }

    /// Residuals `logged - predicted` in the sensors' units.
    ///
    /// One array `rows x entries` an episode, NaN where a reading is missing.
    pub(super) fn residuals(&self) -> &[Vec<f64>] {
        &self.residuals
    }
}
