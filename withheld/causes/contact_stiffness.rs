//! `contact-stiffness`: a contact has another stiffness.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values};
use crate::world::World;

/// The cause.
pub struct ContactStiffness;

impl Cause for ContactStiffness {
    fn name(&self) -> &'static str {
        "contact-stiffness"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        machine.contact_sites(|shows| shows.impact)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        9.0
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        place.scale_contact(size, "solref", 0, world)
    }
}
