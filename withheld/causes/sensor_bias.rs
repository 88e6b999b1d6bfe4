//! `sensor-bias`: a reading is shifted; of a vector in a direction that is drawn.

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
        let names: &[&'static str] = if place.columns().len() == 1 {
            &["bias"]
        } else {
            &["x", "y", "z"]
        };
        let direction = place.direction();
        let mut values = Vec::new();
        for ((column, name), share) in place.columns().zip(names).zip(direction) {
            let value = if names.len() == 1 {
                place.sign(0) * size
            } else {
                share * size
            };
            world.readings.push((column, Box::new(Shift(value))));
            values.push((*name, value));
        }
        values
    }
}
