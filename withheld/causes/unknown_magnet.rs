//! `unknown:magnet-at-one-angle`: a joint is pulled to one place, and only near it.
//!
//! The force is that of a well of Gaussian shape: `-F sqrt(e) (x / w) exp(-x² / 2 w²)`. Its maximum
//! is `F`, at a distance of `w`.

use crate::anatomy::{Anatomy, JointKind};
use crate::cause::{Cause, Place, Values, scalar_joints};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct Magnet;

struct Well {
    qpos: usize,
    dof: usize,
    place: f64,
    width: f64,
    force: f64,
}

impl Force for Well {
    fn act(&mut self, sim: &mut Sim) {
        let x = (sim.qpos()[self.qpos] - self.place) / self.width;
        let force = -self.force * x * (0.5 - 0.5 * x * x).exp();
        sim.push_joint(self.dof, force);
    }
}

impl Cause for Magnet {
    fn name(&self) -> &'static str {
        "unknown:magnet-at-one-angle"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        scalar_joints(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        3.0 * place.force()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let joint = place.joint();
        // The width is a few degrees, or a few centimetres.
        let width = match joint.kind {
            JointKind::Slide => 0.04,
            _ => 0.12,
        };
        world.forces.push(Box::new(Well {
            qpos: joint.qpos,
            dof: joint.dof,
            place: place.machine.qpos0[joint.qpos] + width * place.between(0, -2.0, 2.0),
            width,
            force: size,
        }));
        vec![("force", size), ("width", width)]
    }
}
