//! `contact-restitution`: a contact has another damping, so that bodies bounce higher or lower.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values};
use crate::world::World;

/// The cause.
pub struct ContactRestitution;

impl Cause for ContactRestitution {
    fn name(&self) -> &'static str {
        "contact-restitution"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        machine.contact_sites(|shows| shows.impact)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        9.0
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        place.scale_contact(size, "solref", 1, world)
    }
}
