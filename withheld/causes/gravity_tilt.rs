//! `gravity-tilt`: the ground is not level. Gravity is rotated by two angles and keeps its
//! magnitude.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values};
use crate::world::World;

/// The cause.
pub struct GravityTilt;

/// Standard gravity, m/s².
const G: f64 = 9.81;

impl Cause for GravityTilt {
    fn name(&self) -> &'static str {
        "gravity-tilt"
    }
    fn sites(&self, _machine: &Anatomy) -> Vec<String> {
        vec![String::new()]
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.4
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let [c, s] = place.heading(0);
        let (pitch, roll) = (size * c, size * s);
        let gravity = [
            G * pitch.sin(),
            -G * pitch.cos() * roll.sin(),
            -G * pitch.cos() * roll.cos(),
        ];
        if let Some(option) = world.document.find_mut("option", None) {
            option.set_numbers("gravity", &gravity);
        }
        vec![("pitch", pitch), ("roll", roll)]
    }
}
