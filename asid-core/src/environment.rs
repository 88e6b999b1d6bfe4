//! A batch of episodic environments, as a learner sees them.
//!
//! Learners never see a simulator. They see observations, actions, rewards and the two ways in
//! which an episode ends, for a whole batch at a time. All arrays are row-major with one row an
//! environment.

use crate::error::Result;

/// Result of one [`BatchEnvironment::step`], for `n` environments.
///
/// The caller owns the buffers and reuses them from step to step.
#[derive(Clone, Debug, Default)]
pub struct Transition {
    /// Observation to act on next, `n x observation_len`. After the end of an episode it is the
    /// first observation of the next one.
    pub observation: Vec<f64>,
    /// Reward of the step, `n`.
    pub reward: Vec<f64>,
    /// Whether the episode reached a terminal state, whose value is zero, `n`.
    pub terminated: Vec<bool>,
    /// Whether the time limit cut the episode, `n`: bootstrap from `final_observation`.
    pub truncated: Vec<bool>,
    /// Observation at the end of the step and before any reset, `n x observation_len`.
    pub final_observation: Vec<f64>,
}

impl Transition {
    /// Buffers for `n` environments with observations of `observation_len` entries.
    #[must_use]
    pub fn new(n: usize, observation_len: usize) -> Self {
        Self {
            observation: vec![0.0; n * observation_len],
            reward: vec![0.0; n],
            terminated: vec![false; n],
            truncated: vec![false; n],
            final_observation: vec![0.0; n * observation_len],
        }
    }
}

/// A batch of environments that step together and reset automatically.
pub trait BatchEnvironment {
    /// Number of environments, `n`.
    fn batch_size(&self) -> usize;
    /// Entries of one observation.
    fn observation_len(&self) -> usize;
    /// Entries of one action; each lies in `[-1, 1]` and is clipped to it.
    fn action_len(&self) -> usize;
    /// Starts a new episode in each environment and writes the first observations, `n x
    /// observation_len`.
    ///
    /// # Errors
    /// When the underlying simulator fails.
    fn reset(&mut self, observation: &mut [f64]) -> Result<()>;
    /// Applies `actions` (`n x action_len`) and writes the results.
    ///
    /// # Errors
    /// When the underlying simulator fails as a whole; a single diverged episode is terminated
    /// instead.
    fn step(&mut self, actions: &[f64], transition: &mut Transition) -> Result<()>;
}
