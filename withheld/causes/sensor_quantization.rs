//! `sensor-quantization`: a reading, noise included, is rounded to the nearest multiple of a step.

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
            // If two such causes act on one column, only the coarser step is visible.
            world.steps.retain(|(c, step)| *c != column || *step > size);
            if !world.steps.iter().any(|(c, _)| *c == column) {
                world.steps.push((column, size));
            }
        }
        vec![("step", size)]
    }
}
