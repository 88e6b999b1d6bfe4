//! What readings depend on: a sensor of a joint's position or speed reads the state itself.
//!
//! Reading a simulation costs as much as half a physics step. Where all sensors read the state, their slopes in it are the same in each row, and
//! what is no effect on readings does not change them.

use asid_core::Parameter;
use asid_core::layout::Sensor;

use crate::data::Logs;

/// Sensors whose reading is a coordinate of the state.
const OF_THE_STATE: [&str; 2] = ["jointpos", "jointvel"];

/// What the readings of some logs depend on.
pub(super) struct Sensors {
    /// Whether all of them are coordinates of the state, effects on readings aside.
    pub(super) read_the_state: bool,
    /// Whether there are such effects: a reading may then be any function of what it was.
    pub(super) change: bool,
    /// Whether each parameter is of one.
    pub(super) of_readings: Vec<bool>,
}

impl Sensors {
    /// Of the sensors of a machine that logs have columns of; `on_readings` are the labels of the effects on readings.
    pub(super) fn of(
        sensors: &[Sensor],
        logs: &Logs,
        (on_readings, parameters): (&[String], &[Parameter]),
    ) -> Self {
        let is_of_the_state = |name: &String| {
            let mut own = sensors.iter().filter(|s| s.name == *name);
            own.any(|s| OF_THE_STATE.contains(&&*s.kind))
        };
        let is_of_readings = |p: &Parameter| {
            let mut targets = p.targets.iter();
            targets.any(|t| on_readings.contains(&t.name) || t.element == "sensor")
        };
        Self {
            read_the_state: logs.channels().iter().all(is_of_the_state),
            change: !on_readings.is_empty(),
            of_readings: parameters.iter().map(is_of_readings).collect(),
        }
    }
}
