//! Fitted sets of effects: enlarged, reduced, and refitted.

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

use super::names::Names;

/// Standard deviations of the evidence's scatter that a further effect must exceed in addition to
/// the threshold: 95 %.
const WANDER: f64 = 2.0;

/// Share of a prior's variance by which a posterior must be narrower for the logs to show the value:
/// less is rounding.
const NARROWER: f64 = 1e-6;

/// A fitted set of effects.
#[derive(Clone, Debug)]
pub struct Set {
    /// Candidates, in the order in which they were added.
    pub candidates: Vec<usize>,
    /// The fitted model.
    pub fitted: Fitted,
    /// Its names; a group is one name.
    pub names: Names,
}

impl Set {
    /// The set without effects.
    pub(in crate::latent_force) fn without_effects(fitted: &Fitted) -> Self {
        Self {
            candidates: Vec::new(),
            fitted: fitted.clone(),
            names: Names::default(),
        }
    }

    /// Whether its evidence exceeds that of another set by a threshold plus the scatter of both.
    pub(super) fn rises_above(&self, other: &Self, threshold: f64) -> bool {
        let unsure = WANDER * self.fitted.wander.hypot(other.fitted.wander);
        self.fitted.evidence - other.fitted.evidence > threshold + unsure
    }

    /// Whether the evidence does not separate it from another set that is ahead.
    ///
    /// This holds if the difference is at most the scatter of both, or at most what counts as a
    /// `rise`.
    pub(super) fn is_level_with(&self, ahead: &Self, rise: f64) -> bool {
        let unsure = WANDER * self.fitted.wander.hypot(ahead.fitted.wander);
        ahead.fitted.evidence - self.fitted.evidence <= unsure.max(rise)
    }

    /// Number of its fitted values of which the logs show anything, then of all its fitted values:
    /// of two sets, the simpler one has the lesser.
    ///
    /// Values that the logs do not show are as uncertain as their priors. Some take no part at all,
    /// such as an axis of an effect that its sensor does not have, so they count last.
    pub(super) fn values(&self) -> [usize; 2] {
        let fitted = &self.fitted;
        let free = fitted.hypothesis.free();
        if fitted.covariance.nrows() != free.len() {
            return [free.len(); 2];
        }
        let is_shown = |k: &usize| {
            let prior = fitted.hypothesis.unknowns[free[*k]].deviation.powi(2);
            fitted.covariance[(*k, *k)] < (1.0 - NARROWER) * prior
        };
        [(0..free.len()).filter(is_shown).count(), free.len()]
    }

    /// Continues its fit from its present state, to the given extent.
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

/// Moves the simplest of the sets that the evidence does not separate from the first one to the
/// front.
///
/// The sets come in descending order of worth. The simplest set has the fewest values that the logs
/// show, no more names than the first, and is at least as likely by `prior`, the logarithm of its
/// prior odds. For example, a tilt and a constant force are equivalent for a single ball, and the
/// one with fewer values comes first.
pub(super) fn simplest_first(sets: &mut [Set], rise: f64, prior: &dyn Fn(&Set) -> f64) {
    let Some(first) = sets.first() else { return };
    let (most, least) = (first.names.count(), prior(first));
    let is_level =
        |s: &Set| s.names.count() <= most && s.is_level_with(first, rise) && prior(s) >= least;
    let level = sets.iter().enumerate().filter(|(_, s)| is_level(s));
    if let Some((place, _)) = level.min_by_key(|(_, s)| s.values()) {
        sets[..=place].rotate_right(1);
    }
}

/// The model with further candidates, and the values to begin with.
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

/// Refits a set from the result of another one: from its trajectory, its noise, its initial states
/// of segments and its values of what both have.
///
/// A fit finds one of several local maxima of the evidence. If another set owes its evidence to a
/// better maximum, that is no evidence for its effects. For example, the noise may have absorbed a
/// force that the model could explain. A segment may also begin in one of many ways.
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

/// Copies to the free values of a model those that another model has of them.
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

/// Posterior deviations from the null up to which a value counts as insignificant.
pub(super) const IDLE: f64 = 2.0;

/// Name that users see for tolerances, which name no effect.
pub(super) const TOLERANCES: &str = "tolerances";

/// Labels of some candidates, followed by that of tolerances if these are among them.
#[must_use]
pub fn name_of(candidates: &[Candidate], set: &[usize]) -> String {
    let mut names = grouped(&labels_of(candidates, set));
    if set.iter().any(|&c| candidates[c].is_tolerance) {
        names.push(TOLERANCES.to_owned());
    }
    names.join(" + ")
}

/// Labels of the named ones of some candidates.
#[must_use]
pub fn labels_of(candidates: &[Candidate], set: &[usize]) -> Vec<String> {
    let named = set.iter().map(|&c| &candidates[c]);
    let named = named.filter(|c| !c.is_tolerance);
    named.map(Candidate::label).collect()
}

/// The candidate that another one refines: the simpler law at the same site.
#[must_use]
pub fn refined_by(candidates: &[Candidate], finer: usize) -> Option<usize> {
    let fine = &candidates[finer];
    let simpler = fine.effect.refines();
    candidates
        .iter()
        .position(|c| c.spec.site == fine.spec.site && simpler.contains(&&*c.spec.name))
}

/// Whether a candidate may be tried: a refinement only once the simpler law is named.
pub(super) fn is_due(candidates: &[Candidate], set: &Set, candidate: usize) -> bool {
    refined_by(candidates, candidate).is_none_or(|simpler| set.candidates.contains(&simpler))
}

/// Positions of the values of a set's candidate among all values of its model.
fn values_of(set: &Set, candidates: &[Candidate], which: usize) -> Option<Range<usize>> {
    let place = set.candidates.iter().position(|&c| c == which)?;
    let lengths =
        |c: &[usize]| -> usize { c.iter().map(|&c| candidates[c].parameters().len()).sum() };
    let study = set.fitted.theta.len() - lengths(&set.candidates);
    let first = study + lengths(&set.candidates[..place]);
    Some(first..first + candidates[which].parameters().len())
}

/// Replaces the simpler law of a set by a finer law that was added beside it, and which takes over
/// its values with their priors.
///
/// What the simpler law leaves gives the widths of the finer law's priors. For a value that was the
/// simpler law's, such a prior would be narrower than the value is large.
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
                let simple = &hypothesis.unknowns[from];
                let prior = (simple.center, simple.deviation);
                let fine = &mut hypothesis.unknowns[to];
                (fine.center, fine.deviation) = prior;
                let [low, high] = fine.bounds;
                theta[to] = (theta[to] + theta[from]).clamp(low, high);
            }
        }
    }
    without(&set, candidates, simpler)
}

