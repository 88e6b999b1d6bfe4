//! Prior odds of the effects of a set. Each further name has a price besides: the logarithm of the number of candidates
//! ([`crate::decision`]).

use std::collections::BTreeSet;

use asid_mjcf::Plant;

use crate::candidate::Candidate;

/// Prior odds against an effect at a site where it comes to mind only after others.
const UNUSUAL: f64 = 10.0;

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
