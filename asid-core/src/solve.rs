//! Solving: from a posterior (or a prior: domain randomisation) to a task policy.

use crate::error::Result;
use crate::posterior::Posterior;
use crate::problem::Problem;

/// A task policy: gives the action for an observed start pose.
pub trait TaskPolicy: Send {
    /// Writes the task action, in the task's units.
    ///
    /// # Errors
    /// When the action must be computed and that fails.
    fn act(&mut self, start: &[f64], action: &mut [f64]) -> Result<()>;
}

/// One action that a solver tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Iteration of the search.
    pub iteration: usize,
    /// The action.
    pub action: Vec<f64>,
    /// Its expected cost over the belief.
    pub cost: f64,
}

/// A task policy and its search.
pub struct Solved<'a> {
    /// The policy.
    pub policy: Box<dyn TaskPolicy + 'a>,
    /// The actions that were tried.
    pub trials: Vec<Trial>,
}

/// Turns a belief over the parameters into a task policy.
pub trait TaskSolver: Send + Sync {
    /// Minimises the expected cost over the belief.
    ///
    /// # Errors
    /// When the engine fails or the user interrupts.
    fn solve<'a>(&'a self, problem: &'a Problem<'a>, belief: &Posterior) -> Result<Solved<'a>>;
}
