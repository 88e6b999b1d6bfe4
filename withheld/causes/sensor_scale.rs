//! `sensor-scale`: a reading is multiplied by a factor.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, sensors};
use crate::world::{ReadingPath, World};

/// The cause.
pub struct SensorScale;

struct Scale(f64);

impl ReadingPath for Scale {
    fn distort(&self, values: &mut [f64], _dt: f64, _episode: usize) {
        values.iter_mut().for_each(|v| *v *= self.0);
    }
}

impl Cause for SensorScale {
    fn name(&self) -> &'static str {
        "sensor-scale"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        sensors(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.6
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let scale = 1.0 + place.sign(0) * size;
        for column in place.columns() {
            world.readings.push((column, Box::new(Scale(scale))));
        }
        vec![("scale", scale)]
    }
}
