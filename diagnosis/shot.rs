//! Where multiple shooting arrives, for whole replays to begin with.

use crate::predict::State;

/// Where multiple shooting arrived without effects.
pub struct Shot {
    /// Values of the study's parameters.
    pub theta: Vec<f64>,
    /// State at the start of each episode.
    pub starts: Vec<Option<State>>,
    /// Whether segments show something that the parameters cannot make up for.
    pub lacks: bool,
}
