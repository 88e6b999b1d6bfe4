//! Sets of effects, fitted: made larger, smaller, and fitted on.

use asid_core::{Progress, Result};
use asid_effects::Start;

use crate::candidate::Candidate;
use crate::latent_force::columns::{Columns, Form};
use crate::latent_force::context::Context;
use crate::latent_force::fit::{Fitted, Hypothesis, Slopes, fit};
use crate::latent_force::screen::Screened;

use super::breadth::Breadth;

/// A set of effects, fitted.
#[derive(Clone, Debug)]
pub struct Set {
    /// Candidates, in the order in which they were added.
    pub candidates: Vec<usize>,
    /// The model.
    pub fitted: Fitted,
    /// How many named things it is: a group counts once.
    pub names: usize,
}

impl Set {
    /// Fits it on from where it stands, over at most `rounds` linearisations.
    pub(super) fn fit(
        &mut self,
        context: &Context<'_>,
        rounds: usize,
        progress: &dyn Progress,
    ) -> Result<()> {
        let from = &self.fitted;
        self.fitted = fit(
            context,
            &from.hypothesis,
            &from.theta,
            (&from.estimate, &from.slopes),
            (rounds, progress),
        )?;
        Ok(())
    }
}

/// The model with some more candidates, and values to begin with.
pub(super) fn with(
    base: &Fitted,
    columns: &Columns,
    candidates: &[Candidate],
    screened: &Screened,
) -> (Hypothesis, Vec<f64>, Vec<usize>) {
    let mut hypothesis = base.hypothesis.clone();
    let mut theta = base.theta.clone();
    for (&i, c) in base.hypothesis.free().iter().zip(&screened.base) {
        let u = &base.hypothesis.unknowns[i];
        theta[i] = (theta[i] + c * u.deviation).clamp(u.bounds[0], u.bounds[1]);
    }
    let mut added = Vec::new();
    for (&f, coefficients) in screened.forms.iter().zip(&screened.coefficients) {
        let form: &Form = &columns.forms[f];
        let candidate = &candidates[form.candidate];
        hypothesis.specs.push(candidate.spec.clone());
        hypothesis.unknowns.extend(form.unknowns(candidate));
        theta.extend(form.values(candidate, coefficients));
        added.push(form.candidate);
    }
    (hypothesis, theta, added)
}

/// A set fitted once more from where another one has put the starts of segments: of the many ways to begin that leave little of
/// the readings a fit finds one, and what another one owes to a better one is no evidence for its effects.
pub(super) fn from_starts_of(
    context: &Context<'_>,
    (set, other): (&Set, &Set),
    breadth: Breadth,
    progress: &dyn Progress,
) -> Result<Set> {
    let mut again = set.clone();
    again.fitted.estimate = other.fitted.estimate.clone();
    again.fitted.slopes = Slopes::default();
    again.fit(context, breadth.rounds[1], progress)?;
    Ok(again)
}

/// Fits what no search tries (an offset of friction between the directions) of the effects that were named, where it
/// earns its place.
pub(super) fn free_what_is_given(
    context: &Context<'_>,
    candidates: &[Candidate],
    best: Set,
    (breadth, threshold): (Breadth, f64),
    progress: &dyn Progress,
) -> Result<Set> {
    let mut best = best;
    let mut at = best.fitted.hypothesis.unknowns.len();
    for &c in best.candidates.clone().iter().rev() {
        let parameters = candidates[c].parameters();
        at -= parameters.len();
        for (i, p) in parameters.iter().enumerate() {
            if p.start != Start::Given {
                continue;
            }
            let mut hypothesis = best.fitted.hypothesis.clone();
            let unknown = &mut hypothesis.unknowns[at + i];
            unknown.free = true;
            // As uncertain as the effect itself is large.
            let own = &best.fitted.theta[at..at + parameters.len()];
            let sizes = own.iter().zip(parameters);
            let size = sizes
                .filter(|(_, q)| q.unit == p.unit)
                .map(|(x, q)| (x - q.null).abs())
                .fold(0.0, f64::max);
            if size > 0.0 {
                unknown.deviation = unknown.deviation.min(size);
            }
            let (theta, from) = (&best.fitted.theta, &best.fitted);
            let from = (&from.estimate, &from.slopes);
            let rounds = (breadth.rounds[1], progress);
            let fitted = fit(context, &hypothesis, theta, from, rounds)?;
            if fitted.evidence - best.fitted.evidence > threshold {
                best.fitted = fitted;
            }
        }
    }
    Ok(best)
}

