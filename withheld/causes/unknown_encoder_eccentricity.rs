//! `unknown:encoder-eccentricity`: the disc of an encoder does not rotate about its centre,
//! `r + a sin(n r + p)`.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values};
use crate::world::{ReadingPath, World};

/// The cause.
pub struct EncoderEccentricity;

/// The phase, rad, of the error over one standard deviation of the reading is one of these two.
const WAVES: [f64; 2] = [2.0, 4.0];

struct Eccentric {
    size: f64,
    waves: f64,
    phase: f64,
}

impl ReadingPath for Eccentric {
    fn distort(&self, values: &mut [f64], _dt: f64, _episode: usize) {
        for value in values {
            *value += self.size * (self.waves * *value + self.phase).sin();
        }
    }
}

impl Cause for EncoderEccentricity {
    fn name(&self) -> &'static str {
        "unknown:encoder-eccentricity"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        let sensors = machine.sensors.iter();
        sensors
            .filter(|s| s.kind == "jointpos")
            .map(|s| s.name.clone())
            .collect()
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        3.0 * place.spread()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let waves = WAVES[usize::from(place.draw[0] < 0.5)] / place.spread();
        let path = Eccentric {
            size,
            waves,
            phase: std::f64::consts::TAU * place.draw[1],
        };
        world.readings.push((place.columns().start, Box::new(path)));
        vec![("amplitude", size), ("waves", waves)]
    }
}
