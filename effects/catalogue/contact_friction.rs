//! The friction coefficients of a contact.
//!
//! A site is one geom of a pair that can touch: the fixed one, else the one whose friction counts.
//! A pair takes the larger coefficient of its two geoms. The effect therefore scales
//!
//! - the site's own coefficient,
//! - that of every partner whose coefficient is at least as large or has the priority, and
//! - that of anything that lies free on a fixed site.

use crate::{Acting, Acts, Effect, EffectParameter, Site, Start};
use asid_core::{Capabilities, Result, Target};
use asid_mjcf::Plant;

use super::{at_least, target, values};

crate::register!(EffectEntry {
    name: "sliding-friction",
    about: "the sliding friction of a contact is larger or smaller",
    make: || Box::new(Friction { entry: 0 }),
});

crate::register!(EffectEntry {
    name: "torsional-friction",
    about: "the friction of a contact against spinning is larger or smaller",
    make: || Box::new(Friction { entry: 1 }),
});

crate::register!(EffectEntry {
    name: "rolling-friction",
    about: "the friction of a contact against rolling is larger or smaller",
    make: || Box::new(Friction { entry: 2 }),
});

/// Smallest `condim` of a contact for which each entry of friction counts, as MuJoCo defines it.
const CONDIM: [u32; 3] = [3, 4, 6];

/// The coefficient `entry` (0 sliding, 1 torsional, 2 rolling) times `factor`.
struct Friction {
    entry: usize,
}

struct FrictionAt {
    columns: Vec<usize>,
    factor: f64,
}

impl Acting for FrictionAt {
    fn set(&self, columns: &mut [f64]) {
        self.columns.iter().for_each(|&c| columns[c] *= self.factor);
    }
}

impl Effect for Friction {
    fn acts(&self) -> Acts {
        Acts::Model
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[EffectParameter::new("factor", "1", [0.1, 10.0], 1.0)
                .starting(Start::Values(&[0.2, 0.5, 2.0]))]
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        sites(plant, self.entry)
    }

    fn targets(&self, plant: &Plant, site: &str) -> Vec<Target> {
        targets(plant, site, self.entry)
    }

    fn needs(&self) -> Capabilities {
        needs(self.entry)
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [factor] = values(site)?;
        Ok(Box::new(FrictionAt {
            columns: site.columns.to_vec(),
            factor: at_least(site, "factor", factor, 0.0)?,
        }))
    }
}

/// Capabilities that an engine needs for an entry of friction.
pub(super) fn needs(entry: usize) -> Capabilities {
    Capabilities::CONTACT
        | [
            Capabilities::empty(),
            Capabilities::TORSIONAL_FRICTION,
            Capabilities::ROLLING_FRICTION,
        ][entry]
}

/// The geom that names the contact of a pair: the fixed one, else the one whose friction counts.
fn named_by(plant: &Plant, pair: [usize; 2], entry: usize) -> usize {
    let fixed = |g: &usize| !plant.moves(plant.geoms[*g].body);
    let found = pair.into_iter().find(fixed);
    found.unwrap_or_else(|| plant.dominant(pair, entry))
}

/// The `condim` of a pair's contacts.
fn condim(plant: &Plant, [a, b]: [usize; 2]) -> u32 {
    let (a, b) = (&plant.geoms[a], &plant.geoms[b]);
    match a.priority.cmp(&b.priority) {
        std::cmp::Ordering::Greater => a.condim,
        std::cmp::Ordering::Less => b.condim,
        std::cmp::Ordering::Equal => a.condim.max(b.condim),
    }
}

/// Pairs whose friction matters: one geom is fixed or on a free body.
fn pairs(plant: &Plant, entry: usize) -> impl Iterator<Item = [usize; 2]> {
    let pairs = plant.contacts.iter().copied();
    pairs.filter(move |&pair| {
        let bodies = pair.map(|g| plant.geoms[g].body);
        let loose = |b: usize| !plant.moves(b) || plant.free_joint(plant.bodies[b].weld).is_some();
        let counts = plant.geoms[plant.dominant(pair, entry)].friction[entry] > 0.0;
        bodies.into_iter().any(loose) && counts && condim(plant, pair) >= CONDIM[entry]
    })
}

/// Names of the geoms that are sites.
pub(super) fn sites(plant: &Plant, entry: usize) -> Vec<String> {
    let mut geoms: Vec<usize> = pairs(plant, entry)
        .map(|pair| named_by(plant, pair, entry))
        .collect();
    geoms.sort_unstable();
    geoms.dedup();
    geoms
        .into_iter()
        .map(|g| plant.layout.geoms[g].clone())
        .collect()
}

/// Partners of a geom in the contacts that it names; only the free ones if any is free.
pub(super) fn partners(plant: &Plant, geom: usize, entry: usize) -> Vec<usize> {
    let all: Vec<usize> = pairs(plant, entry)
        .filter(|&pair| named_by(plant, pair, entry) == geom)
        .map(|[a, b]| if a == geom { b } else { a })
        .collect();
    if all.iter().any(|&g| is_free(plant, g)) {
        return all.into_iter().filter(|&g| is_free(plant, g)).collect();
    }
    all
}

/// Whether a geom is on a body with a free joint.
fn is_free(plant: &Plant, geom: usize) -> bool {
    let weld = plant.bodies[plant.geoms[geom].body].weld;
    plant.free_joint(weld).is_some()
}

/// The coefficients that determine the friction of a geom's contacts.
pub(super) fn targets(plant: &Plant, site: &str, entry: usize) -> Vec<Target> {
    let Ok(geom) = plant.geom(site) else {
        return Vec::new();
    };
    let own = &plant.geoms[geom];
    let fixed = !plant.moves(own.body);
    let mut targets = Vec::new();
    let mut counts = false;
    for partner in partners(plant, geom, entry) {
        let other = &plant.geoms[partner];
        counts |= other.priority <= own.priority;
        let as_large = other.friction[entry] >= own.friction[entry];
        let lies = fixed && is_free(plant, partner);
        if other.priority > own.priority || (other.priority == own.priority && (as_large || lies)) {
            let name = &plant.layout.geoms[partner];
            targets.push(target("geom", name, "friction", entry));
        }
    }
    if counts {
        targets.insert(0, target("geom", site, "friction", entry));
    }
    targets
}
