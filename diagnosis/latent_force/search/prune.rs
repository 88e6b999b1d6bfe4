//! Removal of the members of a set that have no effect in it.

use asid_core::{Progress, Result};
use asid_effects::Start;

use crate::candidate::Candidate;
use crate::latent_force::context::Context;
use crate::latent_force::estimate::Missing;
use crate::settings::Breadth;

use super::savage_dickey::{change_without, conditional, is_size, leaving, without_values};
use super::set::{IDLE, Set, without};

/// Evidence, in nats, that a set may lose when insignificant members are removed.
const IDLE_LOSS: f64 = 1.0;
/// Size, relative to the largest of the same law, below which a member of a group may stand in for
/// something else.
///
/// A law that joints share is not much smaller at one of them, unless that member makes up for its
/// share of what is missing.
const SLIGHT: f64 = 1.0 / 3.0;
/// Largest predicted loss, in thresholds, at which a set is refitted without a name: first-order
/// predictions are right to a factor of about three.
pub(super) const TANGENT: f64 = 3.0;
/// Number of members found to be needed at which all others count as needed too: each takes a whole
/// fit.
const NEEDED: usize = 2;

/// What a member of a set contributes: its distance from its null, in posterior deviations and in
/// its own unit.
struct Deed {
    candidate: usize,
    law: String,
    strength: f64,
    size: f64,
}

/// What each member of a set contributes; members without a size are left out.
fn deeds(candidates: &[Candidate], set: &Set) -> Vec<Deed> {
    let fitted = &set.fitted;
    let free = fitted.hypothesis.free();
    let parameters = |c: usize| candidates[c].parameters().len();
    let mut at = fitted.theta.len() - set.candidates.iter().map(|&c| parameters(c)).sum::<usize>();
    let mut all = Vec::new();
    for &c in &set.candidates {
        let range = at..at + parameters(c);
        at = range.end;
        if candidates[c].is_tolerance {
            continue;
        }
        let all_of = candidates[c].parameters();
        let has_slopes = all_of.iter().any(|p| p.start == Start::Slope);
        let sizes = range.clone().filter_map(|i| {
            let p = &candidates[c].parameters()[i - range.start];
            let k = free.iter().position(|&f| f == i)?;
            if !is_size(p, has_slopes) {
                return None;
            }
            let deviation = fitted.covariance[(k, k)].max(0.0).sqrt();
            let size = (fitted.theta[i] - p.null).abs();
            Some((size / deviation, size))
        });
        let largest = sizes.reduce(|a, b| (a.0.max(b.0), a.1.max(b.1)));
        all.extend(largest.map(|(strength, size)| Deed {
            candidate: c,
            law: candidates[c].spec.name.clone(),
            strength,
            size,
        }));
    }
    all
}

/// Removes the members of a set that have no effect in it: members of a group at or near their
/// null, and members that a later effect has replaced.
///
/// A slight member of a group stays only if it makes up for the share of what was missing
/// `at_first` that any further effect must.
pub(super) fn pruned(
    context: &Context<'_>,
    candidates: &[Candidate],
    set: Set,
    (breadth, at_first): (Breadth, Missing),
    progress: &dyn Progress,
) -> Result<Set> {
    let deeds = deeds(candidates, &set);
    let is_idle = |d: &&Deed| d.strength < IDLE;
    let is_slight = |d: &&Deed| {
        let like = deeds.iter().filter(|o| o.law == d.law);
        d.size < SLIGHT * like.map(|o| o.size).fold(0.0, f64::max)
    };
    let places = |which: &dyn Fn(&&Deed) -> bool| -> Vec<usize> {
        deeds.iter().filter(which).map(|d| d.candidate).collect()
    };
    let left = |s: &Set| s.fitted.estimate.missing(context).relative_to(at_first);
    let (idle, slight) = (places(&is_idle), places(&is_slight));
    let mut set = set;
    for (out, slight) in [(idle, false), (slight, true)] {
        let out: Vec<usize> = (out.into_iter())
            .filter(|c| set.candidates.contains(c))
            .collect();
        if out.is_empty() || out.len() == set.candidates.len() {
            continue;
        }
        let mut smaller = set.clone();
        for &c in &out {
            smaller = without(&smaller, candidates, c);
        }
        smaller.fit(context, (breadth.rounds[1], progress))?;
        let stands = if slight {
            left(&smaller) - left(&set) < breadth.shrinks * out.len() as f64
        } else {
            smaller.fitted.evidence > set.fitted.evidence - IDLE_LOSS
        };
        if stands {
            set = smaller;
        } else if !slight && out.len() > 1 {
            set = without_one_by_one(context, candidates, (set, out), (breadth, progress))?;
        }
    }
    Ok(set)
}

