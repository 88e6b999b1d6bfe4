//! The engine's own error, from a model at half its time step.

use asid_core::Result;

use crate::machine::Machine;

use super::context::Context;
use super::fit::Hypothesis;
use super::step_error::StepError;
use super::step_map::{Derivatives, StepMap};
use super::walk::Walk;

/// The machine at half its time step, with rows and a trajectory along which models are compared.
///
/// The trajectory is the same for all models. At a stop or a contact the error of a step changes
/// abruptly with the state, and models would otherwise differ by where each of them is smoothed.
pub struct Finer {
    machine: Machine,
    walks: Vec<Walk>,
    /// `rows x (nq + nv)`, one a walk.
    trajectory: Vec<Vec<f64>>,
}

impl Finer {
    /// Creates it for some walks and a trajectory along them; `None` for an engine that takes no
    /// other time step.
    #[must_use]
    pub fn of(machine: &Machine, walks: &[Walk], trajectory: &[Vec<f64>]) -> Option<Self> {
        Some(Self {
            machine: machine.halved().ok()?,
            walks: walks.iter().map(Walk::halved).collect(),
            trajectory: trajectory.to_vec(),
        })
    }

    /// The same machine with some of the walks.
    #[must_use]
    pub fn of_walks(&self, which: &[usize]) -> Self {
        Self {
            machine: self.machine.clone(),
            walks: which.iter().map(|&w| self.walks[w].clone()).collect(),
            trajectory: which.iter().map(|&w| self.trajectory[w].clone()).collect(),
        }
    }
}

/// A model at its time step and at half of it: each model errs in its own way, since an engine steps
/// some forces implicitly and others explicitly.
pub struct HalfStep<'c> {
    here: StepMap<'c>,
    there: StepMap<'c>,
    trajectory: &'c [Vec<f64>],
    segments: Vec<bool>,
    /// The last error, and the values that it is of.
    last: Option<(Vec<f64>, StepError)>,
}

impl<'c> HalfStep<'c> {
    /// Creates a model at both steps; `None` if the context has no [`Finer`] machine.
    ///
    /// # Errors
    /// As [`StepMap::new`].
    pub fn of(context: &'c Context<'_>, model: &Hypothesis) -> Result<Option<Self>> {
        let Some(finer) = &context.finer else {
            return Ok(None);
        };
        let (specs, parameters) = (&model.specs, model.parameters());
        let rows = (context.logs, &finer.walks[..]);
        let segments = context.walks.iter().map(|w| w.segment.is_some());
        Ok(Some(Self {
            here: context.map(specs, &parameters, 1)?,
            there: StepMap::new(&finer.machine, specs, &parameters, rows, 1)?,
            trajectory: &finer.trajectory,
            segments: segments.collect(),
            last: None,
        }))
    }

    /// Returns the engine's own error over the rows, at some values.
    ///
    /// # Errors
    /// When a value is not physical or the engine fails.
    pub fn error(&mut self, theta: &[f64]) -> Result<&StepError> {
        let last = self.last.take().filter(|(of, _)| of == theta);
        let error = match last {
            Some((_, error)) => error,
            None => {
                let mut along = |map: &mut StepMap<'_>| {
                    let none = Derivatives::default();
                    map.linearise(theta, self.trajectory, none, &[], &[])
                };
                let (here, there) = (along(&mut self.here)?, along(&mut self.there)?);
                StepError::between(&here, &there, &self.segments)
            }
        };
        Ok(&self.last.insert((theta.to_vec(), error)).1)
    }
}
