//! `unknown:soft-stop`: a spring acts only beyond one position, like a cable that goes taut.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, scalar_joints};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct SoftStop;

struct Stop {
    qpos: usize,
    dof: usize,
    stiffness: f64,
    at: f64,
    side: f64,
}

impl Force for Stop {
    fn act(&mut self, sim: &mut Sim) {
        let beyond = self.side * (sim.qpos()[self.qpos] - self.at);
        let force = -self.side * self.stiffness * beyond.max(0.0);
        sim.push_joint(self.dof, force);
    }
}

impl Cause for SoftStop {
    fn name(&self) -> &'static str {
        "unknown:soft-stop"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        scalar_joints(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        20.0 * place.force() / place.roam()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let joint = place.joint();
        let side = place.sign(0);
        let at = place.typical.mean[joint.qpos] + side * place.between(1, 0.3, 1.0) * place.roam();
        world.forces.push(Box::new(Stop {
            qpos: joint.qpos,
            dof: joint.dof,
            stiffness: size,
            at,
            side,
        }));
        vec![("stiffness", size), ("place", at)]
    }
}
