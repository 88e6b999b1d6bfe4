//! Sets of effects, fitted: made larger, smaller, and fitted on.

use std::ops::Range;

use asid_core::{Progress, Result};
use asid_results::naming::grouped;

use crate::candidate::Candidate;
use crate::latent_force::columns::{Columns, Form};
use crate::latent_force::context::Context;
use crate::latent_force::fit::{Extent, Fitted, Hypothesis, Slopes, fit};
use crate::latent_force::fitted_value::Unknown;
use crate::latent_force::screen::Screened;
use crate::settings::Breadth;

/// Deviations of the evidence about its plateaus by which a further effect must rise above the threshold: 95 %.
const WANDER: f64 = 2.0;

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
    /// No effect.
    pub(in crate::latent_force) fn without_effects(fitted: &Fitted) -> Self {
        Self {
            candidates: Vec::new(),
            fitted: fitted.clone(),
            names: 0,
        }
    }

    /// Whether its evidence exceeds another one's by a threshold, and by what both scatter by.
    pub(super) fn rises_above(&self, other: &Self, threshold: f64) -> bool {
        let unsure = WANDER * self.fitted.wander.hypot(other.fitted.wander);
        self.fitted.evidence - other.fitted.evidence > threshold + unsure
    }

    /// Whether evidence does not tell it from another set that is ahead: by no more than what both scatter by, or than what counts as a `rise`.
    pub(super) fn is_level_with(&self, ahead: &Self, rise: f64) -> bool {
        let unsure = WANDER * self.fitted.wander.hypot(ahead.fitted.wander);
        ahead.fitted.evidence - self.fitted.evidence <= unsure.max(rise)
    }

    /// Fits it on from where it stands, to some extent.
    pub(super) fn fit<'p>(
        &mut self,
        context: &Context<'_>,
        extent: impl Into<Extent<'p>>,
    ) -> Result<()> {
        let from = &self.fitted;
        self.fitted = fit(
            context,
            &from.hypothesis,
            &from.theta,
            (&from.estimate, &from.slopes),
            extent,
        )?;
        Ok(())
    }
}

/// Puts the simplest of some sets, the best first, before those that evidence does not tell it from: of a tilt and a constant force on a single
/// ball, which are the same to the ball, that of fewer values. It names no more than they do.
pub(super) fn simplest_first(sets: &mut [Set], rise: f64) {
    let Some(first) = sets.first() else { return };
    let values = |s: &Set| s.fitted.hypothesis.free().len();
    let level = sets.iter().enumerate();
    let level = level.filter(|(_, s)| s.names <= first.names && s.is_level_with(first, rise));
    if let Some((place, _)) = level.min_by_key(|(_, s)| values(s)) {
        sets[..=place].rotate_right(1);
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

/// A set fitted once more from where another one has come to: from its trajectory, its noise, its starts of segments and its values of what both
/// have. A fit finds one of the places where evidence no longer rises, and what another set owes to a better one is no evidence for its
/// effects: a force that a model could make up for, but that its noise has taken for chance; one of the many ways to begin a segment.
pub(super) fn from_fit_of(
    context: &Context<'_>,
    (set, other): (&Set, &Set),
    breadth: Breadth,
    progress: &dyn Progress,
) -> Result<Set> {
    let mut again = set.clone();
    again.fitted.estimate = other.fitted.estimate.clone();
    again.fitted.slopes = set.fitted.slopes.renewed();
    shared_values(&mut again.fitted, &other.fitted);
    again.fit(context, (breadth.rounds[1], progress))?;
    Ok(again)
}

/// Gives the free values of a model those that another one has of them.
pub(super) fn shared_values(fitted: &mut Fitted, other: &Fitted) {
    let theirs = &other.hypothesis.unknowns;
    let own = fitted.hypothesis.unknowns.iter();
    for (u, value) in own.zip(&mut fitted.theta).filter(|(u, _)| u.free) {
        let like = |o: &Unknown| o.parameter.name == u.parameter.name;
        if let Some(at) = theirs.iter().position(like) {
            *value = other.theta[at].clamp(u.bounds[0], u.bounds[1]);
        }
    }
}

/// Deviations from null up to which a value counts as nothing.
pub(super) const IDLE: f64 = 2.0;

/// What a person is told who reads of a set that has no name.
pub(super) const TOLERANCES: &str = "tolerances";

/// Labels of some candidates, and whether tolerances are among them.
#[must_use]
pub fn name_of(candidates: &[Candidate], set: &[usize]) -> String {
    let mut names = grouped(&labels_of(candidates, set));
    if set.iter().any(|&c| candidates[c].is_tolerance) {
        names.push(TOLERANCES.to_owned());
    }
    names.join(" + ")
}

/// Labels of those of some candidates that are named.
#[must_use]
pub fn labels_of(candidates: &[Candidate], set: &[usize]) -> Vec<String> {
    let named = set.iter().map(|&c| &candidates[c]);
    let named = named.filter(|c| !c.is_tolerance);
    named.map(Candidate::label).collect()
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

/// Places of the values of a set's candidate among all values that it is fitted with.
fn values_of(set: &Set, candidates: &[Candidate], which: usize) -> Option<Range<usize>> {
    let place = set.candidates.iter().position(|&c| c == which)?;
    let lengths =
        |c: &[usize]| -> usize { c.iter().map(|&c| candidates[c].parameters().len()).sum() };
    let study = set.fitted.theta.len() - lengths(&set.candidates);
    let first = study + lengths(&set.candidates[..place]);
    Some(first..first + candidates[which].parameters().len())
}

/// A set in which a finer law, that was put beside the simpler one, takes its place and does what that did.
pub(super) fn refined(set: &Set, candidates: &[Candidate], [finer, simpler]: [usize; 2]) -> Set {
    let mut set = set.clone();
    let places = [finer, simpler].map(|c| values_of(&set, candidates, c));
    if let [Some(own), Some(theirs)] = places {
        let named = |c: usize, name: &str| {
            let mut parameters = candidates[c].parameters().iter();
            parameters.position(|p| p.name == name)
        };
        let Fitted {
            theta, hypothesis, ..
        } = &mut set.fitted;
        for (name, of) in candidates[finer].effect.takes_over() {
            if let (Some(to), Some(from)) = (named(finer, name), named(simpler, of)) {
                let (to, from) = (own.start + to, theirs.start + from);
                let [low, high] = hypothesis.unknowns[to].bounds;
                theta[to] = (theta[to] + theta[from]).clamp(low, high);
            }
        }
    }
    without(&set, candidates, simpler)
}

/// A set without one of its candidates, its other values as they are. A law that it then names nowhere is a name less.
pub(super) fn without(set: &Set, candidates: &[Candidate], out: usize) -> Set {
    let mut set = set.clone();
    let place = set.candidates.iter().position(|&c| c == out);
    let (Some(place), Some(range)) = (place, values_of(&set, candidates, out)) else {
        return set;
    };
    let fitted = &mut set.fitted;
    fitted.theta.drain(range.clone());
    fitted.hypothesis.unknowns.drain(range);
    fitted.hypothesis.specs.remove(place);
    fitted.slopes = Slopes::default();
    set.candidates.remove(place);
    let law = |c: usize| (!candidates[c].is_tolerance).then(|| &*candidates[c].spec.name);
    if law(out).is_some() && !set.candidates.iter().any(|&c| law(c) == law(out)) {
        set.names = set.names.saturating_sub(1);
    }
    set
}
