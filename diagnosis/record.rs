//! Logs with what is known of them besides: starts, and how many readings count.

use asid_core::layout::Layout;

use crate::data::Logs;
use crate::predict::State;

/// Logs with what is known of their starts.
#[derive(Clone, Debug)]
pub struct Record {
    /// The logs.
    pub logs: Logs,
    /// Starts of the episodes, as given or first estimated.
    pub starts: Vec<State>,
    /// Number of readings.
    pub readings: usize,
}

impl Record {
    /// Of logs that begin at some states.
    #[must_use]
    pub fn new(logs: Logs, starts: Vec<State>) -> Self {
        let readings = logs.present().iter().filter(|p| **p).count();
        Self {
            logs,
            starts,
            readings,
        }
    }

    /// The first share of each episode.
    #[must_use]
    pub fn cut(&self, layout: &Layout, share: f64) -> Self {
        Self::new(self.logs.cut(layout, share), self.starts.clone())
    }
}
