//! `sensor-quantization`: a reading is the nearest multiple of a step, its noise included.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, sensors};
use crate::world::World;

/// The cause.
pub struct SensorQuantization;

impl Cause for SensorQuantization {
    fn name(&self) -> &'static str {
        "sensor-quantization"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        sensors(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        3.0 * place.spread()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        for column in place.columns() {
            // Of two such sensors in a row the coarser one is what is seen.
            world.steps.retain(|(c, step)| *c != column || *step > size);
            if !world.steps.iter().any(|(c, _)| *c == column) {
                world.steps.push((column, size));
            }
        }
        vec![("step", size)]
    }
}
