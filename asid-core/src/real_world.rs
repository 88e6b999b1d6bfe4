//! The real world: it returns one episode, and allows one attempt at the task.

use crate::episode::Episode;
use crate::error::Result;
use crate::explore::Policy;
use crate::solve::TaskPolicy;
use crate::task::Outcome;

/// A recorded episode, with what only a simulated world knows about it.
#[derive(Clone, Debug)]
pub struct RealEpisode {
    /// The log.
    pub episode: Episode,
    /// Actions of the policy, `horizon x action`, in the task's units.
    pub actions: Vec<f64>,
    /// Share of control steps in which the machine touched the object, checked after every physics
    /// step, as a touch can be shorter than a frame.
    pub contact_fraction: f64,
    /// The same share for each of the task's objects.
    pub touched: Vec<f64>,
    /// True start pose, if known.
    pub true_start: Option<Vec<f64>>,
    /// The readings without the trackers' errors, in the log's layout, if known.
    pub true_readings: Option<Vec<f64>>,
}

/// One attempt at the task.
#[derive(Clone, Debug)]
pub struct Attempt {
    /// The result.
    pub outcome: Outcome,
    /// The action.
    pub action: Vec<f64>,
    /// Start pose that the machine assumed.
    pub believed_start: Vec<f64>,
    /// Readings of the task's channels, `frames x width`.
    pub readings: Vec<f64>,
    /// The log: commands, and the readings of trackers and the machine's own sensors.
    pub episode: Episode,
}

/// A world that can be explored once and tried once.
pub trait RealWorld {
    /// Plays a policy for one episode.
    ///
    /// # Errors
    /// When the policy or the world fails.
    fn explore(&mut self, policy: &mut dyn Policy) -> Result<RealEpisode>;

    /// Tries the task once.
    ///
    /// # Errors
    /// When the policy or the world fails.
    fn attempt(&mut self, policy: &mut dyn TaskPolicy) -> Result<Attempt>;
}
