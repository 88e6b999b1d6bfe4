//! What a user may set of a diagnosis.

mod breadth;

pub use breadth::{Breadth, FALSE_ALARMS};

/// Settings of a diagnosis.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    /// How widely to search, with the seed of all chance and the rate of false alarms.
    pub breadth: Breadth,
    /// Effects of the catalogue that are left out, by name.
    pub without: Vec<String>,
    /// Whether the diagnosis is repeated on simulated logs for as long as there is time.
    pub calibrate: bool,
}
