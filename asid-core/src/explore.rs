//! Exploration: from a task and a prior to a policy.

use std::path::Path;

use crate::error::Result;
use crate::problem::Problem;

/// An exploration policy, played once in the real world.
pub trait Policy: Send {
    /// Begins a new episode.
    fn reset(&mut self);

    /// Writes the action of control step `step`, in the task's units, for a row of readings.
    ///
    /// The row holds tracked signals with their noise, then proprioception.
    ///
    /// # Errors
    /// When planning fails.
    fn act(&mut self, step: usize, reading: &[f64], action: &mut [f64]) -> Result<()>;

    /// Whether the first reading of an episode determines all of its actions.
    fn is_open_loop(&self) -> bool {
        false
    }

    /// Return over the search, for a policy that searches at the start of its episode.
    fn take_curve(&mut self) -> Vec<CurvePoint> {
        Vec::new()
    }

    /// The policy as JSON, for the robot's side.
    fn export(&self) -> serde_json::Value;
}

/// One point of a learning curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvePoint {
    /// Iterations or environment steps.
    pub x: f64,
    /// Mean return.
    pub mean: f64,
    /// Standard deviation of the return.
    pub std: f64,
}

impl CurvePoint {
    /// The point of an iteration, counted from 1, from its returns; those of episodes that diverged
    /// are NaN and do not count.
    #[must_use]
    pub fn of(iteration: usize, returns: &[f64]) -> Self {
        let returns = || returns.iter().filter(|r| r.is_finite());
        let n = returns().count() as f64;
        let mean = returns().sum::<f64>() / n;
        let variance = returns().map(|r| (r - mean).powi(2)).sum::<f64>() / n;
        Self {
            x: iteration as f64,
            mean,
            std: variance.sqrt(),
        }
    }
}

/// A policy and its search.
pub struct Explored<'a> {
    /// The policy.
    pub policy: Box<dyn Policy + 'a>,
    /// Return over the search; a planner that plans at the start of the episode adds to it then.
    pub curve: Vec<CurvePoint>,
    /// What `x` counts.
    pub curve_label: &'static str,
    /// Name of the objective; empty where there is none.
    pub objective: String,
}

/// Turns a task and a prior into an exploration policy.
pub trait Explorer: Send + Sync {
    /// Makes a policy; the prior is that of the problem's parameters.
    ///
    /// `start` is the start pose that the policy will meet, if known beforehand.
    ///
    /// # Errors
    /// When the engine fails or the user interrupts.
    fn explore<'a>(
        &'a self,
        problem: &'a Problem<'a>,
        start: Option<&[f64]>,
    ) -> Result<Explored<'a>>;

    /// Trains what the explorer plays and saves it in `file`, from which the setting
    /// `explorer.policy` loads it.
    ///
    /// Returns false if the explorer learns nothing beforehand.
    ///
    /// # Errors
    /// When the engine fails, the learner diverges, or the file cannot be written.
    fn train(&self, _problem: &Problem<'_>, _file: &Path) -> Result<bool> {
        Ok(false)
    }
}