/// Removes a candidate from a set; its other values stay as they are.
///
/// A name that has no other candidate is gone with it.
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
    set.names = set.names.among(&set.candidates);
    set
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::latent_force::search::by_hand;

    /// Symptom: a friction at one joint counted as two names, and its probability fell from 0.92 to
    /// 0.68. Cause: it had been named at another joint before, where it was taken out again, and a
    /// name was dropped only with the last site of its law.
    #[test]
    fn a_law_named_at_one_site_after_the_other_is_as_many_names_as_sites() {
        let sites = ["a", "b"].map(|joint| format!("coulomb-friction@{joint}"));
        let candidates = sites.map(|label| by_hand::candidate(&label));
        let count = |set: &Set, out: &[usize]| {
            let all = out.iter();
            let left = all.fold(set.clone(), |set, &c| without(&set, &candidates, c));
            (left.names.count(), left.fitted.theta.len())
        };
        let one_by_one = by_hand::set(&candidates, (&[&[0], &[1]], &[]), 9.0);
        let values = candidates[0].parameters().len();
        assert_eq!(count(&one_by_one, &[0]), (1, values));
        assert_eq!(count(&one_by_one, &[0, 1]), (0, 0));
        let group = by_hand::set(&candidates, (&[&[0, 1]], &[]), 9.0);
        assert_eq!(count(&group, &[0]), (1, values));
        assert_eq!(count(&group, &[0, 1]), (0, 0));
    }

    /// Symptom: a Stribeck friction lost some twenty nats to the dry friction that it refines.
    /// Cause: its sliding friction of 2 N, taken over from the dry friction, had a prior as narrow
    /// as the force that was still missing beside the dry friction.
    #[test]
    fn a_value_that_is_taken_over_keeps_its_prior() {
        let labels = ["coulomb-friction@slide", "stribeck-friction@slide"];
        let candidates = labels.map(by_hand::candidate);
        let mut both = by_hand::set(&candidates, (&[&[0], &[1]], &[]), 9.0);
        let place = |set: &Set, name: &str| {
            let unknowns = &set.fitted.hypothesis.unknowns;
            let place = unknowns.iter().position(|u| u.parameter.name == name);
            place.expect("the set has it")
        };
        let dry = place(&both, "coulomb-friction@slide.force");
        let sliding = place(&both, "stribeck-friction@slide.coulomb");
        let fitted = &mut both.fitted;
        (fitted.theta[dry], fitted.theta[sliding]) = (2.0, -0.1);
        fitted.hypothesis.unknowns[dry].deviation = 2.5;
        fitted.hypothesis.unknowns[sliding].deviation = 0.3;
        let fine = refined(&both, &candidates, [1, 0]);
        let sliding = place(&fine, "stribeck-friction@slide.coulomb");
        let unknown = &fine.fitted.hypothesis.unknowns[sliding];
        assert_eq!(fine.fitted.theta[sliding], 1.9);
        assert!((unknown.distance(1.9) - 1.9 / 2.5).abs() < 1e-12);
        assert_eq!(fine.candidates, [1]);
    }

    /// Symptom: of a tilt and a wrong zero of an encoder, which logs did not separate, the tilt
    /// came first as the simpler one. Cause: the zero's three entries for vectors counted as values,
    /// although an encoder has none of them.
    #[test]
    fn the_simplest_set_has_the_fewest_values_that_logs_show() {
        let labels = ["joint-stiffness@a", "sensor-bias@q"];
        let candidates = labels.map(by_hand::candidate);
        // The logs show all values of the first, and one of the second.
        let mut spring = by_hand::set(&candidates, (&[&[0]], &[]), 90.2);
        spring.fitted.covariance *= 0.01;
        let mut zero = by_hand::set(&candidates, (&[&[1]], &[]), 90.0);
        zero.fitted.covariance[(0, 0)] = 0.01;
        let values = zero.fitted.hypothesis.free().len();
        assert!(values > spring.values()[0] && zero.values() == [1, values]);
        let first = |prior: &dyn Fn(&Set) -> f64| {
            let mut sets = vec![spring.clone(), zero.clone()];
            simplest_first(&mut sets, 0.5, prior);
            sets[0].candidates[0]
        };
        assert_eq!(first(&|_| 0.0), 1);
        // A simpler set that is less likely a priori stays behind.
        assert_eq!(first(&|s| if s.candidates == [1] { -2.3 } else { 0.0 }), 0);
    }
}
