//! `unknown:hidden-gyroscope`: a wheel spins inside a body, `torque = H x w` with its angular
//! momentum `H`.
//!
//! Its axis is drawn and stays fixed in the world: the body rotates little, or slowly compared with
//! the wheel.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, free_bodies};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct HiddenGyroscope;

struct Wheel {
    body: usize,
    momentum: [f64; 3],
}

impl Force for Wheel {
    fn act(&mut self, sim: &mut Sim) {
        let (w, _) = sim.body_velocity(self.body);
        let h = self.momentum;
        let torque = [
            h[1] * w[2] - h[2] * w[1],
            h[2] * w[0] - h[0] * w[2],
            h[0] * w[1] - h[1] * w[0],
        ];
        sim.twist_body(self.body, torque);
    }
}

impl Cause for HiddenGyroscope {
    fn name(&self) -> &'static str {
        "unknown:hidden-gyroscope"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        free_bodies(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.05
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let momentum = place.direction().map(|share| share * size);
        world.forces.push(Box::new(Wheel {
            body: place.body(),
            momentum,
        }));
        vec![("momentum", size)]
    }
}
