//! Prior odds of the effects of a set. Each further name has a price besides: the logarithm of the number of candidates
//! ([`crate::decision`]).

use std::collections::BTreeSet;

use asid_mjcf::Plant;

use crate::candidate::{Candidate, nameable};
use crate::latent_force::context::Context;

use super::set::Set;

/// Prior odds against an effect at a site where it comes to mind only after others.
const UNUSUAL: f64 = 10.0;

/// Evidence of a set, that of effects at unusual sites the lower. One that names something pays for which of all it is: tolerances, which every
/// machine has, are one rival.
pub(super) fn worth(context: &Context<'_>, candidates: &[Candidate], set: &Set) -> f64 {
    let prior = log_prior(context.plant(), candidates, &set.candidates);
    let price = (nameable(candidates) as f64).ln();
    set.fitted.evidence + prior - price * set.names as f64
}

/// Logarithm of the prior odds of some candidates, natural: less by each law that is unusual where it is, which counts once at
/// however many joints.
#[must_use]
pub fn log_prior(plant: &Plant, candidates: &[Candidate], set: &[usize]) -> f64 {
    let each = set.iter().map(|&c| &candidates[c]);
    let named = each.filter(|c| !c.is_tolerance);
    let unusual = named.filter(|c| c.effect.unusual_at(plant, &c.spec.site));
    let laws: BTreeSet<&str> = unusual.map(|c| &*c.spec.name).collect();
    -UNUSUAL.ln() * laws.len() as f64
}
