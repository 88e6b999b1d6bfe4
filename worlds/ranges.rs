//! Ranges of the errors of a perturbed world.

use asid_core::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Ranges that a perturbed world is drawn from, `[low, high]` each: uniformly, or log-uniformly for
/// factors.
///
/// A range of one value is that value; the null value switches a part off.
///
/// Each range is what a laboratory with a calibrated arm and a motion-capture system would have to
/// admit to, and none alone spoils an experiment. Sources are named where there is one; the others
/// are marked as estimates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PerturbationRanges {
    /// Physics steps of the world per step of the simulator. Default 2: half the step, as nature
    /// has a finer resolution than any model. 1 for the same step.
    pub steps: usize,
    /// Factor on the time constant of every contact (`solref`), 1. Default 0.7 to 1.4: a scene's
    /// contact softness is usually chosen and not measured (estimate). 1 is null.
    pub contact_time: [f64; 2],
    /// Factor on the damping ratio of every contact, 1. Default 0.7 to 1.4, as for the time
    /// constant (estimate). 1 is null.
    pub contact_damping: [f64; 2],
    /// Time constant of a first-order lag between commands and servos, s. Default 0 to 0.01. The
    /// low-pass filter that libfranka applies to commands has 1.6 ms (100 Hz,
    /// `kDefaultCutoffFrequency`) and is commonly set slower; the rest is due to the joints' torque
    /// loops (estimate). 0 is null.
    pub servo_lag: [f64; 2],
    /// Factor on the mass of free bodies, 1. Default 0.97 to 1.03: a kitchen scale reads to 1 g,
    /// which is 0.5 to 5 % of objects of 200 to 20 g. 1 is null.
    pub mass: [f64; 2],
    /// Age of a tracker's reading, s. Default 0 to 0.02. Measured end to end: 6 to 7 ms (Qualisys
    /// at ETH Zurich), some 25 ms with a usual network behind it (NIME 2021); drivers compensate
    /// the part that they know. 0 is null.
    pub tracker_latency: [f64; 2],
    /// Length of the constant error of each tracked position, m; its direction is uniformly random.
    /// Default 0 to 0.002: registering a tracker with the arm's base leaves 1 to 2 mm (estimate). 0
    /// is null.
    pub tracker_offset: [f64; 2],
    /// Angle of the constant error of each tracked orientation, rad; its axis is uniformly random.
    /// Default 0 to 0.01: a millimetre where markers are 0.1 m apart (estimate). 0 is null.
    pub tracker_rotation: [f64; 2],
    /// Frames from one reading to the next, whole numbers. Default 1 to 1: frames are 10 to 20 ms,
    /// and motion capture runs at 100 Hz or more. 2 for a 30 Hz camera; the frames between are then
    /// missing.
    pub tracker_every: [usize; 2],
    /// Share of readings that are lost. Default 0 to 0.02: the arm sometimes blocks the view
    /// (estimate). 0 is null.
    pub tracker_dropout: [f64; 2],
}

impl Default for PerturbationRanges {
    fn default() -> Self {
        Self {
            steps: 2,
            contact_time: [0.7, 1.4],
            contact_damping: [0.7, 1.4],
            servo_lag: [0.0, 0.01],
            mass: [0.97, 1.03],
            tracker_latency: [0.0, 0.02],
            tracker_offset: [0.0, 0.002],
            tracker_rotation: [0.0, 0.01],
            tracker_every: [1, 1],
            tracker_dropout: [0.0, 0.02],
        }
    }
}

/// Key of the section in a configuration.
const SECTION: &str = "real.perturbation";

/// Largest number of physics steps per step of the simulator.
const MAX_STEPS: usize = 100;

impl PerturbationRanges {
    /// Null ranges: in everything that they govern the world equals the simulator.
    #[must_use]
    pub fn off() -> Self {
        Self {
            steps: 1,
            contact_time: [1.0; 2],
            contact_damping: [1.0; 2],
            servo_lag: [0.0; 2],
            mass: [1.0; 2],
            tracker_latency: [0.0; 2],
            tracker_offset: [0.0; 2],
            tracker_rotation: [0.0; 2],
            tracker_every: [1, 1],
            tracker_dropout: [0.0; 2],
        }
    }

    /// Reads the ranges that a table sets, over the defaults.
    ///
    /// # Errors
    /// [`Error::Config`] naming the key.
    pub fn read(table: &toml::Table) -> Result<Self> {
        let ranges: Self = asid_core::registry::settings(SECTION, table)?;
        ranges.check(SECTION)?;
        Ok(ranges)
    }

    /// Checks the ranges of a section.
    ///
    /// # Errors
    /// [`Error::Config`] naming the key.
    pub(crate) fn check(&self, section: &str) -> Result<()> {
        let wrong = |key: &str, message: String| {
            Err(Error::Config {
                key: format!("{section}.{key}"),
                message,
            })
        };
        if !(1..=MAX_STEPS).contains(&self.steps) {
            let message = format!("{} is not a whole number from 1 to {MAX_STEPS}", self.steps);
            return wrong("steps", message);
        }
        let [low, high] = self.tracker_every;
        if low == 0 || low > high {
            return wrong(
                "tracker_every",
                format!("[{low}, {high}] is no range of whole numbers from 1 up"),
            );
        }
        // Limits: a factor is positive; a time or length is not negative.
        for (key, [low, high], [least, most]) in [
            ("contact_time", self.contact_time, [0.01, 100.0]),
            ("contact_damping", self.contact_damping, [0.01, 100.0]),
            ("servo_lag", self.servo_lag, [0.0, 0.5]),
            ("mass", self.mass, [0.1, 10.0]),
            ("tracker_latency", self.tracker_latency, [0.0, 1.0]),
            ("tracker_offset", self.tracker_offset, [0.0, 1.0]),
            ("tracker_rotation", self.tracker_rotation, [0.0, 1.0]),
            ("tracker_dropout", self.tracker_dropout, [0.0, 0.9]),
        ] {
            if !(least <= low && low <= high && high <= most) {
                let message = format!("[{low}, {high}] is no range within {least} to {most}");
                return wrong(key, message);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_go_over_the_defaults_and_errors_name_the_key() {
        let table = |text: &str| text.parse::<toml::Table>().unwrap();
        let read =
            PerturbationRanges::read(&table("tracker_latency = [0, 0.05]\nsteps = 4")).unwrap();
        let expected = PerturbationRanges {
            tracker_latency: [0.0, 0.05],
            steps: 4,
            ..PerturbationRanges::default()
        };
        assert_eq!(read, expected);
        for (text, key) in [
            (
                "tracker_latency = [0.02, 0.0]",
                "real.perturbation.tracker_latency",
            ),
            ("mass = [0.0, 1.0]", "real.perturbation.mass"),
            ("steps = 0", "real.perturbation.steps"),
            ("tracker_every = [0, 1]", "real.perturbation.tracker_every"),
            ("tracker_lateness = [0.0, 0.1]", "tracker_lateness"),
            ("mass = [nan, 1.0]", "real.perturbation.mass"),
        ] {
            let error = PerturbationRanges::read(&table(text))
                .unwrap_err()
                .to_string();
            assert!(error.contains(key), "{text}: {error}");
        }
        assert!(PerturbationRanges::off().check(SECTION).is_ok());
    }
}
