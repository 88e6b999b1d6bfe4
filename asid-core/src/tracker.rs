//! When the trackers read: a camera is slower than the machine's own sensors.
//!
//! A log has a row a frame. Between two readings of the trackers their cells are empty, which every
//! likelihood passes over.

use crate::task::Task;

/// Which frames have a reading of the trackers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadingFrames {
    every: usize,
}

impl ReadingFrames {
    /// Those of a task, for frames of `frame_period` seconds.
    #[must_use]
    pub fn of(task: &dyn Task, frame_period: f64) -> Self {
        let every = task
            .spec()
            .tracker_rate
            .map_or(1, |rate| (1.0 / (rate * frame_period)).round() as usize);
        Self {
            every: every.max(1),
        }
    }

    /// Whether there is a reading at the end of `frame`, counted from 1; 0 is the start, where there is one.
    #[must_use]
    pub fn has(&self, frame: usize) -> bool {
        frame.is_multiple_of(self.every)
    }
}
