//! `contact-stiffness`: a contact gives way otherwise.

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
        let factor = if place.sign(0) > 0.0 {
            1.0 + size
        } else {
            1.0 / (1.0 + size)
        };
        for geom in place.machine.touching(place.site) {
            world.edit_geom(geom, "solref", 0, |old| factor * old);
        }
        vec![("factor", factor)]
    }
}
