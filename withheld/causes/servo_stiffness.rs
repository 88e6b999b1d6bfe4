//! `servo-stiffness`: the gain `kp` of a servo is another one.

use crate::anatomy::{Anatomy, DriveKind};
use crate::cause::{Cause, Place, Standing, Values};
use crate::world::World;

/// The cause.
pub struct ServoStiffness;

impl Cause for ServoStiffness {
    fn name(&self) -> &'static str {
        "servo-stiffness"
    }
    fn standing(&self) -> Standing {
        Standing::Agreed
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        let drives = machine.drives.iter();
        drives
            .filter(|d| matches!(d.kind, DriveKind::Position))
            .map(|d| d.name.clone())
            .collect()
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
        if let Some(e) = world.document.find_in_mut("actuator", place.site) {
            let old = e.number("kp").unwrap_or(0.0);
            e.set_numbers("kp", &[factor * old]);
        }
        vec![("factor", factor)]
    }
}
