//! `evidence.json`: all that the decision of a diagnosis rests on.
//!
//! A decision is a function of it alone, so that it can be repeated with other settings, without a replay.

use serde::{Deserialize, Serialize};

use crate::nullable;

/// Mean squares of the residuals of whole replays, in units of the noise; NaN where there was none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Replayed {
    /// Of the logs that were fitted to.
    #[serde(deserialize_with = "nullable::scalar")]
    pub train: f64,
    /// Of the logs held out; without effects, and of the set that was found, by the covariance of starts that were fitted on their first tenth too.
    #[serde(deserialize_with = "nullable::scalar")]
    pub held_out: f64,
}

impl Default for Replayed {
    fn default() -> Self {
        Self {
            train: f64::NAN,
            held_out: f64::NAN,
        }
    }
}

/// A set of effects that was put into the model and fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tried {
    /// Effects at their sites, sorted.
    pub effects: Vec<String>,
    /// How many named things it is. A group counts once; a law that was found at one site after the
    /// other counts once for each.
    pub names: usize,
    /// Evidence over the model without effects, with the prior odds of its names, natural logarithm.
    #[serde(deserialize_with = "nullable::scalar")]
    pub evidence: f64,
    /// Logarithm of these prior odds, natural, without the price of names.
    #[serde(default)]
    pub prior: f64,
    /// Whole replays with it.
    pub replayed: Replayed,
}

/// A set of effects that was fitted and not replayed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fitted {
    /// Effects at their sites, sorted.
    pub effects: Vec<String>,
    /// How many named things it is.
    pub names: usize,
    /// Evidence over the model without effects, with the prior odds of its names, natural logarithm.
    #[serde(deserialize_with = "nullable::scalar")]
    pub evidence: f64,
    /// Logarithm of these prior odds, natural, without the price of names.
    pub prior: f64,
}

/// A set of effects that was screened and not fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Screened {
    /// Effects at their sites, sorted.
    pub effects: Vec<String>,
    /// How many named things it is.
    pub names: usize,
    /// Evidence over the model without effects to first order, natural logarithm.
    #[serde(deserialize_with = "nullable::scalar")]
    pub evidence: f64,
}

fn yes() -> bool {
    true
}

/// All that a decision rests on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// 1.
    pub schema: u32,
    /// Candidates: effects at their sites.
    pub candidates: usize,
    /// Whole replays without effects.
    pub none: Replayed,
    /// The readings about their own mean over each log: what a replay without any skill leaves.
    #[serde(default)]
    pub mean: Replayed,
    /// Whether whole replays can be repeated: false where contacts scatter.
    #[serde(default = "yes")]
    pub repeatable: bool,
    /// Sets that were fitted, those of the decision's hypotheses.
    pub tried: Vec<Tried>,
    /// Place in `tried` of the set that the search ended with; `None` for no effect.
    pub found: Option<usize>,
    /// Place in `tried` of what the logs show without a search, such as encoder steps; `None` for no effect.
    pub known: Option<usize>,
    /// Sets that were fitted and not replayed, the most evident first.
    #[serde(default)]
    pub fitted: Vec<Fitted>,
    /// Sets that were screened and not fitted, the most evident first.
    pub screened: Vec<Screened>,
    /// Mean square of the engine's own error over the logs that were fitted to, in units of the noise; NaN where it was not asked, as in a search that was cut short.
    #[serde(deserialize_with = "nullable::scalar")]
    pub own_error: f64,
    /// Whether a force, or something of the readings, is missing without effects.
    pub is_missing: bool,
    /// Power of the missing force that the set leaves, relative to that without effects.
    #[serde(deserialize_with = "nullable::scalar")]
    pub left: f64,
    /// Whether the search was cut short.
    pub stopped: bool,
}
