//! `unknown:shaker`: something nearby shakes a joint at its own frequency, `F sin(2 pi f t + p)`.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, scalar_joints};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct Shaker;

struct Law {
    dof: usize,
    force: f64,
    rate: f64,
    phase: f64,
}

impl Force for Law {
    fn act(&mut self, sim: &mut Sim) {
        let force = self.force * (self.rate * sim.time + self.phase).sin();
        sim.push_joint(self.dof, force);
    }
}

impl Cause for Shaker {
    fn name(&self) -> &'static str {
        "unknown:shaker"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        scalar_joints(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        3.0 * place.force()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let rate = std::f64::consts::TAU * place.between(0, 1.5, 6.0);
        world.forces.push(Box::new(Law {
            dof: place.joint().dof,
            force: size,
            rate,
            phase: std::f64::consts::TAU * place.draw[1],
        }));
        vec![("force", size), ("rate", rate)]
    }
}
