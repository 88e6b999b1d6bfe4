//! From evidence to probabilities and a verdict.

use asid_core::Result;

use crate::bench::{Bench, Explanation};
use crate::candidate::Candidate;
use crate::checks::change_by_step;
use crate::fit::cost;
use crate::search::{Findings, LEAST_GAP, NEGLIGIBLE, excess};
use crate::verdict::{Hypothesis as Judged, Judgement};

use super::estimate::LEAST_LEFT;
use super::search::{Outcome, Set};

/// Evidence is divided by this before it becomes a probability: the noise model is not the machine's own.
const TEMPERATURE: f64 = 1.5;
/// Difference of evidence up to which two sets cannot be told apart: odds of 20 after the temperature.
const APART: f64 = 4.5;
/// Midpoint and scale of the logistic in the logarithm of the share of the missing force's power, or of the gap's, that no
/// named effect makes up for.
const UNEXPLAINED: f64 = 0.5;
const SHARPNESS: f64 = 0.35;
/// Open-loop gap, in deviations of the noise, at which a missing force without a name counts as a gap, and the scale of
/// the logistic about it.
const GAP: f64 = 2.0;
const GAP_SCALE: f64 = 0.3;
/// Root mean square of the missing force, relative to the inertial forces, up to which nothing is missing.
const NOTHING: f64 = 0.01;

/// Share of a small gap's power, of the logs fitted to and of those held out, that an effect must close in replays.
const CLOSES: f64 = 0.5;
/// An engine's own error, in changes by half the time step: what is of first order in the step (Richardson 1911), the worst
/// that engines have.
const RICHARDSON: f64 = 2.0;

/// Whether a set stands in spite of a small gap: what evidence from row to row is for counts where replays of whole
/// logs, those held out too, bear it out, and where the engine's own error is no larger than what else is there.
fn closes_a_small_gap(bench: &Bench, none: &Explanation, set: &Explanation) -> Result<bool> {
    let readings = bench.train.readings as f64;
    let power = |cost: f64, readings: f64| cost / readings.max(1.0) - 1.0;
    let held = |e: &Explanation| power(e.held_plain, bench.held_readings());
    let train = |e: &Explanation| power(e.fit.cost, readings);
    let is_there = |p: f64| p > LEAST_GAP * LEAST_GAP - 1.0;
    let closes = is_there(held(none))
        && is_there(train(none))
        && held(set) < (1.0 - CLOSES) * held(none)
        && train(set) < (1.0 - CLOSES) * train(none);
    if !closes {
        return Ok(false);
    }
    let change = change_by_step(bench, none, &bench.machine.halved()?)?;
    let own = RICHARDSON.powi(2) * cost(&change) / readings.max(1.0);
    Ok(own < (1.0 - CLOSES) * train(none))
}

/// Judges what a search found; `sets` are those behind the findings, in their order, and `known` the candidates that the logs
/// show to act without a search.
///
/// # Errors
/// When a rollout fails.
pub fn select(
    bench: &Bench,
    outcome: &Outcome,
    (sets, known): (&[Set], &[usize]),
    findings: &Findings,
    candidates: &[Candidate],
) -> Result<Judgement> {
    let none = outcome.none.evidence;
    let price = (candidates.len().max(1) as f64).ln();
    let score =
        |evidence: f64, names: usize| (evidence - none) / TEMPERATURE - price * names as f64;
    let mut all = vec![Judged {
        found: None,
        labels: Vec::new(),
        cost: findings.none.cost(),
        size: 0,
        probability: 0.0,
    }];
    let mut scores = vec![0.0];
    for (i, set) in sets.iter().enumerate() {
        let mut labels: Vec<String> = set
            .candidates
            .iter()
            .map(|&c| candidates[c].label())
            .collect();
        labels.sort();
        all.push(Judged {
            found: Some(i),
            labels,
            cost: findings.found[i].explanation.cost(),
            size: set.fitted.hypothesis.free().len() - bench.parameters.len(),
            probability: 0.0,
        });
        scores.push(score(set.fitted.evidence, set.names));
    }
    let chosen = &outcome.best.candidates;
    let best = 1 + sets
        .iter()
        .position(|s| s.candidates == *chosen)
        .unwrap_or(usize::MAX - 1);
    let readings = bench.held_readings().max(1.0);
    let gap = (findings.none.held_plain / readings).sqrt();
    let train = (findings.none.fit.cost / bench.train.readings.max(1) as f64).sqrt();
    // What stands without a search: no effect, or the known ones.
    let least = sets.iter().position(|s| s.candidates == known);
    let least = least.map_or(0, |i| i + 1);
    let is_large = excess(gap.max(train).powi(2)) > NEGLIGIBLE;
    let stands = match all.get(best).and_then(|h| h.found) {
        Some(_) if is_large => true,
        Some(i) => closes_a_small_gap(bench, &findings.none, &findings.found[i].explanation)?,
        None => false,
    };
    let best = if stands { best } else { least };
    // What parsimony passes over is not more probable than what it picks.
    for i in 0..all.len() {
        let odds = scores[i] - scores[best];
        let passed = all[i].labels.len() > all[best].labels.len();
        all[i].probability = odds.min(if passed { -price } else { 0.0 }).exp();
    }
    let sum: f64 = all.iter().map(|h| h.probability).sum();
    let [before, after] = outcome.missing;
    let named = all[best].found.map(|i| &findings.found[i].explanation);
    let beyond = |cost: f64| excess(cost / bench.train.readings.max(1) as f64).powi(2);
    let open_loop = named.map_or(1.0, |e| beyond(e.fit.cost) / beyond(findings.none.fit.cost));
    // What is named may make up for most of the gap and leave much of what is missing from row to row, or the other way round.
    let rest = after.relative_to(before).min(open_loop).clamp(0.0, 1.0);
    let sigmoid = |x: f64| 1.0 / (1.0 + (-x).exp());
    let unknown = if best == least {
        let missing = before.force.sqrt() > NOTHING || before.readings > LEAST_LEFT;
        let seen = sigmoid((gap - GAP) / GAP_SCALE);
        if missing {
            seen.clamp(0.02, 0.999)
        } else {
            0.02
        }
    } else {
        sigmoid((rest / UNEXPLAINED).ln() / SHARPNESS).clamp(0.001, 0.999)
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
                && TEMPERATURE * (scores[best] - scores[i]) < APART
        })
        .collect();
    let mut judgement = Judgement {
        best,
        ambiguous,
        unknown,
        temperature: TEMPERATURE,
        rest,
        hypotheses: all,
    };
    judgement.sort();
    Ok(judgement)
}
