//! `sensor-bias`: a reading is shifted by a constant; a vector is shifted in a drawn direction.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, sensors};
use crate::world::{ReadingPath, World};

/// The cause.
pub struct SensorBias;

struct Shift(f64);

impl ReadingPath for Shift {
    fn distort(&self, values: &mut [f64], _dt: f64, _episode: usize) {
        values.iter_mut().for_each(|v| *v += self.0);
    }
}

impl Cause for SensorBias {
    fn name(&self) -> &'static str {
        "sensor-bias"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        sensors(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        5.0 * place.spread()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        place.along_columns(size, "bias", world, |value| Box::new(Shift(value)))
    }
}
