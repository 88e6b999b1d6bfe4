//! Changes of the names by tolerances: a value that exceeds its tolerance is named, and a name that
//! adds nothing to tolerances is removed.

use asid_core::{Progress, Result};

use crate::candidate::{Candidate, threshold};
use crate::latent_force::context::Context;
use crate::latent_force::estimate::Missing;
use crate::latent_force::search::prune::TANGENT;
use crate::latent_force::search::savage_dickey::change_without;
use crate::latent_force::search::set::{Set, without};
use crate::settings::Breadth;

use super::{DEVIATIONS, Member, Tolerances, deviation_within};

/// Fraction of a tolerance from which on a value counts as being at its end.
const AT_END: f64 = 0.95;

impl Tolerances {
    /// A set with tolerances added, if they pass the threshold and make up for the share of what
    /// was missing `at_first` that a name must.
    pub(in crate::latent_force::search) fn earned(
        &self,
        context: &Context<'_>,
        candidates: &[Candidate],
        (set, at_first): (&Set, Missing),
        (breadth, progress): (Breadth, &dyn Progress),
    ) -> Result<Option<Set>> {
        progress.note("fitting tolerances");
        let mut with = self.beside(set, candidates);
        with.fit(context, (breadth.rounds[1], progress))?;
        let threshold = threshold(candidates, context.has_segments(), breadth.false_alarms);
        let left = |s: &Set| s.fitted.estimate.missing(context).relative_to(at_first);
        let stands = with.rises_above(set, threshold) && left(set) - left(&with) > breadth.shrinks;
        Ok(stands.then_some(with))
    }

    /// Settles the names of a fitted set with tolerances.
    ///
    /// Values that exceed their tolerance are named, and names that add nothing are removed.
    pub(in crate::latent_force::search) fn settled(
        &self,
        context: &Context<'_>,
        candidates: &[Candidate],
        (set, at_first): (Set, Missing),
        how: (Breadth, &dyn Progress),
    ) -> Result<Set> {
        let set = self.outgrown(context, candidates, (set, at_first), how)?;
        needed(context, candidates, set, how)
    }

    /// Releases the values of a fitted set that are at the end of their tolerance, and names each
    /// such effect. A value that its effect cannot take further stays within its tolerance.
    ///
    /// Returns the set as it is if there is no such value, or if the release does not pass the
    /// threshold. The same holds if it does not make up for the share of what was missing
    /// `at_first` that a name must.
    fn outgrown(
        &self,
        context: &Context<'_>,
        candidates: &[Candidate],
        (set, at_first): (Set, Missing),
        (breadth, progress): (Breadth, &dyn Progress),
    ) -> Result<Set> {
        let mut larger = set.clone();
        let (mut laws, mut names): (Vec<&str>, Vec<Vec<usize>>) = (Vec::new(), Vec::new());
        for member in &self.members {
            let candidate = &candidates[member.candidate];
            let Some(values) = values_of(candidates, &set, member.candidate) else {
                continue;
            };
            let (named, unknowns) = &member.named;
            let ends = values
                .iter()
                .zip(&member.deviations)
                .zip(candidate.parameters());
            let at_end = ends.zip(candidate.ranges.iter().zip(unknowns)).any(
                |(((x, deviation), p), (range, u))| {
                    is_at_open_end((*x, p.null), *deviation, (*range, u.bounds))
                },
            );
            if !at_end {
                continue;
            }
            larger = without(&larger, candidates, member.candidate);
            let fitted = &mut larger.fitted;
            fitted
                .hypothesis
                .specs
                .push(candidates[*named].spec.clone());
            fitted.hypothesis.unknowns.extend(unknowns.iter().cloned());
            fitted.theta.extend(values);
            larger.candidates.push(*named);
            let law = &*candidate.spec.name;
            match laws.iter().position(|l| *l == law) {
                Some(at) => names[at].push(*named),
                None => {
                    laws.push(law);
                    names.push(vec![*named]);
                }
            }
        }
        if laws.is_empty() {
            return Ok(set);
        }
        names.into_iter().for_each(|name| larger.names.add(name));
        progress.note(&format!(
            "trying more than tolerances of {}",
            laws.join(", ")
        ));
        larger.fit(context, (breadth.rounds[1], progress))?;
        let threshold = threshold(candidates, context.has_segments(), breadth.false_alarms);
        let least = set.fitted.evidence + threshold * laws.len() as f64;
        let left = |s: &Set| s.fitted.estimate.missing(context).relative_to(at_first);
        let shrinks = left(&set) - left(&larger) > breadth.shrinks;
        Ok(if larger.fitted.evidence > least && shrinks {
            larger
        } else {
            set
        })
    }
}

