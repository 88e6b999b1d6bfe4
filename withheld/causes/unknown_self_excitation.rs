//! `unknown:self-excitation`: a force drives a joint on at low speed but not at high speed,
//! `c v exp(-(v / s)²)`.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, scalar_joints};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct SelfExcitation;

struct Law {
    dof: usize,
    gain: f64,
    speed: f64,
}

impl Force for Law {
    fn act(&mut self, sim: &mut Sim) {
        let v = sim.qvel()[self.dof];
        let force = self.gain * v * (-(v / self.speed).powi(2)).exp();
        sim.push_joint(self.dof, force);
    }
}

impl Cause for SelfExcitation {
    fn name(&self) -> &'static str {
        "unknown:self-excitation"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        scalar_joints(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        3.0 * place.force() / place.speed()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let speed = place.between(0, 0.3, 0.8) * place.speed();
        world.forces.push(Box::new(Law {
            dof: place.joint().dof,
            gain: size,
            speed,
        }));
        vec![("gain", size), ("speed", speed)]
    }
}
