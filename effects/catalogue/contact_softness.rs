//! Restitution and stiffness of a contact, in the terms of MuJoCo's `solref`.

use crate::{Acting, Acts, Effect, EffectParameter, Site};
use asid_core::{Capabilities, Result, Target};
use asid_mjcf::Plant;

use super::contact_friction::{partners, sites};
use super::{at_least, target, values};

crate::register!(EffectEntry {
    name: "contact-restitution",
    about: "a contact bounces more or less: its damping is smaller or larger",
    make: || Box::new(Softness::Damping),
});

crate::register!(EffectEntry {
    name: "contact-stiffness",
    about: "a contact is stiffer or softer",
    make: || Box::new(Softness::Stiffness),
});

/// Stiffness `k` or damping `b` of a contact times `factor`; the other one stays.
///
/// It applies to a geom and all that can touch it, since a contact mixes the numbers of its two
/// geoms.
///
/// `solref` is `(-k, -b)` where its numbers are negative. Where they are positive it is a time
/// constant `t` and a damping ratio `z`, with `b` in proportion to `1 / t` and `k` to
/// `1 / (t z)²`.
#[derive(Clone, Copy)]
enum Softness {
    Stiffness,
    Damping,
}

struct SoftnessAt {
    /// Both columns of each geom.
    columns: Vec<usize>,
    softness: Softness,
    factor: f64,
}

impl Acting for SoftnessAt {
    fn set(&self, columns: &mut [f64]) {
        for pair in self.columns.chunks_exact(2) {
            let is_time = columns[pair[0]] > 0.0;
            let factors = match (self.softness, is_time) {
                (Softness::Stiffness, false) => [self.factor, 1.0],
                (Softness::Stiffness, true) => [1.0, self.factor.sqrt().recip()],
                (Softness::Damping, false) => [1.0, self.factor],
                (Softness::Damping, true) => [self.factor.recip(), self.factor],
            };
            for (&column, factor) in pair.iter().zip(factors) {
                columns[column] *= factor;
            }
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
            .flat_map(|g| [0, 1].map(|i| target("geom", &plant.layout.geoms[g], "solref", i)))
            .collect()
    }

    fn needs(&self) -> Capabilities {
        Capabilities::CONTACT | Capabilities::CONTACT_STIFFNESS
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [factor] = values(site)?;
        Ok(Box::new(SoftnessAt {
            columns: site.columns.to_vec(),
            softness: *self,
            factor: at_least(site, "factor", factor, 1e-6)?,
        }))
    }
}
