//! `actuator-saturation`: the force of a drive on its joint is limited.
//!
//! The size is the missing share of the largest force: the limit is `peak (1 - size)`.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, joint_drives};
use crate::world::World;

/// The cause.
pub struct ActuatorSaturation;

impl Cause for ActuatorSaturation {
    fn name(&self) -> &'static str {
        "actuator-saturation"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        joint_drives(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.97
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let peak = place.typical.peak[place.joint().dof];
        let limit = peak * (1.0 - size);
        let force = limit / place.drive().gear.abs();
        if let Some(e) = world.document.find_in_mut("actuator", place.site) {
            e.set_numbers("forcerange", &[-force, force]);
        }
        vec![("limit", limit)]
    }
}
