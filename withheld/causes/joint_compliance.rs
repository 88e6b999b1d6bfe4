//! `joint-compliance`: elasticity between a drive and its joint.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, geared_joints};
use crate::rotor::{Rotor, Transmission};
use crate::world::World;

/// The cause.
pub struct JointCompliance;

impl Cause for JointCompliance {
    fn name(&self) -> &'static str {
        "joint-compliance"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        geared_joints(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        0.3 / place.force()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let joint = place.joint_index();
        Rotor::install(place.machine, joint, Transmission::Compliance(size), world);
        vec![("compliance", size)]
    }
}
