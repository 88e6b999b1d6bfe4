//! `sensor-drift`: a reading drifts slowly, by `rate t`; `t` begins at 0 in each episode.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, sensors};
use crate::world::{ReadingPath, World};

/// The cause.
pub struct SensorDrift;

struct Ramp(f64);

impl ReadingPath for Ramp {
    fn distort(&self, values: &mut [f64], dt: f64, _episode: usize) {
        for (i, value) in values.iter_mut().enumerate() {
            *value += self.0 * i as f64 * dt;
        }
    }
}

impl Cause for SensorDrift {
    fn name(&self) -> &'static str {
        "sensor-drift"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        sensors(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        5.0 * place.spread()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        place.along_columns(size, "rate", world, |value| Box::new(Ramp(value)))
    }
}
