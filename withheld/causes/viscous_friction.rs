//! `viscous-friction`: a force proportional to a joint's velocity, `-d v`.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, scalar_joints};
use crate::world::World;

/// The cause.
pub struct ViscousFriction;

impl Cause for ViscousFriction {
    fn name(&self) -> &'static str {
        "viscous-friction"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        scalar_joints(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        10.0 * place.force() / place.speed()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        world.edit_joint(place.site, "damping", |d| d + size);
        vec![("damping", size)]
    }
}
