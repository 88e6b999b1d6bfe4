//! Prior odds of the effects of a set.
//!
//! Each further name also pays a price: the logarithm of the number of candidates
//! ([`crate::decision`]).

use std::collections::BTreeSet;

use asid_mjcf::Plant;

use crate::candidate::{Candidate, nameable};
use crate::latent_force::context::Context;

use super::set::Set;

/// Prior odds against an effect that is an unlikely explanation at its site.
const UNUSUAL: f64 = 10.0;

/// Prior odds for an effect at a site with another effect that it goes with: the same factor as for
/// an unusual one.
const TOGETHER: f64 = 10.0;

/// Evidence of a set with its prior odds and the price of its names.
///
/// A set pays for each name, for being one of all candidates. Tolerances pay nothing, since every
/// machine has them.
pub(super) fn worth(context: &Context<'_>, candidates: &[Candidate], set: &Set) -> f64 {
    let prior = log_prior(context.plant(), candidates, &set.candidates);
    let price = (nameable(candidates) as f64).ln();
    set.fitted.evidence + prior - price * set.names.count() as f64
}

/// Logarithm of the prior odds of some candidates, in nats.
///
/// Each law that is unusual at its site lowers it, once for any number of joints. Each law that
/// goes with another one at its site raises it.
#[must_use]
pub fn log_prior(plant: &Plant, candidates: &[Candidate], set: &[usize]) -> f64 {
    let each = set.iter().map(|&c| &candidates[c]);
    let named: Vec<&Candidate> = each.filter(|c| !c.is_tolerance).collect();
    let laws = |of: &dyn Fn(&Candidate) -> bool| -> BTreeSet<&str> {
        let some = named.iter().filter(|c| of(c));
        some.map(|c| &*c.spec.name).collect()
    };
    let unusual = laws(&|c| c.effect.unusual_at(plant, &c.spec.site));
    let together = laws(&|c| {
        let others = named.iter().filter(|o| o.spec.site == c.spec.site);
        let with = c.effect.goes_with();
        others.into_iter().any(|o| with.contains(&&*o.spec.name))
    });
    TOGETHER.ln() * together.len() as f64 - UNUSUAL.ln() * unusual.len() as f64
}