/// Whether a value is at an end of its tolerance beyond which its effect can be named.
///
/// `range` is that of the tolerance, `named` that of the effect. A friction, for example, cannot be
/// named for being less than the model's.
fn is_at_open_end(
    (value, null): (f64, f64),
    deviation: f64,
    (range, named): ([f64; 2], [f64; 2]),
) -> bool {
    let end = AT_END * DEVIATIONS * deviation;
    let is_open = if value < null {
        named[0] < range[0]
    } else {
        named[1] > range[1]
    };
    deviation > 0.0 && range[0] < range[1] && (value - null).abs() >= end && is_open
}

/// Values of a candidate of a set; `None` if it is not a member.
fn values_of(candidates: &[Candidate], set: &Set, candidate: usize) -> Option<Vec<f64>> {
    let mut at = set.fitted.theta.len();
    for &c in set.candidates.iter().rev() {
        let n = candidates[c].parameters().len();
        at -= n;
        if c == candidate {
            return Some(set.fitted.theta[at..at + n].to_vec());
        }
    }
    None
}

/// Removes the names of a set with tolerances that add nothing to these.
///
/// Each law in turn is removed, or put back within its tolerance if an ordinary machine has some of
/// it. It stays out unless it earns the threshold.
fn needed(
    context: &Context<'_>,
    candidates: &[Candidate],
    set: Set,
    (breadth, progress): (Breadth, &dyn Progress),
) -> Result<Set> {
    let least = threshold(candidates, context.has_segments(), breadth.false_alarms);
    let mut set = set;
    let mut laws: Vec<String> = Vec::new();
    for &c in &set.candidates {
        let candidate = &candidates[c];
        if !candidate.is_tolerance && !laws.contains(&candidate.spec.name) {
            laws.push(candidate.spec.name.clone());
        }
    }
    for law in laws {
        let of_law = |&&c: &&usize| !candidates[c].is_tolerance && candidates[c].spec.name == law;
        let own: Vec<usize> = set.candidates.iter().filter(of_law).copied().collect();
        let change = change_without(candidates, &set, &own);
        if progress.is_stopped() || change.is_none_or(|c| c < -TANGENT * least) {
            continue;
        }
        let mut smaller = set.clone();
        for &c in &own {
            smaller = without(&smaller, candidates, c);
        }
        for &c in &own {
            let like = |t: &Candidate| t.is_tolerance && t.label() == candidates[c].label();
            let Some(t) = candidates.iter().position(like) else {
                continue;
            };
            let candidate = &candidates[t];
            let parameters = candidate.parameters().iter().zip(&candidate.ranges);
            let begin: Vec<f64> = parameters
                .clone()
                .map(|(p, r)| p.null.clamp(r[0], r[1]))
                .collect();
            let member = Member {
                candidate: t,
                values: begin.clone(),
                begin,
                deviations: parameters
                    .map(|(p, r)| deviation_within(*r, p.null))
                    .collect(),
                named: (c, Vec::new()),
            };
            member.join(&mut smaller, candidate, &member.begin);
        }
        progress.note(&format!("trying without {law}"));
        smaller.fit(context, (breadth.rounds[1], progress))?;
        if smaller.fitted.evidence > set.fitted.evidence - least {
            set = smaller;
        }
    }
    Ok(set)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: a mass far beyond its tolerance was not named, and the verdict was that no effect
    /// stands out. Cause: all values at an end were released together, and one of them was a
    /// viscous friction at the lower end, which is named only from zero on: clamped to zero, it
    /// lost what it made up for.
    #[test]
    fn a_friction_below_that_of_the_model_stays_within_its_tolerance() {
        // Three deviations of 0.05 N s/m on either side.
        let of = |x: f64| is_at_open_end((x, 0.0), 0.05, ([-0.15, 0.15], [0.0, 1e6]));
        assert_eq!(
            [-0.15, -0.1, 0.1, 0.15].map(of),
            [false, false, false, true]
        );
        // A mass can be named for being less, too.
        let of = |x: f64| is_at_open_end((x, 1.0), 0.03, ([0.91, 1.09], [0.2, 5.0]));
        assert_eq!([0.91, 1.0, 1.09].map(of), [true, false, true]);
        // A value with one possible value only.
        assert!(!is_at_open_end((0.2, 0.0), 0.0, ([0.2; 2], [0.0, 1.0])));
    }
}
