//! What no search tries of an effect, such as an offset of dry friction between the two directions: freed once the effect is named.
//!
//! A friction of `force + offset` one way and of `force - offset` the other is a symmetric one and a constant force. Such a value is therefore
//! tried beside what stands, and in the place of a further name, which it makes needless.

use std::collections::BTreeSet;

use asid_core::{Progress, Result};
use asid_effects::Start;

use crate::candidate::Candidate;
use crate::latent_force::context::Context;
use crate::latent_force::fit::{Hypothesis, Slopes, fit};
use crate::settings::Breadth;

use super::Search;
use super::set::{IDLE, Set, name_of, without};

/// A value that was freed: its place among the values of a model, and what it is where nothing is off.
type Freed = (usize, f64);

/// A set's model with what is given of the effects that it names free, and which values these are; `None` where there are none.
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
            // As uncertain as the effect itself is large.
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

/// A set with what is given of its effects fitted too, all of it at once; `None` where it has nothing of the kind, or where that does not raise its
/// evidence above `least`. What is no larger than its uncertainty goes back to where it was.
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
    /// The set that stands with what is given of its effects free, where that earns what a name must.
    pub(super) fn freed(&self, best: &Set) -> Result<Option<Set>> {
        let least = best.fitted.evidence + self.threshold;
        let how = (self.breadth, self.progress);
        fitted_freely(self.context, self.candidates, (best, least), how)
    }

    /// A set with a value that was given in the place of one of its laws, where its evidence is then less by no more than what a name must earn.
    /// Segments do not ask this, for each fit of theirs costs as much as a round.
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
