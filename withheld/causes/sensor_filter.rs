//! `sensor-filter`: a reading passes through a first-order low-pass filter, `T dy/dt = r - y`,
//! which is at rest at the start.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, sensors};
use crate::world::{ReadingPath, World};

/// The cause.
pub struct SensorFilter;

struct LowPass(f64);

impl ReadingPath for LowPass {
    fn distort(&self, values: &mut [f64], dt: f64, _episode: usize) {
        // Exact for a reading that is linear between time steps.
        let (x, decay) = (dt / self.0, (-dt / self.0).exp());
        let share = (1.0 - decay) / x;
        let (mut filtered, mut before) = (values[0], values[0]);
        for value in values {
            let slope = *value - before;
            filtered = decay * filtered + (1.0 - decay) * before + slope * (1.0 - share);
            before = *value;
            *value = filtered;
        }
    }
}

impl Cause for SensorFilter {
    fn name(&self) -> &'static str {
        "sensor-filter"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        sensors(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.4
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        for column in place.columns() {
            world.readings.push((column, Box::new(LowPass(size))));
        }
        vec![("time_constant", size)]
    }
}
