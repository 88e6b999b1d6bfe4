//! `inertia`: the moments of inertia of a body about its centre are scaled by one factor.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, moving_bodies};
use crate::world::{InertiaEdit, World};

/// The cause.
pub struct Inertia;

impl Cause for Inertia {
    fn name(&self) -> &'static str {
        "inertia"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        moving_bodies(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        1.9
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let factor = place.factor(size);
        let mut edit = InertiaEdit::of(place.site);
        edit.moments = factor;
        world.inertias.push(edit);
        vec![("factor", factor)]
    }
}
