//! `unknown:motor-crosstalk`: a share of one drive's force also acts at another joint.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, driven_joints};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct MotorCrosstalk;

struct Leak {
    from: usize,
    to: usize,
    share: f64,
}

impl Force for Leak {
    fn act(&mut self, sim: &mut Sim) {
        let force = self.share * sim.drive_forces()[self.from];
        sim.push_joint(self.to, force);
    }
}

impl Cause for MotorCrosstalk {
    fn name(&self) -> &'static str {
        "unknown:motor-crosstalk"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        let driven = driven_joints(machine);
        if driven.len() > 1 { driven } else { Vec::new() }
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.9
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let machine = place.machine;
        let joints = crate::cause::driven_joints(machine);
        let own = joints.iter().position(|j| j == place.site).unwrap_or(0);
        let other = (own + 1 + (place.draw[0] * (joints.len() - 1) as f64) as usize) % joints.len();
        let from = machine.joint(&joints[other]).unwrap_or(0);
        world.forces.push(Box::new(Leak {
            from: machine.joints[from].dof,
            to: place.joint().dof,
            share: size,
        }));
        vec![("share", size)]
    }
}
