//! `unknown:heat-fade`: a drive weakens as it heats up.
//!
//! The temperature follows `dT/dt = (u / u0)² - T / 2 s`, and the gain is `1 / (1 + size T)`. Each
//! episode begins cold.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, drives};
use crate::world::{CommandPath, World};

/// The cause.
pub struct HeatFade;

/// Time constant with which a drive cools, s.
const COOLS: f64 = 2.0;

struct Heat {
    size: f64,
    typical: f64,
    warmth: f64,
    dt: f64,
}

impl CommandPath for Heat {
    fn begin(&mut self, _first: f64, dt: f64) {
        self.warmth = 0.0;
        self.dt = dt;
    }
    fn next(&mut self, sent: f64) -> f64 {
        let heats = (sent / self.typical).powi(2) - self.warmth / COOLS;
        self.warmth += self.dt * heats;
        sent / (1.0 + self.size * self.warmth)
    }
}

impl Cause for HeatFade {
    fn name(&self) -> &'static str {
        "unknown:heat-fade"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        drives(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        3.0
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let path = Heat {
            size,
            typical: place.command(),
            warmth: 0.0,
            dt: 0.0,
        };
        world.commands.push((place.drive_index(), Box::new(path)));
        vec![("fade", size)]
    }
}
