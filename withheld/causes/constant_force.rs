//! `constant-force`: wind or a bias, as a force at the centre of mass with a constant direction in
//! the world.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, moving_bodies};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct ConstantForce;

struct Push {
    body: usize,
    force: [f64; 3],
}

impl Force for Push {
    fn act(&mut self, sim: &mut Sim) {
        let force = self.force;
        sim.push_body(self.body, force);
    }
}

impl Cause for ConstantForce {
    fn name(&self) -> &'static str {
        "constant-force"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        moving_bodies(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        30.0
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let force = place.direction().map(|share| share * size);
        world.forces.push(Box::new(Push {
            body: place.body(),
            force,
        }));
        vec![("x", force[0]), ("y", force[1]), ("z", force[2])]
    }
}
