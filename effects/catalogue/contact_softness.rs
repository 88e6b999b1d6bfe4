//! Restitution and stiffness of a contact, in the terms of MuJoCo's `solref`.

use crate::{Acting, Acts, Effect, EffectParameter, Site};
use asid_core::{Capabilities, Result, Target};
use asid_mjcf::Plant;

use super::contact_friction::{partners, sites};
use super::{at_least, target, values};

crate::register!(EffectEntry {
    name: "contact-restitution",
    about: "a contact bounces more or less: its damping is smaller or larger",
    make: || Box::new(Softness { entry: 1 }),
});

crate::register!(EffectEntry {
    name: "contact-stiffness",
    about: "a contact is stiffer or softer",
    make: || Box::new(Softness { entry: 0 }),
});

/// Stiffness (entry 0 of `solref`) or damping (entry 1) times `factor`.
///
/// It applies to a geom and all that can touch it, since a contact mixes the numbers of its two
/// geoms.
///
/// `solref` is `(-stiffness, -damping)` where its numbers are negative. Where they are positive it
/// is a time constant, which scales with the inverse square root of the stiffness, and a damping
/// ratio.
struct Softness {
    entry: usize,
}

struct SoftnessAt {
    columns: Vec<usize>,
    entry: usize,
    factor: f64,
}

impl Acting for SoftnessAt {
    fn set(&self, columns: &mut [f64]) {
        for &column in &self.columns {
            let value = &mut columns[column];
            let is_time = self.entry == 0 && *value > 0.0;
            *value *= if is_time {
                self.factor.sqrt().recip()
            } else {
                self.factor
            };
        }
    }
}

impl Effect for Softness {
    fn acts(&self) -> Acts {
        Acts::Model
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const { &[EffectParameter::new("factor", "1", [0.05, 20.0], 1.0)] }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        sites(plant, 0)
    }

    fn targets(&self, plant: &Plant, site: &str) -> Vec<Target> {
        let Ok(geom) = plant.geom(site) else {
            return Vec::new();
        };
        let others = partners(plant, geom, 0);
        let geoms = std::iter::once(geom).chain(others);
        geoms
            .map(|g| target("geom", &plant.layout.geoms[g], "solref", self.entry))
            .collect()
    }

    fn needs(&self) -> Capabilities {
        Capabilities::CONTACT | Capabilities::CONTACT_STIFFNESS
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [factor] = values(site)?;
        Ok(Box::new(SoftnessAt {
            columns: site.columns.to_vec(),
            entry: self.entry,
            factor: at_least(site, "factor", factor, 1e-6)?,
        }))
    }
}
