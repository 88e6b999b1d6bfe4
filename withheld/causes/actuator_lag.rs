//! `actuator-lag`: an actuator follows its command with a time constant, `T dy/dt = u - y`.
//!
//! The solution is exact for a command that is constant over a step.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, drives};
use crate::world::{CommandPath, World};

/// The cause.
pub struct ActuatorLag;

struct Lag {
    seconds: f64,
    share: f64,
    value: f64,
}

impl CommandPath for Lag {
    fn begin(&mut self, first: f64, dt: f64) {
        self.share = 1.0 - (-dt / self.seconds).exp();
        self.value = first;
    }
    fn next(&mut self, sent: f64) -> f64 {
        self.value += self.share * (sent - self.value);
        self.value
    }
}

impl Cause for ActuatorLag {
    fn name(&self) -> &'static str {
        "actuator-lag"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        drives(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.4
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let path = Lag {
            seconds: size,
            share: 0.0,
            value: 0.0,
        };
        world.commands.push((place.drive_index(), Box::new(path)));
        vec![("time_constant", size)]
    }
}
