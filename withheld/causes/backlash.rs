//! `backlash`: play between a drive and its joint.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, geared_joints};
use crate::rotor::{Rotor, Transmission};
use crate::world::World;

/// The cause.
pub struct Backlash;

impl Cause for Backlash {
    fn name(&self) -> &'static str {
        "backlash"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        geared_joints(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.3
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let joint = place.joint_index();
        Rotor::install(place.machine, joint, Transmission::Play(size), world);
        vec![("width", size)]
    }
}
