//! Errors of a tracker that do not average out: it is late, it is off, it misses readings.
//!
//! Noise is what a method is told of; these it is not. They act on what a world says and never on what
//! happens in it.

use asid_core::error::{Error, Result};
use asid_core::rng::Rng;
use asid_core::signal::SignalSet;

/// Systematic errors of the tracker of a [`SimulatedWorld`](super::SimulatedWorld); without any by default.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackerErrors {
    /// Age of what a reading shows, s; to the nearest physics step. Before the start of an
    /// episode the world stood as at its start.
    pub latency: f64,
    /// Constant error of each tracked signal, one after the other as in a whitened difference
    /// ([`SignalSet::whitened_len`] numbers): added to numbers and vectors in their unit, and a rotation
    /// vector (rad) about the axes of the object for an orientation. Empty for none.
    pub offset: Vec<f64>,
    /// Frames from one reading to the next, the first frame read; 1 for every frame.
    pub every: usize,
    /// Probability that a reading is lost, of all signals together, as where the view is blocked.
    /// The first one of an episode never is.
    pub dropout: f64,
}

impl Default for TrackerErrors {
    fn default() -> Self {
        Self {
            latency: 0.0,
            offset: Vec::new(),
            every: 1,
            dropout: 0.0,
        }
    }
}

impl TrackerErrors {
    /// Checks the numbers against the signals that are tracked.
    ///
    /// # Errors
    /// [`Error::Config`] where one makes no sense.
    pub fn check(&self, signals: &SignalSet) -> Result<()> {
        let wrong = |key: &str, message: String| Error::Config {
            key: format!("tracker {key}"),
            message,
        };
        if !(self.latency.is_finite() && self.latency >= 0.0) {
            let message = format!("{} s is not a time from 0 up", self.latency);
            return Err(wrong("latency", message));
        }
        if !(0.0..1.0).contains(&self.dropout) {
            let message = format!("{} is not a probability below 1", self.dropout);
            return Err(wrong("dropout", message));
        }
        if self.every == 0 {
            return Err(wrong("rate", "a reading every 0 frames".into()));
        }
        let wanted = signals.whitened_len();
        if !(self.offset.is_empty() || self.offset.len() == wanted) {
            let message = format!("{} numbers where {wanted} are needed", self.offset.len());
            return Err(wrong("offset", message));
        }
        Ok(())
    }

    /// Shifts a true reading by the constant error.
    pub(super) fn shift(&self, signals: &SignalSet, reading: &mut [f64]) {
        if !self.offset.is_empty() {
            signals.add_offset(reading, &self.offset);
        }
    }

    /// Whether the reading of a frame is there; `chance` is drawn from at each frame, so that the rate
    /// does not change what is lost.
    pub(super) fn reads(&self, frame: usize, chance: &mut Rng) -> bool {
        use rand::Rng as _;
        let lost = chance.random::<f64>() < self.dropout;
        frame == 0 || (frame.is_multiple_of(self.every) && !lost)
    }
}
