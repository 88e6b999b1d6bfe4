//! What a search found: sets of effects with their replays, and what is reported about them.

use crate::bench::{Explanation, Trial};
use crate::candidate::Candidate;
use crate::ceiling::Left;
use crate::result::{DetectionLimit, Isolability, MissingForce, NotTried, RankedSet};
use crate::trace::ForceTrace;

/// Excess of the root mean square residual, in units of the noise, below which no further effect is
/// searched for.
///
/// Another program's version of the same effect leaves as much.
pub const NEGLIGIBLE: f64 = 2.0;

/// Gap without effects, in standard deviations of the noise, up to which there is nothing to close:
/// noise that is estimated from a log is right to some hundredths.
pub const LEAST_GAP: f64 = 1.1;

/// Returns the root mean square of what a cost per reading has beyond the noise.
#[must_use]
pub fn excess(cost_per_reading: f64) -> f64 {
    (cost_per_reading - 1.0).max(0.0).sqrt()
}

/// An explanation with its candidates.
#[derive(Clone, Debug)]
pub struct Found {
    /// Indices of the candidates, in the order in which they were added.
    pub candidates: Vec<usize>,
    /// The fit.
    pub explanation: Explanation,
}

/// Result of a search.
pub struct Findings {
    /// The explanation without effects.
    pub none: Explanation,
    /// Sets of effects that were replayed: the set that stands, then its rivals by evidence.
    pub found: Vec<Found>,
    /// The missing force at each degree of freedom; empty where bodies touch all the time.
    pub missing: Vec<MissingForce>,
    /// The missing force along the logs, where most is missing.
    pub forces: Vec<ForceTrace>,
    /// Sets of effects, ranked by evidence.
    pub ranking: Vec<RankedSet>,
    /// Which of the leading effects the logs distinguish.
    pub isolability: Option<Isolability>,
    /// The smallest size of each effect that the logs could have shown, where it is known.
    pub detection_limits: Vec<DetectionLimit>,
    /// Probability that the best candidate shows as much evidence where nothing is missing, if
    /// known.
    pub p_value: Option<f64>,
    /// What the best explanation leaves of the missing force, where that was estimated.
    pub left: Vec<Left>,
    /// How well replays repeat; `None` where nothing touches.
    pub repeats: Option<Repeats>,
    /// What was skipped because the work was stopped.
    pub not_tried: Vec<NotTried>,
}

/// How well replays of logs in which bodies touch can be repeated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeats {
    /// Duration of the longest segments that were tried, s; infinite for whole stretches of
    /// contact.
    pub duration: f64,
    /// Share of their rows that scatter by more than the noise.
    pub lost: f64,
    /// Whether that was too much, so that shorter segments are used.
    pub scatters: bool,
}

/// Returns the effects of an explanation as trials with their fitted values.
#[must_use]
pub fn trials<'a>(
    candidates: &'a [Candidate],
    members: &[usize],
    explanation: &Explanation,
) -> Vec<Trial<'a>> {
    members
        .iter()
        .zip(&explanation.effects)
        .map(|(&i, e)| (&candidates[i], e.values.iter().map(|(_, x)| *x).collect()))
        .collect()
}
