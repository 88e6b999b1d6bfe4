//! The meaning of names: when two names stand for the same effect at the same place.

use std::collections::BTreeSet;

use asid_core::registry::all;
use asid_effects::{Effect, EffectEntry};
use asid_mjcf::Plant;

use crate::label::{name_of, site_of};

/// What the catalogue and a machine say about names.
#[derive(Clone, Debug, Default)]
pub struct Sites {
    /// Pairs of geoms that can touch.
    contacts: Vec<[String; 2]>,
    /// Effects that change a contact and nothing else; their site may be either geom.
    of_contacts: BTreeSet<String>,
}

/// Whether an effect at a site changes the contacts of the geom and nothing else.
fn changes_contacts(effect: &dyn Effect, plant: &Plant, site: &str) -> bool {
    let targets = effect.targets(plant, site);
    let contact = |t: &asid_core::Target| {
        t.element == "geom" && matches!(&*t.attribute, "friction" | "solref" | "solimp")
    };
    !targets.is_empty() && targets.iter().all(contact)
}

impl Sites {
    /// Meaning of names in a machine.
    #[must_use]
    pub fn of(plant: &Plant) -> Self {
        let geom = |i: usize| plant.layout.geoms[i].clone();
        let contact_effect = |entry: &&'static EffectEntry| {
            let effect = (entry.make)();
            let sites = effect.sites(plant);
            sites.iter().any(|s| changes_contacts(&*effect, plant, s))
        };
        let effects = all::<EffectEntry>();
        Self {
            contacts: plant
                .contacts
                .iter()
                .map(|&[a, b]| [geom(a), geom(b)])
                .collect(),
            of_contacts: effects
                .iter()
                .filter(|e| contact_effect(e))
                .map(|e| e.name.to_owned())
                .collect(),
        }
    }

    /// Whether `a` and `b`, both `NAME@SITE`, are the same effect at the same place.
    #[must_use]
    pub fn same(&self, a: &str, b: &str) -> bool {
        if a == b {
            return true;
        }
        let (x, y) = (site_of(a), site_of(b));
        let touch = |[g, h]: &[String; 2]| (g == x && h == y) || (g == y && h == x);
        name_of(a) == name_of(b)
            && self.of_contacts.contains(name_of(a))
            && self.contacts.iter().any(touch)
    }

    /// Whether `set` contains `effect`.
    #[must_use]
    pub fn holds(&self, set: &[String], effect: &str) -> bool {
        set.iter().any(|e| self.same(e, effect))
    }

    /// Whether two sets are the same.
    #[must_use]
    pub fn same_set(&self, a: &[String], b: &[String]) -> bool {
        a.len() == b.len()
            && a.iter().all(|e| self.holds(b, e))
            && b.iter().all(|e| self.holds(a, e))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_effect_of_a_contact_may_name_either_geom() {
        let sites = Sites {
            contacts: vec![["puck".into(), "board".into()]],
            of_contacts: ["sliding-friction".to_owned()].into(),
        };
        assert!(sites.same("sliding-friction@puck", "sliding-friction@board"));
        assert!(!sites.same("mass@puck", "mass@board"));
        assert!(!sites.same("sliding-friction@puck", "sliding-friction@wall"));
        let set = |s: &[&str]| -> Vec<String> { s.iter().map(|e| (*e).to_owned()).collect() };
        assert!(sites.same_set(&set(&["a@x", "b@y"]), &set(&["b@y", "a@x"])));
        assert!(!sites.same_set(&set(&["a@x", "a@x"]), &set(&["a@x", "b@y"])));
    }
}
