//! `episode-offset`: a reading has another constant shift in each episode, as if its zero were
//! found anew at each start.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Standing, Values};
use crate::world::{ReadingPath, World};

/// The cause.
pub struct EpisodeOffset;

struct Shifts {
    seed: u64,
    deviation: f64,
}

impl ReadingPath for Shifts {
    fn distort(&self, values: &mut [f64], _dt: f64, episode: usize) {
        let random = &mut crate::random::stream(self.seed, &["offset", &episode.to_string()]);
        let shift = self.deviation * crate::random::normal(random);
        values.iter_mut().for_each(|v| *v += shift);
    }
}

impl Cause for EpisodeOffset {
    fn name(&self) -> &'static str {
        "episode-offset"
    }
    fn standing(&self) -> Standing {
        Standing::Agreed
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        let sensors = machine.sensors.iter();
        sensors
            .filter(|s| s.len == 1)
            .map(|s| s.name.clone())
            .collect()
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        3.0 * place.spread()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let shifts = Shifts {
            seed: (place.draw[0] * 1e9) as u64,
            deviation: size,
        };
        world
            .readings
            .push((place.columns().start, Box::new(shifts)));
        vec![("deviation", size)]
    }
}
