//! `rolling-friction`: the rolling friction of a contact has another coefficient.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values};
use crate::world::World;

/// The cause.
pub struct RollingFriction;

impl Cause for RollingFriction {
    fn name(&self) -> &'static str {
        "rolling-friction"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        machine.contact_sites(|shows| shows.rolling)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        9.0
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        place.scale_contact(size, "friction", 2, world)
    }
}
