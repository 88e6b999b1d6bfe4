//! The load that a body carries: its mass and its position.

use crate::{Acting, Acts, Confusion, Effect, EffectParameter, Site};
use asid_core::{Capabilities, Result, Target};
use asid_mjcf::Plant;

use super::mass::{masses_of, moving};
use super::{target, values};

crate::register!(EffectEntry {
    name: "payload",
    about: "a body carries an extra mass, at the body's centre of mass or off it",
    make: || Box::new(Payload),
});

/// An added mass `m` with the first moments `p = m r`.
///
/// `r` is its position from the body's centre of mass along the axes of the body's frame. The body
/// then has the mass `M + m`, and its centre moves by `p / (M + m)`. Its moments of inertia about
/// this centre grow in proportion to the mass, as if the payload were spread as the body is.
///
/// The parameters are mass and first moments, not mass and position, because forces are linear in
/// them (C. Atkeson, C. An, J. Hollerbach, "Estimation of inertial parameters of manipulator loads
/// and links", Int. J. Robotics Research 5, 1986). Each of the four has a slope at zero load, and
/// the position is `p / m`. A payload that is small and far off adds a further moment of inertia of
/// `m M / (m + M) r^2`, which is left to `inertia`.
struct Payload;

struct PayloadAt {
    /// Columns of the masses that make up the body's mass, and of its centre of mass.
    masses: Vec<usize>,
    center: Vec<usize>,
    mass: f64,
    moments: [f64; 3],
}

impl Acting for PayloadAt {
    fn set(&self, row: &mut [f64]) {
        let before: f64 = self.masses.iter().map(|&c| row[c]).sum();
        let factor = 1.0 + self.mass / before;
        self.masses.iter().for_each(|&c| row[c] *= factor);
        for (&column, moment) in self.center.iter().zip(self.moments) {
            row[column] += moment / (before + self.mass);
        }
    }
}

impl Effect for Payload {
    fn mistaken_for(&self) -> &'static [Confusion] {
        &[Confusion {
            with: &["actuator-gain"],
            told_apart_by: "hang a known weight on it, or let it fall",
        }]
    }

    fn acts(&self) -> Acts {
        Acts::Model
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[
                EffectParameter::new("mass", "kg", [0.0, 5.0], 0.0),
                EffectParameter::new("moment_x", "kg m", [-1.0, 1.0], 0.0),
                EffectParameter::new("moment_y", "kg m", [-1.0, 1.0], 0.0),
                EffectParameter::new("moment_z", "kg m", [-1.0, 1.0], 0.0),
            ]
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        let bodies = moving(plant);
        bodies.map(|b| plant.layout.bodies[b].clone()).collect()
    }

    fn targets(&self, plant: &Plant, site: &str) -> Vec<Target> {
        let center = (0..3).map(|i| target("body", site, "ipos", i));
        center.chain(masses_of(plant, site)).collect()
    }

    fn needs(&self) -> Capabilities {
        Capabilities::MASS_PARAMETERS
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [mass, x, y, z] = values(site)?;
        let (center, masses) = site.columns.split_at(3);
        Ok(Box::new(PayloadAt {
            masses: masses.to_vec(),
            center: center.to_vec(),
            mass,
            moments: [x, y, z],
        }))
    }
}
