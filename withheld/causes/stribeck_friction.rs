//! `stribeck-friction`: dry friction that is largest at rest, `c + b exp(-(v / s)²)`.
//!
//! The size is `c + b`; the share of `b` is between four and eight tenths.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, scalar_joints};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct StribeckFriction;

struct Stribeck {
    dof: usize,
    coulomb: f64,
    breakaway: f64,
    speed: f64,
}

impl Force for Stribeck {
    fn before(&mut self, sim: &mut Sim) {
        let v = sim.qvel()[self.dof] / self.speed;
        let friction = self.coulomb + self.breakaway * (-v * v).exp();
        sim.add_dry_friction(self.dof, friction);
    }
    fn act(&mut self, _sim: &mut Sim) {}
}

impl Cause for StribeckFriction {
    fn name(&self) -> &'static str {
        "stribeck-friction"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        scalar_joints(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        2.0 * place.force()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let breakaway = place.between(0, 0.4, 0.8) * size;
        let speed = place.between(1, 0.1, 0.4) * place.speed();
        let timestep = world.timestep();
        world.dry_joint(place.site, 0.0, timestep);
        world.forces.push(Box::new(Stribeck {
            dof: place.joint().dof,
            coulomb: size - breakaway,
            breakaway,
            speed,
        }));
        vec![
            ("breakaway", breakaway),
            ("coulomb", size - breakaway),
            ("speed", speed),
        ]
    }
}
