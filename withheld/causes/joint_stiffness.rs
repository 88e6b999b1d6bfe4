//! `joint-stiffness`: a spring, a cable or a hose acts in parallel with a joint, `-k (q - rest)`.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, scalar_joints};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct JointStiffness;

struct Spring {
    qpos: usize,
    dof: usize,
    stiffness: f64,
    rest: f64,
}

impl Force for Spring {
    fn act(&mut self, sim: &mut Sim) {
        let away = sim.qpos()[self.qpos] - self.rest;
        sim.push_joint(self.dof, -self.stiffness * away);
    }
}

impl Cause for JointStiffness {
    fn name(&self) -> &'static str {
        "joint-stiffness"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        scalar_joints(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        10.0 * place.force() / place.roam()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let joint = place.joint();
        let rest = place.typical.mean[joint.qpos] + place.between(0, -1.0, 1.0) * place.roam();
        world.forces.push(Box::new(Spring {
            qpos: joint.qpos,
            dof: joint.dof,
            stiffness: size,
            rest,
        }));
        vec![("stiffness", size), ("rest", rest)]
    }
}
