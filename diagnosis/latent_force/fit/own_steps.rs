//! The error of a model's own time steps, when fitted models are compared at the end.
//!
//! An engine may step one law implicitly in one model and explicitly in another: MuJoCo's Euler
//! integrator does so with the damping of a joint and that of a servo. The two models then differ by
//! the error of a step alone, which no log of a machine shows. During the search all models share the
//! [error of the model without effects](crate::latent_force::step_error). Here each has in addition
//! what its effects change of it.

use asid_core::Result;

use crate::latent_force::context::Context;
use crate::latent_force::half_step::step_error;
use crate::latent_force::step_error::StepError;
use crate::machine::Machine;

use super::regression::{compare, variations};
use super::{Fitted, Hypothesis};

/// The machine at half its time step, and the model without effects.
pub struct OwnSteps<'a> {
    /// The data, with the error that all models share.
    pub context: &'a Context<'a>,
    /// The machine at half its time step.
    pub finer: &'a Machine,
    /// The model without effects.
    pub none: &'a Fitted,
}

impl OwnSteps<'_> {
    /// Returns the gain of a fitted model's evidence, a natural logarithm, if it has the error of
    /// its own steps.
    ///
    /// What its effects change of the error is the difference from the model without effects along
    /// the same trajectory. At a stop the error depends much on the trajectory, and so would a model
    /// by where it is smoothed.
    ///
    /// # Errors
    /// When a value is not physical or the engine fails.
    pub fn gain(&self, fitted: &Fitted) -> Result<f64> {
        let (context, hypothesis) = (self.context, &fitted.hypothesis);
        let (theta, estimate) = (&fitted.theta[..], &fitted.estimate);
        let (unknowns, free) = (&hypothesis.unknowns[..], hypothesis.free());
        let m = free.len();
        let roles = 4 * context.plant().layout.nv + m + 1;
        let mut map = context.map(&hypothesis.specs, &hypothesis.parameters(), roles)?;
        let variations = variations(unknowns, &free, theta);
        let of = (context, &mut map);
        let mut slopes = fitted.slopes.renewed();
        let linear = slopes.linearise(of, (theta, hypothesis), estimate, &variations)?;
        let along = |of: &Hypothesis, theta: &[f64]| {
            step_error(context, (of, theta), &estimate.trajectory, self.finer)
        };
        let none = along(&self.none.hypothesis, &self.none.theta)?;
        let own = along(hypothesis, theta)?;
        let evidence = |error: &StepError| {
            let mut linear = linear.clone();
            error.join(&mut linear, m);
            let compared = compare(context, estimate, &linear, (unknowns, &free, theta), true);
            compared.map(|c| c.here + c.promised)
        };
        let shared = &context.step_error;
        let pair = evidence(shared).zip(evidence(&shared.with_change(&none, &own)));
        let gain = pair.map_or(0.0, |(shared, own)| own - shared);
        Ok(if gain.is_finite() { gain } else { 0.0 })
    }
}
