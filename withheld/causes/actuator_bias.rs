//! `actuator-bias`: a command is shifted by a constant.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, drives};
use crate::world::{CommandPath, World};

/// The cause.
pub struct ActuatorBias;

struct Bias(f64);

impl CommandPath for Bias {
    fn begin(&mut self, _first: f64, _dt: f64) {}
    fn next(&mut self, sent: f64) -> f64 {
        sent + self.0
    }
}

impl Cause for ActuatorBias {
    fn name(&self) -> &'static str {
        "actuator-bias"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        drives(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        3.0 * place.command()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let bias = place.sign(0) * size;
        let path = Box::new(Bias(bias));
        world.commands.push((place.drive_index(), path));
        vec![("bias", bias)]
    }
}
