//! How widely a search looks.

/// Rate of false alarms that decisions are made at where none is stated: what is read as "not by chance" in the field.
pub const FALSE_ALARMS: f64 = 0.01;

/// How widely to search.
#[derive(Clone, Copy, Debug)]
pub struct Breadth {
    /// Share of the power of all that is missing without effects that a further effect must make up for: one that earns
    /// evidence and leaves the force as it was mends the noise model, and one that makes up for little is among the many
    /// small things by which any machine differs from its model. 0.04 is a fifth of the force.
    pub shrinks: f64,
    /// Probability with which chance alone would earn an effect its place, over all candidates.
    pub false_alarms: f64,
    /// Sets that are fitted a little after each screening.
    pub raced: usize,
    /// Share of the leader's evidence that a set needs to be raced.
    pub share: f64,
    /// Evidence in screening below which nothing is raced, natural logarithm: the best of a hundred candidates reaches 3 to
    /// 5 by chance.
    pub least: f64,
    /// Share of the gain that the best has reached up to which a set may lie behind it after the short fits, and the evidence
    /// up to which it may in any case.
    pub behind: f64,
    /// See `behind`.
    pub near: f64,
    /// Sets of these that are fitted to the end.
    pub finished: usize,
    /// Most sets that are named one upon the other.
    pub depth: usize,
    /// Linearisations of a first short fit, and of a whole one.
    pub rounds: [usize; 2],
    /// Seed of all chance.
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
