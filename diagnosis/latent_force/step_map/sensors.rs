//! What readings depend on: a sensor of a joint's position or speed reads the state itself.
//!
//! Reading a simulation costs as much as half a physics step. If all sensors read the state, their
//! derivatives with respect to it are the same in each row. Only effects on readings then change
//! the readings of a state.

use asid_core::Parameter;
use asid_core::layout::Sensor;

use crate::data::Logs;

/// Kinds of sensors that read a coordinate of the state.
const OF_THE_STATE: [&str; 2] = ["jointpos", "jointvel"];

/// What the readings of some logs depend on.
pub(super) struct Sensors {
    /// Whether all of them are coordinates of the state, apart from effects on readings.
    pub(super) read_the_state: bool,
    /// Whether there are effects on readings, which may make a reading any function of its former
    /// value.
    pub(super) change: bool,
    /// Whether each parameter belongs to an effect on readings.
    pub(super) of_readings: Vec<bool>,
}

impl Sensors {
    /// Builds it for the sensors of a machine that the logs contain; `on_readings` are the labels
    /// of the effects on readings.
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
