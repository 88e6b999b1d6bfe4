//! Identification: from real episodes and a simulator to a posterior.

use std::path::Path;

use crate::episode::Episode;
use crate::error::Result;
use crate::explore::Explorer;
use crate::posterior::Posterior;
use crate::problem::Problem;
use crate::tracker::TrackerPrior;

/// The population of a search after one iteration, for pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct IterationSummary {
    /// Quantiles 2.5, 25, 50, 75 and 97.5 % of each parameter, in its unit.
    pub quantiles: Vec<[f64; 5]>,
    /// Best negative log-likelihood so far, up to a constant.
    pub best_loss: f64,
}

/// What identification found.
#[derive(Clone, Debug)]
pub struct Identified {
    /// The posterior.
    pub posterior: Posterior,
    /// Start pose of each episode at the best fit, in the task's coordinates.
    pub starts: Vec<Vec<f64>>,
    /// How the search narrowed down.
    pub iterations: Vec<IterationSummary>,
    /// Root mean square of the whitened residual at the best fit: 1 where the
    /// simulator explains the readings as well as their noise allows.
    pub residual: f64,
    /// How much nearby simulations differ by the luck of contact, root mean square in
    /// units of the readings' noise; 0 where it was not measured.
    pub roughness: f64,
}

/// What an identifier assumes of the readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assumptions {
    /// Whether readings are weighed by how the luck of contact runs along an episode, or by its size
    /// alone.
    pub correlated: bool,
    /// Systematic errors of the trackers, which are integrated out.
    pub tracker: TrackerPrior,
}

impl Default for Assumptions {
    fn default() -> Self {
        Self {
            correlated: false,
            tracker: TrackerPrior::NONE,
        }
    }
}

/// Turns real episodes into a posterior over the problem's parameters.
pub trait Identifier: Send + Sync {
    /// Fits the simulator to the episodes.
    ///
    /// # Errors
    /// When the engine fails, every simulation diverges, or the user interrupts.
    fn identify(&self, problem: &Problem<'_>, episodes: &[Episode]) -> Result<Identified>;

    /// What it assumes of the readings: what an episode is expected to tell is computed alike.
    fn assumes(&self) -> Assumptions {
        Assumptions::default()
    }

    /// Learns to identify from episodes of `explorer` at truths drawn from the prior, and saves
    /// what was learned in `file`, from where the setting `identifier.network` loads it; false
    /// where the identifier learns nothing beforehand.
    ///
    /// # Errors
    /// When the engine fails, the learner diverges, or the file cannot be written.
    fn train(
        &self,
        _problem: &Problem<'_>,
        _explorer: &dyn Explorer,
        _file: &Path,
    ) -> Result<bool> {
        Ok(false)
    }
}
