//! `coulomb-friction`: dry friction of a joint, in half of the cases larger in one direction.
//!
//! The friction is `force + offset` in the positive direction and `force - offset` in the other.
//! This equals symmetric friction plus a constant force of `-offset`, in motion and at rest.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, scalar_joints};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct CoulombFriction;

/// Largest offset as a share of the force.
const SHARE: f64 = 0.4;

struct Offset {
    dof: usize,
    force: f64,
}

impl Force for Offset {
    fn act(&mut self, sim: &mut Sim) {
        sim.push_joint(self.dof, self.force);
    }
}

impl Cause for CoulombFriction {
    fn name(&self) -> &'static str {
        "coulomb-friction"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        scalar_joints(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        1.5 * place.force()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let timestep = world.timestep();
        world.dry_joint(place.site, size, timestep);
        let share = (place.between(0, -2.0, 2.0) * SHARE).clamp(-SHARE, SHARE);
        let offset = if place.draw[1] < 0.5 {
            0.0
        } else {
            share * size
        };
        if offset != 0.0 {
            let dof = place.joint().dof;
            world.forces.push(Box::new(Offset {
                dof,
                force: -offset,
            }));
        }
        vec![("force", size), ("offset", offset)]
    }
}
