//! `center-of-mass`: the centre of mass of a body is shifted in a drawn direction.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, moving_bodies};
use crate::world::{InertiaEdit, World};

/// The cause.
pub struct CenterOfMass;

impl Cause for CenterOfMass {
    fn name(&self) -> &'static str {
        "center-of-mass"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        moving_bodies(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.15
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let shift = place.direction().map(|share| share * size);
        let mut edit = InertiaEdit::of(place.site);
        edit.shift = shift;
        world.inertias.push(edit);
        vec![("x", shift[0]), ("y", shift[1]), ("z", shift[2])]
    }
}
