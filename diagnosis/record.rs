//! Logs with what is known of them besides: starts, scatter, how many readings count.

use asid_core::layout::Layout;

use crate::data::Logs;
use crate::predict::State;
use crate::whitening::Scattering;

/// Logs with what is known of their noise and starts.
#[derive(Clone, Debug)]
pub struct Record {
    /// The logs.
    pub logs: Logs,
    /// Starts of the episodes, as given or first estimated.
    pub starts: Vec<State>,
    /// Scatter of predictions; none before it is known.
    pub scattering: Scattering,
    /// Number of readings.
    pub readings: usize,
}

impl Record {
    /// Without scatter.
    #[must_use]
    pub fn new(logs: Logs, starts: Vec<State>) -> Self {
        let readings = logs.present().iter().filter(|p| **p).count();
        Self {
            logs,
            starts,
            scattering: Scattering::default(),
            readings,
        }
    }

    /// The first share of each episode. What is known of the scatter is of the whole.
    #[must_use]
    pub fn cut(&self, layout: &Layout, share: f64) -> Self {
        Self::new(self.logs.cut(layout, share), self.starts.clone())
    }

    /// The first share of each episode, its own; the scatter is forgotten.
    #[must_use]
    pub fn cut_each(&self, layout: &Layout, shares: &[f64]) -> Self {
        Self::new(self.logs.cut_each(layout, shares), self.starts.clone())
    }

    /// Sets the scatter; readings beyond a horizon no longer count. With what it was.
    pub fn set_scattering(&mut self, scattering: Scattering) -> Scattering {
        let present = self.logs.present();
        let counts = |e: usize| {
            let own = &present[self.logs.offset(e)..self.logs.offset(e + 1)];
            let horizon = scattering.episodes.get(e).and_then(|w| w.horizon);
            let seen = horizon.map_or(own, |horizon| &own[..horizon]);
            seen.iter().filter(|p| **p).count()
        };
        self.readings = (0..self.logs.episodes.len()).map(counts).sum();
        std::mem::replace(&mut self.scattering, scattering)
    }

    /// Some of the episodes.
    #[must_use]
    pub fn some(&self, which: &[usize]) -> Self {
        let logs = self.logs.some(which);
        let mut record = Self::new(
            logs,
            which.iter().map(|&i| self.starts[i].clone()).collect(),
        );
        record.set_scattering(self.scattering.some(&self.logs, which));
        record
    }
}
