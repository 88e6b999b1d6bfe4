//! What a tracker says of a world: with noise, and with errors that do not average out.
//!
//! Noise is what a method is told of. That a tracker is late, is off or misses readings it is not told. Both act on
//! what a world says and never on what happens in it.

use asid_core::error::{Error, Result};
use asid_core::layout::Layout;
use asid_core::rng::Rng;
use asid_core::tracker::ReadingFrames;
use asid_readings::SignalSet;
use rand_distr::{Distribution, StandardNormal};

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

/// What the tracker says, frame by frame.
pub(super) struct Tracker<'a> {
    signals: &'a SignalSet,
    errors: &'a TrackerErrors,
    rate: ReadingFrames,
    /// Physics steps by which it is late.
    pub(super) late: usize,
    /// Physics steps of a frame.
    substeps: usize,
    /// True readings of the signals after each physics step, the start first; all that a late
    /// tracker may still report.
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

    /// Takes the start of an episode, a row that begins with the tracked signals.
    pub(super) fn begin(&mut self, start: &[f64]) {
        self.past.extend_from_slice(&start[..self.signals.width()]);
    }

    /// Takes what was true after each physics step, rows that begin with the tracked signals.
    pub(super) fn look<'r>(&mut self, rows: impl Iterator<Item = &'r [f64]>) {
        for row in rows {
            self.past.extend_from_slice(&row[..self.signals.width()]);
        }
    }

    /// Turns the next frame's true reading, which begins with the tracked signals, into what
    /// is read. Returns whether the tracker read anything.
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
