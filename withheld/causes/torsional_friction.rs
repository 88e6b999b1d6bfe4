//! `torsional-friction`: the torsional friction of a contact has another coefficient.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values};
use crate::world::World;

/// The cause.
pub struct TorsionalFriction;

impl Cause for TorsionalFriction {
    fn name(&self) -> &'static str {
        "torsional-friction"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        machine.contact_sites(|shows| shows.torsion)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        9.0
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        place.scale_contact(size, "friction", 1, world)
    }
}
