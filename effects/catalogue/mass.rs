//! Mass properties of moving bodies.
//!
//! Where geoms determine a body's mass, `mass` changes the masses of the geoms; `center-of-mass`
//! and `inertia` change what results from them. All of them therefore compose with a study that
//! fits the mass of a geom.

use crate::{Acting, Acts, Confusion, Effect, EffectParameter, Reference, Site};
use asid_core::{Capabilities, Result, Target};
use asid_mjcf::Plant;

use super::{target, values};

crate::register!(EffectEntry {
    name: MASS,
    about: "a mass is larger or smaller",
    make: || Box::new(MassProperty::Mass),
});

crate::register!(EffectEntry {
    name: "center-of-mass",
    about: "the centre of mass of a body is elsewhere",
    make: || Box::new(MassProperty::Center),
});

crate::register!(EffectEntry {
    name: "inertia",
    about: "the moments of inertia of a body are larger or smaller",
    make: || Box::new(MassProperty::Inertia),
});

/// The property that changes.
///
/// - `Mass`: times `factor`, inertia with it; of a geom that has a mass, else of a body.
/// - `Center`: moved by `x`, `y`, `z` in the body's frame.
/// - `Inertia`: the three principal moments times `factor`.
#[derive(Clone, Copy)]
enum MassProperty {
    Mass,
    Center,
    Inertia,
}

struct MassPropertyAt {
    property: MassProperty,
    columns: Vec<usize>,
    values: [f64; 3],
}

impl Acting for MassPropertyAt {
    fn set(&self, row: &mut [f64]) {
        let [first, ..] = self.values;
        match self.property {
            MassProperty::Mass | MassProperty::Inertia => {
                self.columns.iter().for_each(|&c| row[c] *= first);
            }
            MassProperty::Center => {
                for (&column, shift) in self.columns.iter().zip(self.values) {
                    row[column] += shift;
                }
            }
        }
    }
}

/// Three standard deviations of masses and moments of inertia from a drawing, as a share.
///
/// Drawings leave out cables, screws and grease, and densities vary.
const TOLERANCE: f64 = 0.09;

/// Name of the effect on a mass.
pub const MASS: &str = "mass";

/// Names of the geoms that determine a body's mass; empty where the body has its own.
fn geoms_of(plant: &Plant, body: usize) -> Vec<String> {
    let geoms = plant.geoms.iter().zip(&plant.layout.geoms);
    geoms
        .filter(|(g, _)| g.body == body && g.has_mass)
        .map(|(_, name)| name.clone())
        .collect()
}

/// The masses that make up a body's mass: those of its geoms, or its own.
pub(super) fn masses_of(plant: &Plant, body: &str) -> Vec<Target> {
    let index = plant.layout.bodies.iter().position(|b| b == body);
    let geoms = index.map_or_else(Vec::new, |b| geoms_of(plant, b));
    if geoms.is_empty() {
        return vec![target("body", body, "mass", 0)];
    }
    let geoms = geoms.iter();
    geoms.map(|g| target("geom", g, "mass", 0)).collect()
}

/// Bodies with mass that can move.
pub(super) fn moving(plant: &Plant) -> impl Iterator<Item = usize> {
    (1..plant.bodies.len()).filter(|&b| plant.moves(b) && plant.bodies[b].mass > 0.0)
}

impl Effect for MassProperty {
    fn mistaken_for(&self) -> &'static [Confusion] {
        match self {
            Self::Mass => &[Confusion {
                with: &["actuator-gain"],
                told_apart_by: "hang a known weight on it, or let it fall",
            }],
            Self::Center | Self::Inertia => &[],
        }
    }

    fn tolerance(&self, _: &Plant, _: &str, _: &dyn Fn(Reference) -> f64) -> Vec<[f64; 2]> {
        match self {
            Self::Mass | Self::Inertia => vec![[1.0 - TOLERANCE, 1.0 + TOLERANCE]],
            Self::Center => Vec::new(),
        }
    }

    fn acts(&self) -> Acts {
        Acts::Model
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        match self {
            Self::Mass => const { &[EffectParameter::new("factor", "1", [0.3, 3.0], 1.0)] },
            Self::Inertia => const { &[EffectParameter::new("factor", "1", [0.5, 3.0], 1.0)] },
            Self::Center => {
                const {
                    &[
                        EffectParameter::new("x", "m", [-0.2, 0.2], 0.0),
                        EffectParameter::new("y", "m", [-0.2, 0.2], 0.0),
                        EffectParameter::new("z", "m", [-0.2, 0.2], 0.0),
                    ]
                }
            }
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        let body = |b: usize| plant.layout.bodies[b].clone();
        match self {
            Self::Mass => moving(plant)
                .flat_map(|b| match geoms_of(plant, b) {
                    geoms if geoms.is_empty() => vec![body(b)],
                    geoms => geoms,
                })
                .collect(),
            Self::Center | Self::Inertia => moving(plant).map(body).collect(),
        }
    }

    fn targets(&self, plant: &Plant, site: &str) -> Vec<Target> {
        let is_geom = |name: &str| {
            let geoms = plant.geoms.iter().zip(&plant.layout.geoms);
            geoms.into_iter().any(|(g, n)| n == name && g.has_mass)
        };
        match self {
            Self::Mass if is_geom(site) => vec![target("geom", site, "mass", 0)],
            Self::Mass => vec![target("body", site, "mass", 0)],
            Self::Center => (0..3).map(|i| target("body", site, "ipos", i)).collect(),
            Self::Inertia => (0..3).map(|i| target("body", site, "inertia", i)).collect(),
        }
    }

    fn needs(&self) -> Capabilities {
        Capabilities::MASS_PARAMETERS
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let values = match self {
            Self::Center => values(site)?,
            _ => {
                let [value] = values(site)?;
                [value, 0.0, 0.0]
            }
        };
        Ok(Box::new(MassPropertyAt {
            property: *self,
            columns: site.columns.to_vec(),
            values,
        }))
    }
}
