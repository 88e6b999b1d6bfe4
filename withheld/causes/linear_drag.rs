//! `linear-drag`: a force at the centre of mass opposes its velocity, `-c v`.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, moving_bodies};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct LinearDrag;

struct Push {
    body: usize,
    coefficient: f64,
}

impl Force for Push {
    fn act(&mut self, sim: &mut Sim) {
        let (_, velocity) = sim.body_velocity(self.body);
        let force = velocity.map(|v| -self.coefficient * v);
        sim.push_body(self.body, force);
    }
}

impl Cause for LinearDrag {
    fn name(&self) -> &'static str {
        "linear-drag"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        moving_bodies(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        20.0
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        world.forces.push(Box::new(Push {
            body: place.body(),
            coefficient: size,
        }));
        vec![("coefficient", size)]
    }
}
