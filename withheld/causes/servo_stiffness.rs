//! `servo-stiffness`: a servo has another gain `kp`.

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
        place.scale_gain(size, "kp", world)
    }
}
