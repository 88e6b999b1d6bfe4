//! `sliding-friction`: the sliding friction of a contact has another coefficient.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values};
use crate::world::World;

/// The cause.
pub struct SlidingFriction;

impl Cause for SlidingFriction {
    fn name(&self) -> &'static str {
        "sliding-friction"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        machine.contact_sites(|shows| shows.sliding)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        9.0
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        place.scale_contact(size, "friction", 0, world)
    }
}
