//! Frees parameters of an effect that no search tries, once the effect is named.
//!
//! An example is the offset of dry friction between the two directions. A friction of
//! `force + offset` one way and of `force - offset` the other is a symmetric friction and a
//! constant force. So such a value is tried beside the set that stands. It is also tried in place
//! of a further name, which it makes unnecessary.

use std::collections::BTreeSet;

use asid_core::{Progress, Result};
use asid_effects::Start;

use crate::candidate::Candidate;
use crate::latent_force::context::Context;
use crate::latent_force::fit::{Hypothesis, Slopes, fit};
use crate::settings::Breadth;

use super::Search;
use super::set::{IDLE, Set, name_of, without};

/// A freed value: its position among the values of a model, and its null.
type Freed = (usize, f64);

/// A set's model with the given values of its named effects freed, and these values; `None` if
/// there are none.
fn opened(candidates: &[Candidate], set: &Set) -> Option<(Hypothesis, Vec<Freed>)> {
    let fitted = &set.fitted;
    let mut hypothesis = fitted.hypothesis.clone();
    let mut freed = Vec::new();
    let mut at = fitted.theta.len();
    for &c in set.candidates.iter().rev() {
        let parameters = candidates[c].parameters();
        at -= parameters.len();
        if candidates[c].is_tolerance {
            continue;
        }
        let own = &fitted.theta[at..at + parameters.len()];
        for (i, p) in parameters.iter().enumerate() {
            let unknown = &mut hypothesis.unknowns[at + i];
            if p.start != Start::Given || unknown.free {
                continue;
            }
            unknown.free = true;
            freed.push((at + i, p.null));
            // The value is as uncertain as the effect is large.
            let sizes = own.iter().zip(parameters);
            let size = sizes
                .filter(|(_, q)| q.unit == p.unit)
                .map(|(x, q)| (x - q.null).abs())
                .fold(0.0, f64::max);
            if size > 0.0 {
                unknown.deviation = unknown.deviation.min(size);
            }
        }
    }
    (!freed.is_empty()).then_some((hypothesis, freed))
}

/// A set with all given values of its effects fitted too.
///
/// `None` if it has no such values, or if its evidence then does not exceed `least`. A value that
/// is less than two deviations from its null goes back to it.
fn fitted_freely(
    context: &Context<'_>,
    candidates: &[Candidate],
    (set, least): (&Set, f64),
    (breadth, progress): (Breadth, &dyn Progress),
) -> Result<Option<Set>> {
    let Some((mut hypothesis, freed)) = opened(candidates, set) else {
        return Ok(None);
    };
    let rounds = (breadth.rounds[1], progress);
    let from = (&set.fitted.estimate, &set.fitted.slopes);
    let all = fit(context, &hypothesis, &set.fitted.theta, from, rounds)?;
    if all.evidence <= least {
        return Ok(None);
    }
    let free = hypothesis.free();
    let (mut theta, mut idle) = (all.theta.clone(), false);
    for (i, null) in freed {
        let place = free.iter().position(|&f| f == i);
        let variance = place.map_or(0.0, |k| all.covariance[(k, k)]);
        if (theta[i] - null).abs() < IDLE * variance.max(0.0).sqrt() {
            hypothesis.unknowns[i].free = false;
            theta[i] = null;
            idle = true;
        }
    }
    let fitted = if idle {
        let from = (&all.estimate, &all.slopes);
        fit(context, &hypothesis, &theta, from, rounds)?
    } else {
        all
    };
    Ok(Some(Set {
        fitted,
        ..set.clone()
    }))
}

impl Search<'_> {
    /// The set that stands with the given values of its effects free, if that earns what a name
    /// must.
    pub(super) fn freed(&self, best: &Set) -> Result<Option<Set>> {
        let least = best.fitted.evidence + self.threshold;
        let how = (self.breadth, self.progress);
        fitted_freely(self.context, self.candidates, (best, least), how)
    }

    /// A set with a given value freed in place of one of its laws, if that costs no more evidence
    /// than a name must earn.
    ///
    /// Segments do not use this rule, because each of their fits costs as much as a round.
    pub(super) fn freed_instead(&self, set: &Set) -> Result<Option<Set>> {
        let law = |c: usize| &*self.candidates[c].spec.name;
        let is_named = |c: &usize| !self.candidates[*c].is_tolerance;
        let named: Vec<usize> = set.candidates.iter().copied().filter(is_named).collect();
        let laws: BTreeSet<&str> = named.iter().map(|&c| law(c)).collect();
        if laws.len() < 2 || self.context.has_segments() {
            return Ok(None);
        }
        let least = set.fitted.evidence - self.threshold;
        let mut best: Option<Set> = None;
        for out in laws {
            if self.progress.is_stopped() {
                break;
            }
            let out = named.iter().copied().filter(|&c| law(c) == out);
            let mut fewer = out.fold(set.clone(), |set, c| without(&set, self.candidates, c));
            fewer.fitted.slopes = Slopes::default();
            if opened(self.candidates, &fewer).is_none() {
                continue;
            }
            let name = name_of(self.candidates, &fewer.candidates);
            self.progress
                .note(&format!("fitting all values of {name} alone"));
            let how = (self.breadth, self.progress);
            let found = fitted_freely(self.context, self.candidates, (&fewer, least), how)?;
            let reached = best.as_ref().map_or(least, |b| b.fitted.evidence);
            best = found.filter(|f| f.fitted.evidence > reached).or(best);
        }
        Ok(best)
    }
}
