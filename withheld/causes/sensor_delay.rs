//! `sensor-delay`: a reading arrives late.
//!
//! Before the episode the machine is assumed to have moved as at its start: the first readings lie
//! on a straight line.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, sensors};
use crate::world::{ReadingPath, World};

/// The cause.
pub struct SensorDelay;

struct Old(f64);

impl ReadingPath for Old {
    fn distort(&self, values: &mut [f64], dt: f64, _episode: usize) {
        let (delay, share) = ((self.0 / dt) as usize, (self.0 / dt).fract());
        let Some(slope) = values.get(1).map(|second| second - values[0]) else {
            return;
        };
        let fresh = values.to_vec();
        let at = |i: isize| match usize::try_from(i) {
            Ok(i) => fresh[i],
            Err(_) => fresh[0] + i as f64 * slope,
        };
        for (i, value) in values.iter_mut().enumerate() {
            let late = i as isize - delay as isize;
            *value = (1.0 - share) * at(late) + share * at(late - 1);
        }
    }
}

impl Cause for SensorDelay {
    fn name(&self) -> &'static str {
        "sensor-delay"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        sensors(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.3
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        for column in place.columns() {
            world.readings.push((column, Box::new(Old(size))));
        }
        vec![("delay", size)]
    }
}
