//! `actuator-gain`: a command is scaled.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, drives};
use crate::world::{CommandPath, World};

/// The cause.
pub struct ActuatorGain;

struct Gain(f64);

impl CommandPath for Gain {
    fn begin(&mut self, _first: f64, _dt: f64) {}
    fn next(&mut self, sent: f64) -> f64 {
        self.0 * sent
    }
}

impl Cause for ActuatorGain {
    fn name(&self) -> &'static str {
        "actuator-gain"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        drives(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.75
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let gain = 1.0 + place.sign(0) * size;
        let path = Box::new(Gain(gain));
        world.commands.push((place.drive_index(), path));
        vec![("gain", gain)]
    }
}