/// Removes members that have no effect one after the other, until one is needed.
///
/// Two members may stand in for each other: neither has an effect beside the other, and one of them
/// has.
fn without_one_by_one(
    context: &Context<'_>,
    candidates: &[Candidate],
    (set, mut open): (Set, Vec<usize>),
    (breadth, progress): (Breadth, &dyn Progress),
) -> Result<Set> {
    let mut set = set;
    while !open.is_empty() && !progress.is_stopped() {
        let change = |c: usize| change_without(candidates, &set, &[c]).unwrap_or(f64::NEG_INFINITY);
        let changes = open.iter().map(|&c| change(c)).enumerate();
        let Some((place, _)) = changes.max_by(|a, b| a.1.total_cmp(&b.1)) else {
            break;
        };
        let mut smaller = without(&set, candidates, open.remove(place));
        smaller.fit(context, (breadth.rounds[1], progress))?;
        if smaller.fitted.evidence <= set.fitted.evidence - IDLE_LOSS {
            break;
        }
        set = smaller;
    }
    Ok(set)
}

/// Whether the second set makes up for as much of what the first, without the name, leaves as a
/// further name must.
pub(super) type Counts<'c> = dyn Fn(&Set, &Set) -> Result<bool> + 'c;

/// Removes the names of a set that adding one name after the other would not have included, if
/// several were added to a base at once.
///
/// Each name must raise the evidence by the `threshold` and pass `counts`. If the remaining set is
/// among the `others` that were fitted, that fit is used.
///
/// Members are tried in the order of what their removal costs to first order. That order may be
/// wrong for a limit, whose cost is not known. So a second member is tried after one that is needed,
/// if its removal may cost little.
pub(super) fn earned(
    context: &Context<'_>,
    candidates: &[Candidate],
    (set, base, others): (Set, &Set, &[Set]),
    (breadth, threshold, counts): (Breadth, f64, &Counts<'_>),
    progress: &dyn Progress,
) -> Result<Set> {
    let mut set = set;
    let mut needed: Vec<usize> = Vec::new();
    while set.names.count() > base.names.count() + 1 && !progress.is_stopped() {
        let is_kept = |c: &usize| base.candidates.contains(c) || needed.contains(c);
        let is_open = |c: &usize| !candidates[*c].is_tolerance && !is_kept(c);
        let change = |c: usize| change_without(candidates, &set, &[c]).unwrap_or(f64::NEG_INFINITY);
        let open = set.candidates.iter().copied().filter(is_open);
        let changes = open.map(|c| (c, change(c)));
        let Some((out, change)) = changes.max_by(|a, b| a.1.total_cmp(&b.1)) else {
            break;
        };
        if !needed.is_empty() && change < -TANGENT * threshold {
            break;
        }
        let mut smaller = without(&set, candidates, out);
        let same = |o: &&Set| {
            let is_in = |c: &usize| smaller.candidates.contains(c);
            o.candidates.len() == smaller.candidates.len() && o.candidates.iter().all(is_in)
        };
        match others.iter().find(same) {
            Some(known) => smaller = known.clone(),
            None => smaller.fit(context, (breadth.rounds[1], progress))?,
        }
        if !set.rises_above(&smaller, threshold) || !counts(&smaller, &set)? {
            set = smaller;
            continue;
        }
        needed.push(out);
        if needed.len() == NEEDED {
            break;
        }
    }
    Ok(set)
}

/// Prunes as [`pruned`] does if there is no time for another fit.
///
/// The remaining values take their means given that the removed ones are at their null values. The
/// evidence follows from the densities there ([`without_values`]). Slight members stay.
pub(super) fn pruned_at_once(candidates: &[Candidate], set: Set) -> Set {
    let idle: Vec<usize> = (deeds(candidates, &set).iter())
        .filter(|d| d.strength < IDLE)
        .map(|d| d.candidate)
        .collect();
    if idle.is_empty() || idle.len() == set.candidates.len() {
        return set;
    }
    let fitted = &set.fitted;
    let free = fitted.hypothesis.free();
    let out = leaving(candidates, &set, &idle);
    let Some((gain, shift)) = without_values(&set, &out) else {
        return set;
    };
    if gain < -IDLE_LOSS {
        return set;
    }
    let mut smaller = set.clone();
    for (k, &i) in free.iter().enumerate() {
        let [low, high] = fitted.hypothesis.unknowns[i].bounds;
        smaller.fitted.theta[i] = (smaller.fitted.theta[i] + shift[k]).clamp(low, high);
    }
    let stay: Vec<usize> = (0..free.len()).filter(|k| !out.all.contains(k)).collect();
    // The values are at their means now; the old distances would be those of other values.
    smaller.fitted.ahead = vec![0.0; stay.len()];
    let covariance = conditional(&fitted.covariance, &stay, &out.off);
    for &c in &idle {
        smaller = without(&smaller, candidates, c);
    }
    smaller.fitted.evidence += gain;
    smaller.fitted.covariance = covariance.unwrap_or_else(|| {
        let own = fitted.covariance.select_rows(&stay);
        own.select_columns(&stay)
    });
    smaller
}
