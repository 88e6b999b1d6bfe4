//! Settings of a diagnosis that a user may change.

mod breadth;

pub use breadth::{Breadth, FALSE_ALARMS};

/// Settings of a diagnosis.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    /// How widely to search, with the random seed and the rate of false alarms.
    pub breadth: Breadth,
    /// Names of effects of the catalogue that are left out.
    pub without: Vec<String>,
    /// Whether the diagnosis is repeated on simulated logs until the time runs out.
    pub calibrate: bool,
}
