//! `unknown:eddy-brake`: an eddy-current brake that is strongest at one speed,
//! `-c v / (1 + (v / s)²)` (Smythe 1942).

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, scalar_joints};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct EddyBrake;

struct Law {
    dof: usize,
    damping: f64,
    speed: f64,
}

impl Force for Law {
    fn act(&mut self, sim: &mut Sim) {
        let v = sim.qvel()[self.dof];
        let force = -self.damping * v / (1.0 + (v / self.speed).powi(2));
        sim.push_joint(self.dof, force);
    }
}

impl Cause for EddyBrake {
    fn name(&self) -> &'static str {
        "unknown:eddy-brake"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        scalar_joints(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        30.0 * place.force() / place.speed()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let speed = place.between(0, 0.15, 0.4) * place.speed();
        world.forces.push(Box::new(Law {
            dof: place.joint().dof,
            damping: size,
            speed,
        }));
        vec![("damping", size), ("speed", speed)]
    }
}
