//! `magnus`: a force pushes a spinning body sideways, `c w x v`.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, free_bodies};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct Magnus;

struct Push {
    body: usize,
    coefficient: f64,
}

impl Force for Push {
    fn act(&mut self, sim: &mut Sim) {
        let (w, v) = sim.body_velocity(self.body);
        let cross = [
            w[1] * v[2] - w[2] * v[1],
            w[2] * v[0] - w[0] * v[2],
            w[0] * v[1] - w[1] * v[0],
        ];
        let force = cross.map(|x| self.coefficient * x);
        sim.push_body(self.body, force);
    }
}

impl Cause for Magnus {
    fn name(&self) -> &'static str {
        "magnus"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        free_bodies(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.1
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let coefficient = place.sign(0) * size;
        world.forces.push(Box::new(Push {
            body: place.body(),
            coefficient,
        }));
        vec![("coefficient", coefficient)]
    }
}
