//! Evidence for a view of the columns against the one given.
//!
//! A wrong view is nonsense to the model: it predicts the other way, another joint, or a motion 57 times too large. An effect that
//! the model lacks leaves a prediction that is a little off. Both shrink when something is fitted, so that significance
//! against the noise says nothing here: what counts is by which factor misses shrink, in units of the motion that is to be
//! predicted. The scale of that factor is set on the training half of `asid withheld`, whose worlds have every effect of the
//! catalogue up to a hundred floors of the noise: over 76 of its cases whose wiring is right the best hypothesis shrinks misses by
//! a factor with a logarithm of at most 0.5, and over some two hundred that were spoilt the right one by at least 0.8
//! (`docs/logs.md` has the command).

use super::windows::Misses;

/// When a fault of wiring is named.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Misses below this share of the motion are those of a right wiring, and shrinking them further is no evidence. Larger: fewer
    /// faults are found, and fewer effects are taken for them.
    pub good: f64,
    /// Share of the motion that a column misses from which on its zero and its clock are in question. Smaller: more is tried.
    pub suspect: f64,
    /// Share of the motion that a column misses from which on its sign, unit and name are in question: a wrong one misses
    /// about twice the motion. Smaller: more is tried.
    pub nonsense: f64,
    /// Logarithm of the factor by which misses shrink, summed over columns, at which a fault is as likely as not.
    pub even: f64,
    /// The change of that logarithm that multiplies the odds by e.
    pub scale: f64,
    /// Additional logarithm for a clock, which delays of drives and sensors resemble.
    pub clock: f64,
    /// The same for readings that come before what they tell of: only stamps of commands that are late make them.
    pub early: f64,
    /// Additional logarithm for commands, for units that hardly any log is in, and for two faults at once: they are rarer than the others.
    pub rare: f64,
    /// Logarithm of the factor by which late readings have to beat late commands to be a clock's: on a machine with one drive, whose
    /// own delay is as likely, and on one with several, which are seldom late alike.
    pub drive: [f64; 2],
    /// Smallest offset that is wiring, in deviations of the column: smaller ones are the effect `sensor-bias`.
    pub offset: f64,
    /// Smallest delay that is a clock's, s: smaller ones are effects.
    pub delay: f64,
    /// Probability from which on a fault is named.
    pub named: f64,
    /// Probability below which whole replays, and what a diagnosis leaves, have the last word about a fault. Larger: more logs that are
    /// wired as they should be are diagnosed both ways.
    pub certain: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            good: 0.3,
            suspect: 0.25,
            nonsense: 0.5,
            even: 0.65,
            scale: 0.08,
            clock: 0.1,
            early: 1.5,
            rare: 0.5,
            drive: [0.1, -0.5],
            offset: 0.4,
            delay: 0.02,
            named: 0.5,
            certain: 0.95,
        }
    }
}

impl Settings {
    /// Logarithm of the factor by which misses shrink from one view to another, summed over columns: in windows from states
    /// read off the log, and from given starts.
    #[must_use]
    pub fn shrinkage(&self, from: &Misses, to: &Misses) -> f64 {
        self.logarithm(&from.miss, &to.miss) + self.logarithm(&from.start_miss, &to.start_miss)
    }

    /// Logarithm of the factor by which some misses shrink, summed over columns.
    #[must_use]
    pub fn logarithm(&self, from: &[f64], to: &[f64]) -> f64 {
        let pairs = from.iter().zip(to);
        let ratio = |(a, b): (&f64, &f64)| ((a + self.good) / (b + self.good)).ln();
        pairs.map(ratio).sum()
    }

    /// Probability of a fault that shrinks misses by a factor with this logarithm, beyond `more`.
    #[must_use]
    pub fn probability(&self, shrinkage: f64, more: f64) -> f64 {
        1.0 / (1.0 + (-(shrinkage - self.even - more) / self.scale).exp())
    }

    /// Columns that miss more than a share of the motion.
    #[must_use]
    pub fn missed(misses: &Misses, share: f64) -> Vec<bool> {
        let pairs = misses.miss.iter().zip(&misses.start_miss);
        pairs.map(|(a, b)| a.max(*b) > share).collect()
    }
}
