//! From evidence to probabilities and a verdict: a function of what a search has stored, without
//! any replay.

mod rules;
mod sets;

use asid_results::evidence::{Evidence, Replayed, Screened, Tried};
use asid_results::naming::grouped;

use crate::confidence::{Shown, Untried, sigmoid};
use crate::findings::{LEAST_GAP, NEGLIGIBLE, excess};
use crate::judgement::Judgement;

pub use rules::{Rule, Rules};
use sets::Sets;

/// Whether the gap without effects is so small that replays of whole logs must confirm what the
/// evidence favours.
#[must_use]
pub fn is_small(none: Replayed) -> bool {
    excess(none.train.max(none.held_out)) <= NEGLIGIBLE
}

/// Whether a set stands in spite of a small gap.
///
/// It stands if replays of whole logs, held-out logs too, confirm it, and the engine's own error is
/// no larger than what else is there. Fitted initial states may take up the whole gap of the
/// training logs. Then the held-out logs decide, and the training logs need only become no worse.
fn closes_a_small_gap(evidence: &Evidence, set: Replayed, rules: &Rules) -> bool {
    let power = |mean_square: f64| mean_square - 1.0;
    let (none, kept) = (evidence.none, 1.0 - rules.closes);
    let is_there = |p: f64| p > LEAST_GAP * LEAST_GAP - 1.0;
    let closes = |before: f64, after: f64| {
        let before = power(before);
        power(after) < kept * before && own_error(evidence) < kept * before
    };
    let bears_out = if is_there(power(none.train)) {
        closes(none.train, set.train)
    } else {
        set.train < none.train
    };
    is_there(power(none.held_out)) && closes(none.held_out, set.held_out) && bears_out
}

/// Whether replays without effects leave a gap on the training logs alone, for example because no
/// held-out command reaches the limit of a drive.
#[must_use]
pub fn is_in_training_alone(none: Replayed) -> bool {
    let is_there = |mean_square: f64| mean_square > LEAST_GAP * LEAST_GAP;
    is_there(none.train) && !is_there(none.held_out)
}

/// Whether replays of the held-out logs with a set are closer to the readings than those without
/// it, and than the readings' own mean ([`crate::skill`]) unless they leave no gap.
///
/// A set without such skill explains nothing. One that leaves no gap predicts all that the readings
/// show: where a machine stands still, their mean can be no worse. If the held-out logs have no
/// gap, the set must leave none there and close that of the training logs.
fn has_skill(evidence: &Evidence, set: Replayed, rules: &Rules) -> bool {
    if is_in_training_alone(evidence.none) {
        let left = |mean_square: f64| mean_square - 1.0;
        let most = (1.0 - rules.closes) * left(evidence.none.train);
        return set.held_out <= LEAST_GAP * LEAST_GAP && left(set.train) < most;
    }
    let worse_than = |other: f64| set.held_out >= other;
    let leaves_no_gap = set.held_out <= LEAST_GAP * LEAST_GAP;
    !worse_than(evidence.none.held_out) && (leaves_no_gap || !worse_than(evidence.mean.held_out))
}

/// Returns the mean square of the engine's own error; 0 if it is unknown, since the larger of 0 and
/// NaN is 0.
fn own_error(evidence: &Evidence) -> f64 {
    evidence.own_error.max(0.0)
}

/// Returns the mean square of the engine's own error on the held-out logs.
///
/// It is measured on the training logs, and held-out logs may be longer or wilder. Its share of the
/// gap is therefore taken to be at least as large as on the training logs.
fn own_error_held_out(evidence: &Evidence) -> f64 {
    let (own, none) = (own_error(evidence), evidence.none);
    if none.train <= LEAST_GAP * LEAST_GAP {
        return own;
    }
    let share = (own / (none.train - 1.0)).min(1.0);
    own.max(share * (none.held_out - 1.0))
}

/// Returns the probability that a mean square `held_out` left on the held-out logs is a gap, and
/// neither noise nor the engine's own error.
fn seen(held_out: f64, evidence: &Evidence, rules: &Rules) -> f64 {
    let gap = (held_out - own_error_held_out(evidence)).max(1.0).sqrt();
    sigmoid((gap - rules.gap) / rules.gap_scale)
}

