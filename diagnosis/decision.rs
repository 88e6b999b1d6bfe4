//! From evidence to probabilities and a verdict: a function of what a search has stored, without a replay.

use asid_results::evidence::{Evidence, Replayed};

use crate::confidence::{Confidence, Untried};
use crate::judgement::{Hypothesis, Judgement};
use crate::search::{LEAST_GAP, NEGLIGIBLE, excess};

/// What decides.
#[derive(Clone, Debug)]
pub struct Rules {
    /// Evidence is divided by this before it becomes a probability: the noise model is not the machine's own.
    pub temperature: f64,
    /// Difference of evidence up to which two sets cannot be told apart: odds of 20 after the temperature.
    pub apart: f64,
    /// Midpoint of the logistic in the logarithm of the share of the missing force's power, or of the gap's, that no
    /// named effect makes up for.
    pub unexplained: f64,
    /// Scale of that logistic.
    pub sharpness: f64,
    /// Open-loop gap, in deviations of the noise and without the engine's own error, at which a missing force without a name counts as
    /// a gap. Training worlds without a cause have at most 1.08 (22 clean ones, seed 3141); those whose cause was not named 1.2 to 4.
    pub gap: f64,
    /// Scale of the logistic about it.
    pub gap_scale: f64,
    /// Share of a small gap's power, of the logs fitted to and of those held out, that an effect must close in replays.
    pub closes: f64,
    /// How far a verdict is to be trusted.
    pub confidence: Confidence,
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            temperature: 1.5,
            apart: 4.5,
            unexplained: 0.5,
            sharpness: 0.35,
            gap: 1.35,
            gap_scale: 0.1,
            closes: 0.5,
            confidence: Confidence::default(),
        }
    }
}

/// A number that decides, by name.
pub type Rule = (&'static str, fn(&mut Rules) -> &mut f64);

impl Rules {
    /// All numbers, so that each can be changed and the decision repeated.
    pub const ALL: [Rule; 14] = [
        ("temperature", |r| &mut r.temperature),
        ("apart", |r| &mut r.apart),
        ("unexplained", |r| &mut r.unexplained),
        ("sharpness", |r| &mut r.sharpness),
        ("gap", |r| &mut r.gap),
        ("gap_scale", |r| &mut r.gap_scale),
        ("closes", |r| &mut r.closes),
        ("confidence.named", |r| &mut r.confidence.named),
        ("confidence.evidence", |r| &mut r.confidence.evidence),
        ("confidence.stopped", |r| &mut r.confidence.stopped),
        ("confidence.gap_left", |r| &mut r.confidence.gap_left),
        ("confidence.unknown", |r| &mut r.confidence.unknown),
        ("confidence.beside", |r| &mut r.confidence.beside),
        ("confidence.screening", |r| &mut r.confidence.screening),
    ];
}

/// Whether a gap without effects is so small that what evidence from row to row is for must be borne out by replays of whole logs.
#[must_use]
pub fn is_small(none: Replayed) -> bool {
    excess(none.train.max(none.held_out)) <= NEGLIGIBLE
}

/// Whether a set stands in spite of a small gap: where replays of whole logs, those held out too, bear it out, and where
/// the engine's own error is no larger than what else is there.
fn closes_a_small_gap(evidence: &Evidence, set: Replayed, rules: &Rules) -> bool {
    let power = |mean_square: f64| mean_square - 1.0;
    let (none, kept) = (evidence.none, 1.0 - rules.closes);
    let is_there = |p: f64| p > LEAST_GAP * LEAST_GAP - 1.0;
    let [train, held] = [power(none.train), power(none.held_out)];
    is_there(held)
        && is_there(train)
        && power(set.held_out) < kept * held
        && power(set.train) < kept * train
        && evidence.own_error < kept * train
}

/// Decides.
#[must_use]
pub fn decide(evidence: &Evidence, rules: &Rules) -> Judgement {
    let price = (evidence.candidates.max(1) as f64).ln();
    let score = |evidence: f64, names: usize| evidence / rules.temperature - price * names as f64;
    let mut all = vec![Hypothesis::default()];
    let mut scores = vec![0.0];
    for (i, set) in evidence.tried.iter().enumerate() {
        all.push(Hypothesis {
            found: Some(i),
            labels: set.effects.clone(),
            ..Hypothesis::default()
        });
        scores.push(score(set.evidence, set.names));
    }
    // What stands without a search: no effect, or the known ones.
    let least = evidence.known.map_or(0, |i| i + 1);
    let stands = evidence.found.filter(|&i| {
        !is_small(evidence.none) || closes_a_small_gap(evidence, evidence.tried[i].replayed, rules)
    });
    let best = stands.map_or(least, |i| i + 1);
    // What parsimony passes over is not more probable than what it picks.
    for i in 0..all.len() {
        let odds = scores[i] - scores[best];
        let passed = all[i].labels.len() > all[best].labels.len();
        all[i].probability = odds.min(if passed { -price } else { 0.0 }).exp();
    }
    let sum: f64 = all.iter().map(|h| h.probability).sum();
    let beyond = |r: Replayed| excess(r.train).powi(2);
    let open_loop = match all[best].found {
        Some(i) => beyond(evidence.tried[i].replayed) / beyond(evidence.none),
        None => 1.0,
    };
    // What is named may make up for most of the gap and leave much of what is missing from row to row, or the other way round.
    let rest = evidence.left.min(open_loop).clamp(0.0, 1.0);
    let sigmoid = |x: f64| 1.0 / (1.0 + (-x).exp());
    let unknown = if best == least {
        // The larger of 0 and NaN is 0: no error of the engine's own is known where the gap is large.
        let own = evidence.own_error.max(0.0);
        let gap = (evidence.none.held_out - own).max(1.0).sqrt();
        let seen = sigmoid((gap - rules.gap) / rules.gap_scale);
        if evidence.is_missing {
            seen.clamp(0.02, 0.999)
        } else {
            0.02
        }
    } else {
        sigmoid((rest / rules.unexplained).ln() / rules.sharpness).clamp(0.001, 0.999)
    };
    for h in &mut all {
        h.probability *= (1.0 - unknown) / sum;
    }
    let ambiguous = (0..all.len())
        .filter(|&i| {
            let larger = all[best].labels.iter().all(|l| all[i].labels.contains(l));
            i != best
                && i != 0
                && best != 0
                && !larger
                && all[i].labels.len() <= all[best].labels.len()
                && rules.temperature * (scores[best] - scores[i]) < rules.apart
        })
        .collect();
    let mut judgement = Judgement {
        is_unknown: unknown > all[best].probability,
        best,
        ambiguous,
        unknown,
        rest,
        hypotheses: all,
    };
    let found = judgement.verdict().found.map(|i| &evidence.tried[i]);
    let replayed = found.map_or(evidence.none, |t| t.replayed);
    let most = found.map_or(f64::NAN, |t| t.evidence);
    let screened = evidence.screened.iter();
    let untried: Vec<Untried> = screened
        .filter(|_| most > 0.0)
        .map(|s| Untried {
            labels: s.effects.clone(),
            relative: s.evidence / most,
        })
        .collect();
    judgement.sort();
    let seen = (replayed.held_out, evidence.stopped);
    rules.confidence.settle(&mut judgement, seen, &untried);
    judgement
}
