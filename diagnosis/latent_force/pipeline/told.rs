//! What is reported of a search besides its replays: missing forces, the ranking, detection limits,
//! and what the logs cannot separate.

use std::f64::consts::FRAC_PI_2;

use asid_core::Layout;

use crate::candidate::Candidate;
use crate::latent_force::detection::Limit;
use crate::latent_force::estimate::Estimate;
use crate::latent_force::picture::dofs;
use crate::latent_force::search::{Outcome, Set, Sight, labels_of};
use crate::result::{DetectionLimit, Isolability, MissingForce, RankedSet};

/// Most sets that are listed with their evidence.
const RANKED: usize = 20;
/// Steps per rad to which angles between effects are rounded: the picture shows degrees.
const ANGLES: f64 = 1e4;

/// Missing force at each degree of freedom, without effects and with the set that stands; empty if
/// all rows are in segments.
pub(super) fn missing_forces(layout: &Layout, outcome: &Outcome) -> Vec<MissingForce> {
    if outcome.missing[0].share >= 1.0 {
        return Vec::new();
    }
    let (before, after) = (&outcome.none.estimate, &outcome.best.fitted.estimate);
    let deviation = |e: &Estimate, d: usize| (e.noise.q[d] + e.noise.white[d]).sqrt();
    let dofs = dofs(layout);
    dofs.iter()
        .enumerate()
        .map(|(d, dof)| MissingForce {
            dof: dof.name.clone(),
            unit: dof.unit().to_owned(),
            identified: deviation(before, d),
            refined: deviation(after, d),
            correlation_time: before.noise.tau[d],
        })
        .collect()
}

/// Sets in order of rank, with their evidence over the model without effects: the fitted sets
/// first, then those of the first screening.
pub(super) fn ranking(
    candidates: &[Candidate],
    outcome: &Outcome,
    fitted: &[Set],
) -> Vec<RankedSet> {
    let none = outcome.none.evidence;
    let labels = |set: &[usize]| -> Vec<String> {
        let mut set = set.to_vec();
        set.sort_unstable();
        labels_of(candidates, &set)
    };
    let of_fit = |set: &Set| RankedSet {
        effects: labels(&set.candidates),
        screened: None,
        fitted: Some(set.fitted.evidence - none),
    };
    let mut all: Vec<RankedSet> = fitted.iter().map(of_fit).collect();
    // A set without a name is no effect.
    all.retain(|r| !r.effects.is_empty());
    for seen in outcome.rounds.iter().take(1).flat_map(|r| &r.screened) {
        let (effects, gain) = (labels(&seen.set), seen.gain);
        match all.iter_mut().find(|r| r.effects == effects) {
            Some(known) => known.screened = Some(gain),
            None => all.push(RankedSet {
                effects,
                screened: Some(gain),
                fitted: None,
            }),
        }
    }
    all.truncate(RANKED);
    all
}

/// Detection limits of the last screening: the smallest effects that the logs could have shown
/// besides the set that stands.
pub(super) fn detection_limits(candidates: &[Candidate], outcome: &Outcome) -> Vec<DetectionLimit> {
    let Some(Sight { limits, rehearsal }) = outcome.rounds.last().map(|r| &r.sight) else {
        return Vec::new();
    };
    let told = |(l, recognised): (&Limit, &Option<(f64, Option<usize>)>)| {
        let candidate = &candidates[l.candidate];
        let parameter = &candidate.parameters()[l.parameter];
        DetectionLimit {
            effect: candidate.label(),
            parameter: parameter.name.to_owned(),
            unit: parameter.unit.to_owned(),
            value: l.value,
            recognised: recognised.map(|r| r.0),
            taken_for: recognised.and_then(|r| r.1).map(|c| candidates[c].label()),
        }
    };
    limits.iter().zip(&rehearsal.recognised).map(told).collect()
}

/// Probability of as much evidence for the best candidate if nothing is missing; `None` if it is
/// not known.
pub(super) fn p_value(outcome: &Outcome) -> Option<f64> {
    let first = outcome.rounds.first().map(|r| r.sight.rehearsal.p_value);
    first.filter(|p| p.is_finite())
}

/// Principal angles between the leading candidates of the first screening.
pub(super) fn isolability(candidates: &[Candidate], outcome: &Outcome) -> Option<Isolability> {
    let (leading, cosines) = &outcome.rounds.first()?.alike;
    let n = leading.len();
    if n == 0 {
        return None;
    }
    let angle = |i: usize, j: usize| {
        let angle = cosines[(i, j)].min(1.0).acos();
        ((angle * ANGLES).round() / ANGLES).min(FRAC_PI_2)
    };
    let row = |i: usize| (0..n).map(|j| angle(i, j)).collect();
    Some(Isolability {
        effects: leading.iter().map(|&c| candidates[c].label()).collect(),
        angles: (0..n).map(row).collect(),
    })
}
