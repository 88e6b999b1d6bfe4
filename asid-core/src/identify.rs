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

/// Result of identification.
#[derive(Clone, Debug)]
pub struct Identified {
    /// The posterior.
    pub posterior: Posterior,
    /// Start pose of each episode at the best fit, in the task's coordinates.
    pub starts: Vec<Vec<f64>>,
    /// Convergence of the search.
    pub iterations: Vec<IterationSummary>,
    /// Root mean square of the whitened residual at the best fit: 1 where the simulator explains
    /// the readings as well as their noise allows. Roughness adds to it, since the machine's own
    /// scatter is in the readings.
    pub residual: f64,
    /// Root mean square of the residual at the best fit, in units of noise and roughness together:
    /// near 1 where the simulator explains the readings, rough or not. `None` where nothing was
    /// fitted to the readings.
    pub misfit: Option<f64>,
    /// Root-mean-square scatter of nearby simulations due to contact, in units of the readings'
    /// noise; 0 where it was not measured.
    pub roughness: f64,
}

/// An identifier's assumptions on the readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assumptions {
    /// Whether readings are weighted by the correlation of contact scatter along an episode, or by
    /// its size alone.
    pub correlated: bool,
    /// Systematic errors of the trackers, which are marginalised.
    pub tracker: TrackerPrior,
    /// Whether the scatter of nearby simulations is measured and is part of the likelihood. Models
    /// that differ may then share the simulations, and the intervals include what they differ by.
    pub scatter: bool,
}

impl Default for Assumptions {
    fn default() -> Self {
        Self {
            correlated: false,
            tracker: TrackerPrior::NONE,
            scatter: false,
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

    /// Its assumptions on the readings; the expected information of an episode is computed with the
    /// same.
    fn assumes(&self) -> Assumptions {
        Assumptions::default()
    }

    /// Learns to identify from episodes of `explorer` with truths drawn from the prior, and saves
    /// the result in `file`, from which the setting `identifier.network` loads it.
    ///
    /// Returns false if the identifier learns nothing beforehand.
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
