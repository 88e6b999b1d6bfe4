//! `armature`: rotor inertia at a joint.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, scalar_joints};
use crate::world::World;

/// The cause.
pub struct Armature;

impl Cause for Armature {
    fn name(&self) -> &'static str {
        "armature"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        scalar_joints(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        3.0 * place.force() / place.speed()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        world.edit_joint(place.site, "armature", |a| a + size);
        vec![("inertia", size)]
    }
}