/// Labels of some candidates.
#[must_use]
pub fn name_of(candidates: &[Candidate], set: &[usize]) -> String {
    let labels: Vec<String> = set.iter().map(|&c| candidates[c].label()).collect();
    labels.join(" + ")
}

/// The candidate that another one refines: the simpler law at the same site.
pub(super) fn refined_by(candidates: &[Candidate], finer: usize) -> Option<usize> {
    let fine = &candidates[finer];
    let simpler = fine.effect.refines();
    candidates
        .iter()
        .position(|c| c.spec.site == fine.spec.site && simpler.contains(&&*c.spec.name))
}

/// Whether a candidate's turn has come: a refinement's once the simpler law is named.
pub(super) fn is_due(candidates: &[Candidate], set: &Set, candidate: usize) -> bool {
    refined_by(candidates, candidate).is_none_or(|simpler| set.candidates.contains(&simpler))
}

/// A set without one of its candidates, its other values as they are.
pub(super) fn without(set: &Set, candidates: &[Candidate], out: usize) -> Set {
    let mut set = set.clone();
    let Some(place) = set.candidates.iter().position(|&c| c == out) else {
        return set;
    };
    let lengths =
        |c: &[usize]| -> usize { c.iter().map(|&c| candidates[c].parameters().len()).sum() };
    let fitted = &mut set.fitted;
    let study = fitted.theta.len() - lengths(&set.candidates);
    let first = study + lengths(&set.candidates[..place]);
    let range = first..first + candidates[out].parameters().len();
    fitted.theta.drain(range.clone());
    fitted.hypothesis.unknowns.drain(range);
    fitted.hypothesis.specs.remove(place);
    fitted.slopes = Slopes::default();
    set.candidates.remove(place);
    set
}

/// Deviations from null up to which a value counts as nothing, and the evidence that a set may lose when it is left out.
const IDLE: f64 = 2.0;
const IDLE_LOSS: f64 = 1.0;

/// A set without the members that do nothing in it: those of a group that are as the model has them, and those that a later
/// effect has taken the place of.
pub(super) fn pruned(
    context: &Context<'_>,
    candidates: &[Candidate],
    set: Set,
    breadth: Breadth,
    progress: &dyn Progress,
) -> Result<Set> {
    let fitted = &set.fitted;
    let free = fitted.hypothesis.free();
    let parameters = |c: usize| candidates[c].parameters().len();
    let mut at = fitted.theta.len() - set.candidates.iter().map(|&c| parameters(c)).sum::<usize>();
    let mut idle = Vec::new();
    for &c in &set.candidates {
        let range = at..at + parameters(c);
        at = range.end;
        let strength = |i: usize| {
            let p = &candidates[c].parameters()[i - range.start];
            let k = free.iter().position(|&f| f == i)?;
            let deviation = fitted.covariance[(k, k)].max(0.0).sqrt();
            (p.start == Start::Slope).then(|| (fitted.theta[i] - p.null).abs() / deviation)
        };
        let strengths: Vec<f64> = range.clone().filter_map(strength).collect();
        if !strengths.is_empty() && strengths.iter().all(|s| *s < IDLE) {
            idle.push(c);
        }
    }
    if idle.is_empty() || idle.len() == set.candidates.len() {
        return Ok(set);
    }
    let mut smaller = set.clone();
    for c in idle {
        smaller = without(&smaller, candidates, c);
    }
    smaller.fit(context, breadth.rounds[1], progress)?;
    let kept = smaller.fitted.evidence > set.fitted.evidence - IDLE_LOSS;
    Ok(if kept { smaller } else { set })
}
