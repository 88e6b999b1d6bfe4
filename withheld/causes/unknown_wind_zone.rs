//! `unknown:wind-zone`: a force pushes a body while it is on one side of a line.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, free_bodies};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct WindZone;

/// Width of the edge, m.
const EDGE: f64 = 0.05;

struct Zone {
    body: usize,
    edge: f64,
    force: [f64; 3],
}

impl Force for Zone {
    fn act(&mut self, sim: &mut Sim) {
        let beyond = (sim.body_position(self.body)[0] - self.edge) / EDGE;
        let share = (beyond + 0.5).clamp(0.0, 1.0);
        sim.push_body(self.body, self.force.map(|f| share * f));
    }
}

impl Cause for WindZone {
    fn name(&self) -> &'static str {
        "unknown:wind-zone"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        free_bodies(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        30.0
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let body = place.body();
        let [mean, spread] = place.whereabouts(body, 0);
        let edge = mean + place.between(0, -0.6, 0.6) * spread;
        let [x, y] = place.heading(1);
        world.forces.push(Box::new(Zone {
            body,
            edge,
            force: [size * x, size * y, 0.0],
        }));
        vec![("force", size), ("place", edge)]
    }
}
