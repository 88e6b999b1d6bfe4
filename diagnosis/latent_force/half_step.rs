//! The engine's own error, from the model at half its time step along a trajectory.

use asid_core::Result;

use crate::machine::Machine;

use super::context::Context;
use super::fit::Hypothesis;
use super::step_error::StepError;
use super::step_map::{Derivatives, StepMap};
use super::walk::Walk;

/// Computes the engine's own error over the rows, of a model at some values along a trajectory.
///
/// `finer` is the machine at half its time step.
///
/// # Errors
/// When the engine fails.
pub fn step_error(
    context: &Context<'_>,
    (hypothesis, theta): (&Hypothesis, &[f64]),
    trajectory: &[Vec<f64>],
    finer: &Machine,
) -> Result<StepError> {
    let parameters = hypothesis.parameters();
    let specs = &hypothesis.specs;
    let none = Derivatives::default();
    let mut map = context.map(specs, &parameters, 1)?;
    let here = map.linearise(theta, trajectory, none, &[], &[])?;
    let walks: Vec<Walk> = context.walks.iter().map(Walk::halved).collect();
    let rows = (context.logs, &walks[..]);
    let mut map = StepMap::new(finer, specs, &parameters, rows, 1)?;
    let there = map.linearise(theta, trajectory, none, &[], &[])?;
    let segments: Vec<bool> = walks.iter().map(|w| w.segment.is_some()).collect();
    Ok(StepError::between(&here, &there, &segments))
}
