//! `payload`: a body carries added mass with the same distribution as its own.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, moving_bodies};
use crate::world::{InertiaEdit, World};

/// The cause.
pub struct Payload;

impl Cause for Payload {
    fn name(&self) -> &'static str {
        "payload"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        moving_bodies(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        5.0
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let mut edit = InertiaEdit::of(place.site);
        edit.payload = size;
        world.inertias.push(edit);
        vec![("mass", size)]
    }
}
