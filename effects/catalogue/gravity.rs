//! Gravity in a tilted frame: the ground is not level.

use crate::{Acting, Acts, Confusion, Effect, EffectParameter, Site};
use asid_core::nalgebra::{Rotation3, Vector3};
use asid_core::{Result, Target};
use asid_mjcf::Plant;

use super::{target, values};

crate::register!(EffectEntry {
    name: "gravity-tilt",
    about: "the ground is not level",
    make: || Box::new(Tilt),
});

/// Turns the machine's base by `pitch` about the world's y axis and by `roll` about its x axis.
///
/// Both are right-handed, so that gravity `(0, 0, -g)` becomes
/// `g (sin pitch, -cos pitch sin roll, -cos pitch cos roll)`: downhill is +x for a positive pitch
/// and -y for a positive roll. The simulation's own gravity is turned, whatever it is.
struct Tilt;

struct TiltAt {
    columns: [usize; 3],
    turn: Rotation3<f64>,
}

impl Acting for TiltAt {
    fn set(&self, columns: &mut [f64]) {
        let level = Vector3::from(self.columns.map(|c| columns[c]));
        let tilted = self.turn * level;
        for (&column, value) in self.columns.iter().zip(tilted.iter()) {
            columns[column] = *value;
        }
    }
}

impl Effect for Tilt {
    fn mistaken_for(&self) -> &'static [Confusion] {
        &[Confusion {
            with: &["actuator-bias", "sensor-bias", "constant-force"],
            told_apart_by: "turn the set-up by 180 degrees about the vertical, or take other poses",
        }]
    }

    fn acts(&self) -> Acts {
        Acts::Model
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[
                EffectParameter::new("pitch", "rad", [-0.5, 0.5], 0.0),
                EffectParameter::new("roll", "rad", [-0.5, 0.5], 0.0),
            ]
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        let falls = plant.gravity.iter().any(|&g| g != 0.0);
        falls.then(String::new).into_iter().collect()
    }

    fn targets(&self, _plant: &Plant, _site: &str) -> Vec<Target> {
        (0..3).map(|i| target("option", "", "gravity", i)).collect()
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [pitch, roll] = values(site)?;
        let pitched = Rotation3::from_axis_angle(&Vector3::y_axis(), -pitch);
        let rolled = Rotation3::from_axis_angle(&Vector3::x_axis(), -roll);
        Ok(Box::new(TiltAt {
            columns: [site.columns[0], site.columns[1], site.columns[2]],
            turn: rolled * pitched,
        }))
    }
}
