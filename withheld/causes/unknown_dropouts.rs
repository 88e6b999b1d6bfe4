//! `unknown:dropouts`: every 0.4 s on average commands are lost for a while, and the last one is
//! held.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, drives};
use crate::world::{CommandPath, World};

/// The cause.
pub struct Dropouts;

/// Mean time between losses, s.
const BETWEEN: f64 = 0.4;

struct Lost {
    seconds: f64,
    seed: u64,
    step: u64,
    dt: f64,
    held: f64,
}

impl CommandPath for Lost {
    fn begin(&mut self, first: f64, dt: f64) {
        self.step = 0;
        self.dt = dt;
        self.held = first;
    }
    fn next(&mut self, sent: f64) -> f64 {
        let time = self.step as f64 * self.dt;
        self.step += 1;
        let slot = (time / BETWEEN) as u64;
        // A loss begins at a random time within each interval of `BETWEEN`.
        let digest = crate::random::digest(self.seed, &["dropout", &slot.to_string()]);
        let begins = BETWEEN * f64::from(digest[0]) / 256.0;
        let within = time - slot as f64 * BETWEEN;
        if !(begins..begins + self.seconds).contains(&within) {
            self.held = sent;
        }
        self.held
    }
}

impl Cause for Dropouts {
    fn name(&self) -> &'static str {
        "unknown:dropouts"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        drives(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.35
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let path = Lost {
            seconds: size,
            seed: (place.draw[0] * 1e9) as u64,
            step: 0,
            dt: 0.0,
            held: 0.0,
        };
        world.commands.push((place.drive_index(), Box::new(path)));
        vec![("seconds", size)]
    }
}
