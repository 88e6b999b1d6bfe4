//! The engine's own error, from a model at half its time step along a trajectory.

use asid_core::Result;

use crate::machine::Machine;

use super::context::Context;
use super::fit::Hypothesis;
use super::step_error::StepError;
use super::step_map::{Derivatives, LinearEpisode, StepMap};
use super::walk::Walk;

/// The machine at half its time step, with the rows of a context.
pub struct Finer {
    machine: Machine,
    walks: Vec<Walk>,
}

impl Finer {
    /// Creates it for the rows of some walks; `None` for an engine that takes no other time step.
    #[must_use]
    pub fn of(machine: &Machine, walks: &[Walk]) -> Option<Self> {
        let machine = machine.halved().ok()?;
        let walks = walks.iter().map(Walk::halved).collect();
        Some(Self { machine, walks })
    }

    /// The same machine with some of the walks.
    #[must_use]
    pub fn of_walks(&self, which: &[usize]) -> Self {
        let walks = which.iter().map(|&w| self.walks[w].clone());
        Self {
            machine: self.machine.clone(),
            walks: walks.collect(),
        }
    }
}

/// A model at half its time step: each model errs in its own way, since an engine steps some forces
/// implicitly and others explicitly.
pub struct HalfStep<'c> {
    map: StepMap<'c>,
    segments: Vec<bool>,
}

impl<'c> HalfStep<'c> {
    /// Creates a model at half its time step; `None` if the context has no [`Finer`] machine.
    ///
    /// # Errors
    /// As [`StepMap::new`].
    pub fn of(context: &'c Context<'_>, model: &Hypothesis) -> Result<Option<Self>> {
        let Some(finer) = &context.finer else {
            return Ok(None);
        };
        let rows = (context.logs, &finer.walks[..]);
        let parameters = model.parameters();
        let map = StepMap::new(&finer.machine, &model.specs, &parameters, rows, 1)?;
        let segments = context.walks.iter().map(|w| w.segment.is_some());
        Ok(Some(Self {
            map,
            segments: segments.collect(),
        }))
    }

    /// Computes the engine's own error over the rows, at some values along a trajectory.
    ///
    /// `here` is the linearisation of the same model there, at its own time step.
    ///
    /// # Errors
    /// When a value is not physical or the engine fails.
    pub fn error(
        &mut self,
        theta: &[f64],
        trajectory: &[Vec<f64>],
        here: &[LinearEpisode],
    ) -> Result<StepError> {
        let none = Derivatives::default();
        let there = self.map.linearise(theta, trajectory, none, &[], &[])?;
        Ok(StepError::between(here, &there, &self.segments))
    }
}
