//! Difficulties that several tasks share: the speed of the hand, and the trackers.

use asid_core::signal::Signal;
use asid_core::{Difficulty, Error, Levels, Result};

use crate::steering::{FRAME_PERIOD, FRAMES};

/// Settable tracker rates, Hz: one reading per control step, or one per frame.
const RATES: [f64; 2] = [1.0 / (FRAMES as f64 * FRAME_PERIOD), 1.0 / FRAME_PERIOD];

/// Largest speed of the hand during exploration, m/s.
///
/// The published controller reaches 0.75 m/s (0.075 m in a control step of 0.1 s).
pub fn hand_speed(default: f64) -> Difficulty {
    let about = "largest speed of the hand while it explores";
    Difficulty::new("hand_speed", "m/s", default, [0.1, 0.75], about).published(0.75)
}

/// Noise of the tracked positions, and rate of the readings.
///
/// The published noise is 0.01 on each entry of an observation, which arrives once per control
/// step.
pub fn tracker() -> Vec<Difficulty> {
    let noise = "standard deviation of the noise of each entry of a tracked position";
    let rate = "readings of the trackers a second: 10 or 50";
    vec![
        Difficulty::new("tracker_noise", "m", 0.002, [1e-4, 0.02], noise).published(0.01),
        Difficulty::new("tracker_rate", "Hz", RATES[1], RATES, rate).published(RATES[0]),
    ]
}

/// Noise of the tracked orientations.
///
/// 0.01 on each entry of a unit quaternion is 0.02 rad of rotation about each axis, because the
/// quaternion of a small rotation holds half its angle.
pub fn angle_noise() -> Difficulty {
    let about = "standard deviation of the noise of a tracked orientation about each axis";
    Difficulty::new("tracker_angle_noise", "rad", 0.01, [1e-3, 0.1], about).published(0.02)
}

/// Signals that the trackers read; sensors whose names end in `quat` are orientations.
///
/// # Errors
/// When a required difficulty is missing.
pub fn signals(levels: &Levels, sensors: &[&str]) -> Result<Vec<Signal>> {
    let signal = |sensor: &&str| {
        let noise = levels.get(if sensor.ends_with("quat") {
            "tracker_angle_noise"
        } else {
            "tracker_noise"
        })?;
        Ok(Signal {
            sensor: (*sensor).to_owned(),
            noise,
        })
    };
    sensors.iter().map(signal).collect()
}

/// Rate of the trackers, Hz.
///
/// # Errors
/// When the rate does not give a reading at the end of each control step.
pub fn rate(levels: &Levels) -> Result<f64> {
    let rate = levels.get("tracker_rate")?;
    if RATES.contains(&rate) {
        return Ok(rate);
    }
    Err(Error::Config {
        key: "difficulty.tracker_rate".into(),
        message: format!(
            "must be {} Hz (once a control step) or {} Hz (at every frame), not {rate}",
            RATES[0], RATES[1]
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rates_are_those_of_control_steps_and_of_frames() {
        assert_eq!(RATES, [10.0, 50.0]);
        let at = |rate: f64| {
            let levels = Levels::new(tracker()).with(&[("tracker_rate".to_owned(), rate)].into());
            super::rate(&levels.unwrap())
        };
        assert_eq!(at(10.0).unwrap(), 10.0);
        let error = at(25.0).unwrap_err().to_string();
        assert!(
            error.contains("10 Hz") && error.contains("50 Hz"),
            "{error}"
        );
    }
}
