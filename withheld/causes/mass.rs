//! `mass`: a body is heavier or lighter, and its moments of inertia scale with it.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, moving_bodies};
use crate::world::{InertiaEdit, World};

/// The cause.
pub struct Mass;

impl Cause for Mass {
    fn name(&self) -> &'static str {
        "mass"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        moving_bodies(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.65
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let factor = 1.0 + place.sign(0) * size;
        let mut edit = InertiaEdit::of(place.site);
        edit.mass = factor;
        world.inertias.push(edit);
        vec![("factor", factor)]
    }
}
