//! What a search found: sets of effects with their replays, and what is told of them.

use crate::bench::{Explanation, Trial};
use crate::candidate::Candidate;
use crate::ceiling::Left;
use crate::result::{DetectionLimit, Isolability, MissingForce, NotTried, RankedSet};
use crate::trace::ForceTrace;

/// Excess of the root mean square residual, in units of the noise, that no further effect
/// is looked for below: another program's version of the same effect leaves as much.
pub const NEGLIGIBLE: f64 = 2.0;

/// Gap without effects, in deviations of the noise, up to which nothing is there to be closed: noise that is estimated from a
/// log is right to some hundredths.
pub const LEAST_GAP: f64 = 1.1;

/// What a cost per reading has beyond the noise, as a root mean square.
#[must_use]
pub fn excess(cost_per_reading: f64) -> f64 {
    (cost_per_reading - 1.0).max(0.0).sqrt()
}

/// An explanation with the candidates behind it.
#[derive(Clone, Debug)]
pub struct Found {
    /// Indices of the candidates, in the order in which they were added.
    pub candidates: Vec<usize>,
    /// The fit.
    pub explanation: Explanation,
}

/// What a search found.
pub struct Findings {
    /// Without any effect.
    pub none: Explanation,
    /// Sets of effects that were replayed, the one that stands first, then its rivals by their evidence.
    pub found: Vec<Found>,
    /// The force that is missing at each degree of freedom; empty where bodies touch all the time.
    pub missing: Vec<MissingForce>,
    /// The same along the logs, where most is missing.
    pub forces: Vec<ForceTrace>,
    /// Sets of effects by their evidence.
    pub ranking: Vec<RankedSet>,
    /// Which of the leading effects the logs tell apart.
    pub isolability: Option<Isolability>,
    /// The smallest size of each effect that the logs could have shown, where that is known.
    pub detection_limits: Vec<DetectionLimit>,
    /// Probability of as much evidence for the best candidate where nothing is missing, where that is known.
    pub p_value: Option<f64>,
    /// What the best explanation leaves of the missing force, where it was estimated.
    pub left: Vec<Left>,
    /// How far what is replayed can be repeated; `None` where nothing touches.
    pub repeats: Option<Repeats>,
    /// What was left out because the work was stopped.
    pub not_tried: Vec<NotTried>,
}

/// How far replays of logs in which bodies touch can be repeated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeats {
    /// Duration of the longest segments that were tried, s; infinite for whole stretches of contact.
    pub duration: f64,
    /// Share of their rows that scatter by more than the noise.
    pub lost: f64,
    /// Whether that was too much, and shorter ones stand.
    pub scatters: bool,
}

/// The effects of an explanation as trials with their fitted values.
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
