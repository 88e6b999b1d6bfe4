//! Prior odds of the effects of a set. Each further name has a price besides: the logarithm of the number of candidates
//! ([`crate::decision`]).

use std::collections::BTreeSet;

use asid_mjcf::Plant;

use crate::candidate::{Candidate, nameable};
use crate::latent_force::context::Context;

use super::set::Set;

/// Prior odds against an effect at a site where it comes to mind only after others.
const UNUSUAL: f64 = 10.0;

/// Prior odds for an effect at a site where another one is that it goes with: as much as an unusual one is less likely.
const TOGETHER: f64 = 10.0;

/// Evidence of a set, that of effects at unusual sites the lower. One that names something pays for which of all it is: tolerances, which every
/// machine has, are one rival.
pub(super) fn worth(context: &Context<'_>, candidates: &[Candidate], set: &Set) -> f64 {
    let prior = log_prior(context.plant(), candidates, &set.candidates);
    let price = (nameable(candidates) as f64).ln();
    set.fitted.evidence + prior - price * set.names as f64
}

/// Logarithm of the prior odds of some candidates, natural: less by each law that is unusual where it is, which counts once at
/// however many joints, and more by each that goes with another one of them where it is.
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
