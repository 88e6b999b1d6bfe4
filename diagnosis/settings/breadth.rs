//! How widely a search looks.

/// Default rate of false alarms of all decisions: what the field reads as "not by chance".
pub const FALSE_ALARMS: f64 = 0.01;

/// How widely a search looks.
#[derive(Clone, Copy, Debug)]
pub struct Breadth {
    /// Share of the power of what is missing without effects that a further effect must make up
    /// for; 0.04 is a fifth of the force.
    ///
    /// An effect that earns evidence and leaves the force as it was improves the noise model only.
    /// One that makes up for little is among the many small things by which any machine differs
    /// from its model.
    pub shrinks: f64,
    /// Probability with which chance alone would add an effect, over all candidates.
    pub false_alarms: f64,
    /// Number of sets that get a short fit after each screening.
    pub raced: usize,
    /// Share of the leader's evidence that a set needs to be raced.
    pub share: f64,
    /// Screened evidence below which nothing is raced, a natural logarithm: the best of a hundred
    /// candidates reaches 3 to 5 by chance.
    pub least: f64,
    /// How far a set may be behind the best after the short fits, as a share of the gain of the
    /// best.
    ///
    /// A set within `near` of the best, in evidence, stays in any case.
    pub behind: f64,
    /// See `behind`.
    pub near: f64,
    /// Number of raced sets that are fitted to the end.
    pub finished: usize,
    /// Maximum number of rounds, each of which may add a set to those named.
    pub depth: usize,
    /// Linearisations of a short fit, and of a whole one.
    pub rounds: [usize; 2],
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Default for Breadth {
    fn default() -> Self {
        Self {
            shrinks: 0.04,
            false_alarms: FALSE_ALARMS,
            raced: 8,
            share: 0.1,
            least: 3.0,
            behind: 0.5,
            near: 20.0,
            finished: 3,
            depth: 4,
            rounds: [4, 15],
            seed: 0,
        }
    }
}
