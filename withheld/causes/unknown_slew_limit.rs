//! `unknown:slew-limit`: the rate of change of a command is limited.
//!
//! The size is the time in which the command can change by its standard deviation.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, drives};
use crate::world::{CommandPath, World};

/// The cause.
pub struct SlewLimit;

struct Slew {
    rate: f64,
    value: f64,
    dt: f64,
}

impl CommandPath for Slew {
    fn begin(&mut self, first: f64, dt: f64) {
        self.value = first;
        self.dt = dt;
    }
    fn next(&mut self, sent: f64) -> f64 {
        let most = self.rate * self.dt;
        self.value += (sent - self.value).clamp(-most, most);
        self.value
    }
}

impl Cause for SlewLimit {
    fn name(&self) -> &'static str {
        "unknown:slew-limit"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        drives(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        2.0
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let path = Slew {
            rate: place.command() / size,
            value: 0.0,
            dt: 0.0,
        };
        world.commands.push((place.drive_index(), Box::new(path)));
        vec![("seconds", size)]
    }
}
