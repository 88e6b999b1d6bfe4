//! Readings of a tracker: with noise, and with errors that do not average out.
//!
//! A method is told of the noise. It is not told of latency, offsets or missing readings. Both
//! kinds of errors affect the readings and never the world itself.

use asid_core::error::{Error, Result};
use asid_core::layout::Layout;
use asid_core::rng::Rng;
use asid_core::tracker::ReadingFrames;
use asid_readings::SignalSet;
use rand_distr::{Distribution, StandardNormal};

/// Systematic errors of the tracker of a [`SimulatedWorld`](super::SimulatedWorld); none by
/// default.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackerErrors {
    /// Age of a reading, s, to the nearest physics step. Before the start of an episode the state
    /// counts as that at its start.
    pub latency: f64,
    /// Constant error of each tracked signal, in the order of a whitened difference
    /// ([`SignalSet::whitened_len`] numbers). It is added to numbers and vectors in their unit; for
    /// an orientation it is a rotation vector (rad) about the axes of the object. Empty for none.
    pub offset: Vec<f64>,
    /// Frames from one reading to the next; the first frame is read. 1 for every frame.
    pub every: usize,
    /// Probability that a reading is lost, for all signals together, as where the view is blocked.
    /// The first reading of an episode is never lost.
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
    /// Checks the numbers against the tracked signals.
    ///
    /// # Errors
    /// [`Error::Config`] where one is out of its domain.
    pub fn check(&self, signals: &SignalSet) -> Result<()> {
        let wrong = |key: &str, message: String| Error::Config {
            key: format!("real.perturbation.tracker_{key}"),
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
            return Err(wrong("every", "a reading every 0 frames".into()));
        }
        let wanted = signals.whitened_len();
        if !(self.offset.is_empty() || self.offset.len() == wanted) {
            let message = format!("{} numbers where {wanted} are needed", self.offset.len());
            return Err(wrong("offset", message));
        }
        Ok(())
    }

    /// Adds the constant error to a true reading.
    pub(super) fn shift(&self, signals: &SignalSet, reading: &mut [f64]) {
        if !self.offset.is_empty() {
            signals.add_offset(reading, &self.offset);
        }
    }

    /// Whether the frame has a reading.
    ///
    /// Every frame draws from `chance`, so that the rate does not change which readings are lost.
    pub(super) fn reads(&self, frame: usize, chance: &mut Rng) -> bool {
        use rand::Rng as _;
        let lost = chance.random::<f64>() < self.dropout;
        frame == 0 || (frame.is_multiple_of(self.every) && !lost)
    }
}

/// The tracker's readings, frame by frame.
pub(super) struct Tracker<'a> {
    signals: &'a SignalSet,
    errors: &'a TrackerErrors,
    rate: ReadingFrames,
    /// Latency in physics steps.
    pub(super) late: usize,
    /// Physics steps per frame.
    substeps: usize,
    /// True readings of the signals after each physics step, from the start on; a late tracker
    /// reports from these.
    past: Vec<f64>,
    frame: usize,
    noise: Rng,
    losses: Rng,
}

impl<'a> Tracker<'a> {
    pub(super) fn new(
        (signals, errors): (&'a SignalSet, &'a TrackerErrors),
        rate: ReadingFrames,
        layout: &Layout,
        substeps: usize,
        [noise, losses]: [Rng; 2],
    ) -> Self {
        Self {
            signals,
            errors,
            rate,
            late: (errors.latency / layout.timestep).round() as usize,
            substeps,
            past: Vec::new(),
            frame: 0,
            noise,
            losses,
        }
    }

    /// Receives the start of an episode: a row that begins with the tracked signals.
    pub(super) fn begin(&mut self, start: &[f64]) {
        self.past.extend_from_slice(&start[..self.signals.width()]);
    }

    /// Receives the true states after each physics step: rows that begin with the tracked signals.
    pub(super) fn look<'r>(&mut self, rows: impl Iterator<Item = &'r [f64]>) {
        for row in rows {
            self.past.extend_from_slice(&row[..self.signals.width()]);
        }
    }

    /// Converts the next frame's true reading, which begins with the tracked signals, to the
    /// tracker's reading. Returns whether the tracker read anything.
    pub(super) fn read(&mut self, row: &mut [f64]) -> bool {
        let tracked = self.signals.width();
        let seen = &mut row[..tracked];
        if self.late > 0 {
            let shown = (self.frame * self.substeps).saturating_sub(self.late);
            seen.copy_from_slice(&self.past[shown * tracked..][..tracked]);
        }
        self.errors.shift(self.signals, seen);
        self.signals
            .add_noise(seen, || StandardNormal.sample(&mut self.noise));
        let there = self.errors.reads(self.frame, &mut self.losses) && self.rate.has(self.frame);
        self.frame += 1;
        there
    }
}
