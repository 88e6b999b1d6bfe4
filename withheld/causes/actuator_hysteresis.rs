//! `actuator-hysteresis`: an actuator follows its command with play (the play operator of
//! Krasnosel'skii and Pokrovskii 1989).

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Standing, Values, drives};
use crate::world::{CommandPath, World};

/// The cause.
pub struct ActuatorHysteresis;

struct Play {
    width: f64,
    value: f64,
}

impl CommandPath for Play {
    fn begin(&mut self, first: f64, _dt: f64) {
        self.value = first;
    }
    fn next(&mut self, sent: f64) -> f64 {
        let half = self.width / 2.0;
        self.value = self.value.clamp(sent - half, sent + half);
        self.value
    }
}

impl Cause for ActuatorHysteresis {
    fn name(&self) -> &'static str {
        "actuator-hysteresis"
    }
    fn standing(&self) -> Standing {
        Standing::Agreed
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        drives(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        3.0 * place.command()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let path = Play {
            width: size,
            value: 0.0,
        };
        world.commands.push((place.drive_index(), Box::new(path)));
        vec![("width", size)]
    }
}