/// Returns the sets that were screened and never fitted, with their weights relative to the best
/// set.
///
/// The weight is the probability that a fit would exceed the best set. For a set that contains the
/// best one, it follows from the evidence that the further names add, less their price.
fn untried(evidence: &Evidence, best: Option<&Tried>, rules: &Rules) -> Vec<Untried> {
    let Some(best) = best.filter(|b| b.evidence > 0.0) else {
        return Vec::new();
    };
    let price = (evidence.candidates.max(1) as f64).ln();
    let weight = |s: &Screened| {
        if best.effects.iter().all(|e| s.effects.contains(e)) {
            let more = s.names.saturating_sub(best.names) as f64;
            let odds = (s.evidence - best.evidence) / rules.temperature - price * more;
            // A set that parsimony passes over is not more probable than the best, as in
            // `Sets::weigh`.
            return odds.min(-price).exp();
        }
        rules.confidence.passes(s.evidence / best.evidence)
    };
    let untried = evidence.screened.iter().map(|s| Untried {
        labels: s.effects.clone(),
        weight: weight(s),
    });
    untried.collect()
}

/// Whether a set with tolerances names nothing but what the logs show without a search: no effect,
/// or encoder steps.
fn is_ordinary(evidence: &Evidence, set: usize) -> bool {
    let known = evidence.known.map(|k| &evidence.tried[k].effects[..]);
    Some(set) != evidence.known && evidence.tried[set].effects == known.unwrap_or_default()
}

/// Share of a gap from which on it is the larger part of it.
const LARGER_PART: f64 = 0.5;

/// Mean square of a replay, relative to that of the readings about their own mean, from which on it
/// counts as diverged: it is a hundred times as far from the readings as a constant is.
const DIVERGED: f64 = 1e4;

/// Returns the mean square that a set is to reduce: that without effects, or that of the readings
/// about their own mean where the replay without effects diverged.
///
/// Any replay that stays finite would close a gap without end.
fn to_close(none: f64, mean: f64) -> f64 {
    if mean > 1.0 && none > DIVERGED * mean {
        mean
    } else {
        none
    }
}

/// Returns the share of the gap that a set leaves, 0 to 1.
///
/// It is the share of the missing force or of the open-loop gap, whichever is less: what is named
/// may make up for most of one and leave much of the other. Where replays are repeatable, the set
/// must predict the held-out logs as well. What a named set leaves of their gap counts if it is the
/// larger part; what tolerances leave counts in any case.
fn left_of_the_gap(evidence: &Evidence, found: Option<usize>) -> f64 {
    let share = |i: usize, of: fn(Replayed) -> f64| {
        let whole = to_close(of(evidence.none), of(evidence.mean));
        excess(of(evidence.tried[i].replayed)).powi(2) / excess(whole).powi(2)
    };
    let open_loop = found.map_or(1.0, |i| share(i, |r| r.train));
    let left = evidence.left.min(open_loop).clamp(0.0, 1.0);
    let repeated = found.filter(|_| evidence.repeatable && !is_in_training_alone(evidence.none));
    let is_named = found.is_some_and(|i| !is_ordinary(evidence, i));
    let foretold = repeated.map_or(0.0, |i| share(i, |r| r.held_out));
    let foretold = if is_named && foretold <= LARGER_PART {
        0.0
    } else {
        foretold
    };
    left.max(foretold.clamp(0.0, 1.0))
}

/// Turns evidence into a judgement.
#[must_use]
pub fn decide(evidence: &Evidence, rules: &Rules) -> Judgement {
    let mut sets = Sets::of(evidence, rules);
    let (least, best) = sets.least_and_best();
    // What is named is judged on the logs that show it.
    let judge = |r: Replayed| {
        if best != least && is_in_training_alone(evidence.none) {
            r.train
        } else {
            r.held_out
        }
    };
    let seen = seen(judge(evidence.none), evidence, rules);
    sets.weigh((least, best), seen);
    let rest = left_of_the_gap(evidence, sets.all[best].found);
    let unknown = sets.unknown((least, best), seen, rest);
    let ambiguous = sets.ambiguous(best);
    let within_tolerances = best == least && sets.ordinary.is_some();
    let caused = if sets.ordinary.is_some() { 0.0 } else { seen };
    let mut judgement = Judgement::of(sets.all, (best, ambiguous), (unknown, rest));
    let found = judgement.best_explanation().found;
    let found = found.map(|i| &evidence.tried[i]);
    let replayed = found.map_or(evidence.none, |t| t.replayed);
    let shown = Shown {
        left: (judge(replayed) - own_error(evidence) - 1.0).max(0.0)
            / (judge(evidence.none) - 1.0).max(f64::MIN_POSITIVE),
        stopped: evidence.stopped,
        laws: found.map_or(0, |t| grouped(&t.effects).len()),
        within_tolerances,
        caused,
    };
    let untried = untried(evidence, found, rules);
    rules.confidence.settle(&mut judgement, shown, &untried);
    judgement
}

#[cfg(test)]
mod tests;
