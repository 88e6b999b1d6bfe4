//! `sensor-trend`: in episode `n` a reading is shifted by `step n`, as by a mounting that gives way
//! or a tape that stretches.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Standing, Values, sensors};
use crate::world::{ReadingPath, World};

/// The cause.
pub struct SensorTrend;

struct Steps(f64);

impl ReadingPath for Steps {
    fn distort(&self, values: &mut [f64], _dt: f64, episode: usize) {
        values
            .iter_mut()
            .for_each(|v| *v += self.0 * episode as f64);
    }
}

impl Cause for SensorTrend {
    fn name(&self) -> &'static str {
        "sensor-trend"
    }
    fn standing(&self) -> Standing {
        Standing::Agreed
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        sensors(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        place.spread()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        place.along_columns(size, "step", world, |value| Box::new(Steps(value)))
    }
}
