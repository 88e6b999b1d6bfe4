//! When the trackers measure, and their systematic errors.
//!
//! A camera is slower than the machine's own sensors.
//!
//! A log has one row a frame. Between two readings of the trackers their cells are empty, and every
//! likelihood skips them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::task::Task;

/// Deviations of the trackers' systematic errors, which are the same for all readings of an
/// episode; 0 where there are none.
///
/// The defaults are what a laboratory has to reckon with: motion capture is 6 to 25 ms late from
/// end to end (Qualisys at ETH Zurich; NIME 2021), of which drivers take out the part that they
/// know, and its registration with the arm's base leaves 1 to 2 mm, or as much over the 0.1 to 0.3
/// m between markers (estimates).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TrackerPrior {
    /// Age of a reading, s.
    pub latency: f64,
    /// Error of each coordinate of a tracked position, m.
    pub offset: f64,
    /// Error of a tracked orientation about each axis of its object, or of a tracked angle, rad.
    pub rotation: f64,
}

impl Default for TrackerPrior {
    fn default() -> Self {
        Self {
            latency: 0.01,
            offset: 0.001,
            rotation: 0.005,
        }
    }
}

impl TrackerPrior {
    /// Trackers without systematic errors.
    pub const NONE: Self = Self {
        latency: 0.0,
        offset: 0.0,
        rotation: 0.0,
    };

    /// Checks that each value is a valid deviation; `section` is the table that holds them.
    ///
    /// # Errors
    /// [`Error::Config`] naming the setting.
    pub fn check(self, section: &str) -> Result<()> {
        for (name, value) in [
            ("latency", self.latency),
            ("offset", self.offset),
            ("rotation", self.rotation),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::Config {
                    key: format!("{section}.{name}"),
                    message: format!("must be at least 0, not {value}"),
                });
            }
        }
        Ok(())
    }
}

/// Which frames have a reading of the trackers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadingFrames {
    every: usize,
}

impl ReadingFrames {
    /// The frames with readings in a task, for frames of `frame_period` seconds.
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

    /// Whether there is a reading at the end of `frame`, counted from 1; frame 0 is the start,
    /// which has one.
    #[must_use]
    pub fn has(&self, frame: usize) -> bool {
        frame.is_multiple_of(self.every)
    }
}
