//! `load-friction`: dry friction proportional to the force that the drive transmits.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, driven_joints};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct LoadFriction;

struct Load {
    dof: usize,
    coefficient: f64,
}

impl Force for Load {
    fn before(&mut self, sim: &mut Sim) {
        let load = sim.drive_forces()[self.dof].abs();
        sim.add_dry_friction(self.dof, self.coefficient * load);
    }
    fn act(&mut self, _sim: &mut Sim) {}
}

impl Cause for LoadFriction {
    fn name(&self) -> &'static str {
        "load-friction"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        driven_joints(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.95
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let timestep = world.timestep();
        world.dry_joint(place.site, 0.0, timestep);
        world.forces.push(Box::new(Load {
            dof: place.joint().dof,
            coefficient: size,
        }));
        vec![("coefficient", size)]
    }
}
