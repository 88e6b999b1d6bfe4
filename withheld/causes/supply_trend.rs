//! `supply-trend`: in episode `n` the gain of a drive is `1 + rate n`, as with a battery that
//! drains over an afternoon.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Standing, Values, drives};
use crate::world::{CommandPath, World};

/// The cause.
pub struct SupplyTrend;

struct Gains {
    rate: f64,
    gain: f64,
}

impl CommandPath for Gains {
    fn episode(&mut self, number: usize) {
        self.gain = (1.0 + self.rate * number as f64).max(0.0);
    }
    fn begin(&mut self, _first: f64, _dt: f64) {}
    fn next(&mut self, sent: f64) -> f64 {
        self.gain * sent
    }
}

impl Cause for SupplyTrend {
    fn name(&self) -> &'static str {
        "supply-trend"
    }
    fn standing(&self) -> Standing {
        Standing::Agreed
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        drives(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.1
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let rate = place.sign(0) * size;
        let path = Gains { rate, gain: 1.0 };
        world.commands.push((place.drive_index(), Box::new(path)));
        vec![("rate", rate)]
    }
}
