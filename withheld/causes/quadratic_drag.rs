//! `quadratic-drag`: a force at the centre of mass opposes its velocity, `-c |v| v`.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, moving_bodies};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct QuadraticDrag;

struct Push {
    body: usize,
    coefficient: f64,
}

impl Force for Push {
    fn act(&mut self, sim: &mut Sim) {
        let (_, velocity) = sim.body_velocity(self.body);
        let speed = velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
        let force = velocity.map(|v| -self.coefficient * speed * v);
        sim.push_body(self.body, force);
    }
}

impl Cause for QuadraticDrag {
    fn name(&self) -> &'static str {
        "quadratic-drag"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        moving_bodies(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        5.0
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        world.forces.push(Box::new(Push {
            body: place.body(),
            coefficient: size,
        }));
        vec![("coefficient", size)]
    }
}
