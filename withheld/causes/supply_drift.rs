//! `supply-drift`: the gain of a drive changes during an episode, by the factor `1 + rate t`.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Standing, Values, drives};
use crate::world::{CommandPath, World};

/// The cause.
pub struct SupplyDrift;

struct Fade {
    rate: f64,
    time: f64,
    dt: f64,
}

impl CommandPath for Fade {
    fn begin(&mut self, _first: f64, dt: f64) {
        self.time = 0.0;
        self.dt = dt;
    }
    fn next(&mut self, sent: f64) -> f64 {
        let gain = (1.0 + self.rate * self.time).max(0.0);
        self.time += self.dt;
        gain * sent
    }
}

impl Cause for SupplyDrift {
    fn name(&self) -> &'static str {
        "supply-drift"
    }
    fn standing(&self) -> Standing {
        Standing::Agreed
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        drives(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.5
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let rate = place.sign(0) * size;
        let path = Fade {
            rate,
            time: 0.0,
            dt: 0.0,
        };
        world.commands.push((place.drive_index(), Box::new(path)));
        vec![("rate", rate)]
    }
}
