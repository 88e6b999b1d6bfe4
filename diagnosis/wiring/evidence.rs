//! Evidence for a view of the columns against the one given.
//!
//! Under a wrong view the model predicts nonsense: the opposite motion, another joint, or a motion
//! 57 times too large. An effect that the model lacks leaves a small error. Both shrink when
//! something is fitted, so significance against the noise is no criterion. The criterion is the
//! factor by which misses shrink, in units of the motion to be predicted. Its scale is set on the
//! training half of `asid withheld`, whose worlds have every effect of the catalogue up to a
//! hundred noise floors. In 76 of its cases with right wiring the best hypothesis shrinks misses by
//! a factor whose logarithm is at most 0.5. In some two hundred cases with a fault, the right
//! hypothesis has at least 0.8 (`docs/logs.md` has the command).

use super::windows::Misses;

/// Thresholds for naming a wiring fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Misses below this share of the motion are those of right wiring, and shrinking them further
    /// is no evidence.
    ///
    /// Larger: fewer faults are found, and fewer effects are mistaken for faults.
    pub good: f64,
    /// Share of the motion that a column must miss for its zero and its clock to be in question.
    /// Smaller: more is tried.
    pub suspect: f64,
    /// Share of the motion that a column must miss for its sign, unit and name to be in question.
    ///
    /// A wrong one misses about twice the motion. Smaller: more is tried.
    pub nonsense: f64,
    /// Logarithm of the factor by which misses shrink, summed over columns, that gives a fault even
    /// odds.
    pub even: f64,
    /// Change of that logarithm that multiplies the odds by e.
    pub scale: f64,
    /// Additional logarithm that a clock needs, because delays of drives and sensors resemble it.
    pub clock: f64,
    /// The same for readings earlier than the motion, which only late stamps of commands cause.
    pub early: f64,
    /// Additional logarithm for commands, for units that hardly any log has, and for two faults at
    /// once: these are rarer.
    pub rare: f64,
    /// Logarithm of the factor by which late readings must beat late commands for a clock to be
    /// named.
    ///
    /// The first is for a machine with one drive, whose own delay is as likely. The second is for
    /// several drives, which are seldom late alike.
    pub drive: [f64; 2],
    /// Smallest offset of a wiring fault, in standard deviations of the column: smaller ones are
    /// the effect `sensor-bias`.
    pub offset: f64,
    /// Smallest delay of a clock, s: smaller ones are effects.
    pub delay: f64,
    /// Lowest probability at which a fault is named.
    pub named: f64,
    /// Probability below which whole replays, and what a diagnosis leaves, decide about a fault.
    ///
    /// Larger: more logs with right wiring are diagnosed both ways.
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
    /// Logarithm of the factor by which misses shrink from one view to another, summed over
    /// columns.
    ///
    /// The sum covers windows from states read off the log and from given initial states.
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

    /// Probability of a fault with this logarithm of the shrinkage, of which it needs `more` than
    /// others.
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
