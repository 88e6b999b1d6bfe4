//! Logs with their initial states and the number of readings.

use asid_core::layout::Layout;

use crate::data::Logs;
use crate::predict::State;

/// Logs with their initial states and the number of readings.
#[derive(Clone, Debug)]
pub struct Record {
    /// The logs.
    pub logs: Logs,
    /// Initial states of the episodes, as given or as first estimated.
    pub starts: Vec<State>,
    /// Number of readings.
    pub readings: usize,
}

impl Record {
    /// Makes a record of logs with the given initial states.
    #[must_use]
    pub fn new(logs: Logs, starts: Vec<State>) -> Self {
        let readings = logs.present().iter().filter(|p| **p).count();
        Self {
            logs,
            starts,
            readings,
        }
    }

    /// Returns the first share of each episode.
    #[must_use]
    pub fn cut(&self, layout: &Layout, share: f64) -> Self {
        Self::new(self.logs.cut(layout, share), self.starts.clone())
    }
}
