//! `torque-ripple`: a torque that is periodic in the angle, `a sin(n q) + b cos(n q)`.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, hinges};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct TorqueRipple;

/// Periods per turn.
const TEETH: [f64; 8] = [3.0, 4.0, 6.0, 8.0, 10.0, 12.0, 16.0, 24.0];

struct Ripple {
    qpos: usize,
    dof: usize,
    teeth: f64,
    sin: f64,
    cos: f64,
}

impl Force for Ripple {
    fn act(&mut self, sim: &mut Sim) {
        let (sin, cos) = (self.teeth * sim.qpos()[self.qpos]).sin_cos();
        sim.push_joint(self.dof, self.sin * sin + self.cos * cos);
    }
}

impl Cause for TorqueRipple {
    fn name(&self) -> &'static str {
        "torque-ripple"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        hinges(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        3.0 * place.force()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let teeth = TEETH[(place.draw[0] * TEETH.len() as f64) as usize % TEETH.len()];
        let [cos, sin] = place.heading(1);
        let joint = place.joint();
        world.forces.push(Box::new(Ripple {
            qpos: joint.qpos,
            dof: joint.dof,
            teeth,
            sin: size * sin,
            cos: size * cos,
        }));
        vec![
            ("amplitude_sin", size * sin),
            ("amplitude_cos", size * cos),
            ("teeth", teeth),
        ]
    }
}
