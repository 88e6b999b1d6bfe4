//! From fitted explanations to probabilities, a verdict, and what cannot be told from it.
//!
//! Sums of squares over all logs are compared, those held out included. They are tempered
//! by how badly and how correlatedly the best explanation still misses, so that many
//! readings of one and the same error count once. A further effect has to earn its place: where the real law differs a
//! little from the model's, a small residual is left, and is no second effect.

use crate::bench::{Bench, Explanation};
use crate::chance::threshold;
use crate::confidence::sigmoid;
use crate::judgement::{Hypothesis, Judgement};
use crate::search::{Findings, Found, NEGLIGIBLE, excess};

/// Share of the excess power left from which on an unknown effect is as likely as not: `unknown` is for a gap of which nothing
/// named explains the larger part.
const REST: f64 = 0.5;
/// Width of the logistic curve about it, in natural logarithms of the share: 12 % at half of it, 88 % at twice.
const SHARPNESS: f64 = 0.35;
/// A further effect must bring the excess below this share of what it was.
const WORTH: f64 = 0.4;
/// A first effect in a gap that is small anyway must bring the excess below this share of what it
/// was, on the logs fitted to as on those held out: a part of what an engine's own errors leave can
/// always be had from some effect.
const WORTH_FIRST: f64 = 0.6;
/// It must also shrink the plain gap of the logs held out below this share: what does not is no
/// explanation, however well it goes with what is left of whitened residuals.
const SHRINKS: f64 = 0.9;
/// Difference of tempered sums of squares up to which two sets cannot be told apart: a
/// likelihood ratio of 400.
const APART: f64 = 12.0;
/// Prior odds against a wind on a machine's link, where a joint or drive does the same.
const UNUSUAL: f64 = 10.0;
/// Prior odds against each further effect.
const FURTHER: f64 = 20.0;

/// Correlation of neighbouring residuals, averaged over entries and episodes by their size.
#[must_use]
pub fn correlation(bench: &Bench, residuals: &[f64]) -> f64 {
    let logs = &bench.train.logs;
    let n = logs.entries.len();
    let (mut product, mut square) = (0.0, 0.0);
    for e in 0..logs.episodes.len() {
        let part = &residuals[logs.offset(e)..logs.offset(e + 1)];
        for k in n..part.len() {
            product += part[k] * part[k - n];
            square += part[k] * part[k];
        }
    }
    if square > 0.0 {
        (product / square).clamp(0.0, 0.98)
    } else {
        0.0
    }
}

/// Number of free effect parameters whose range makes a difference.
fn size(bench: &Bench, explanation: &Explanation) -> usize {
    let study = bench.parameters.len();
    let fit = &explanation.fit;
    let effect = fit.free.iter().enumerate().filter(|(_, i)| **i >= study);
    effect
        .filter(|(k, i)| {
            let [low, high] = explanation.unknowns[**i].parameter.range;
            let column = fit.jacobian.column(*k);
            let response = column.norm() * (high - low) / (column.len().max(1) as f64).sqrt();
            response > crate::linearise::NOTHING
        })
        .count()
}

/// Whether an effect comes to mind at its site only after others.
fn is_unusual(bench: &Bench, label: &str) -> bool {
    let (name, site) = label.split_once('@').unwrap_or((label, ""));
    let entry = asid_core::registry::find::<asid_effects::EffectEntry>(name);
    entry.is_ok_and(|e| (e.make)().unusual_at(&bench.machine.plant, site))
}

/// Whether a set is another one with one effect replaced by a refinement of it.
fn refines(findings: &Findings, set: &Hypothesis, simpler: &Hypothesis) -> bool {
    let (Some(a), Some(b)) = (set.found, simpler.found) else {
        return false;
    };
    let effects = |i: usize| &findings.found[i].explanation.effects;
    let mut differ = effects(a)
        .iter()
        .filter(|x| !effects(b).iter().any(|y| y.label() == x.label()));
    let (Some(fine), None) = (differ.next(), differ.next()) else {
        return false;
    };
    let entry = asid_core::registry::find::<asid_effects::EffectEntry>(&fine.name);
    let coarse: &[&str] = entry.map_or(&[], |e| (e.make)().refines());
    set.labels.len() == simpler.labels.len()
        && effects(b)
            .iter()
            .any(|y| coarse.contains(&&*y.name) && y.site == fine.site)
}

/// Whether a set is another one with one effect replaced by one that is unusual at its
/// site.
fn stands_in(bench: &Bench, set: &Hypothesis, other: &Hypothesis) -> bool {
    let differ = |a: &Hypothesis, b: &Hypothesis| -> Vec<String> {
        let own = a.labels.iter().filter(|l| !b.labels.contains(l));
        own.cloned().collect()
    };
    match (&differ(set, other)[..], &differ(other, set)[..]) {
        ([a], [b]) => is_unusual(bench, a) && !is_unusual(bench, b),
        _ => false,
    }
}

/// Whether a set is another one with something added that does nothing, or all of it and more.
fn contains(larger: &Found, smaller: &[String]) -> bool {
    let labels = larger.explanation.labels();
    labels.len() > smaller.len() && smaller.iter().all(|l| labels.contains(l))
}

/// Whether one of its effects stands at its null value: the set is a smaller one, or a
/// special case of another effect.
fn reduces(found: &Found, bench: &Bench) -> bool {
    let mut at = bench.parameters.len();
    found.explanation.effects.iter().any(|effect| {
        let unknowns = &found.explanation.unknowns[at..at + effect.values.len()];
        at += effect.values.len();
        let entry = asid_core::registry::find::<asid_effects::EffectEntry>(&effect.name);
        let Ok(entry) = entry else { return false };
        let made = (entry.make)();
        made.parameters()
            .iter()
            .zip(&effect.values)
            .zip(unknowns)
            .any(|((p, (_, value)), unknown)| {
                let [low, high] = unknown.parameter.range;
                let at_end = p.null == low || p.null == high;
                unknown.free && at_end && (value - p.null).abs() < 1e-4 * (high - low)
            })
    })
}

/// Judges what a search found; `scatter` is the deviation of a sum of squares that the
/// simulator's own scatter makes, `candidates` how many effects were tried, and `false_alarms` how often chance alone may
/// earn one of them its place.
#[must_use]
pub fn judge(
    bench: &Bench,
    findings: &Findings,
    (candidates, false_alarms): (usize, f64),
    scatter: f64,
) -> Judgement {
    let readings = (bench.train.readings + bench.test.readings) as f64;
    let mut all = vec![Hypothesis {
        found: None,
        labels: Vec::new(),
        cost: findings.none.cost(),
        size: 0,
        probability: 0.0,
    }];
    for (i, found) in findings.found.iter().enumerate() {
        let cost = found.explanation.cost();
        if cost.is_finite() && !reduces(found, bench) {
            all.push(Hypothesis {
                found: Some(i),
                labels: found.explanation.labels(),
                cost,
                size: size(bench, &found.explanation),
                probability: 0.0,
            });
        }
    }
    let lowest = all.iter().map(|h| h.cost).fold(f64::INFINITY, f64::min);
    let residuals = all
        .iter()
        .find(|h| h.cost == lowest)
        .and_then(|h| h.found)
        .map_or(&findings.none.fit.residuals, |i| {
            &findings.found[i].explanation.fit.residuals
        });
    let rho = correlation(bench, residuals);
    let temperature =
        (lowest / readings).max(1.0) * (1.0 + rho) / (1.0 - rho) + scatter / (2.0 * APART.sqrt());
    let by_chance = threshold(candidates, false_alarms);
    // Twice the negative logarithm of the posterior, up to a constant.
    let score = |h: &Hypothesis| {
        let unusual =
            2.0 * UNUSUAL.ln() * h.labels.iter().filter(|l| is_unusual(bench, l)).count() as f64;
        // A first effect pays for what chance reaches, each further one for the choice.
        let further_ones = h.labels.len().saturating_sub(1) as f64;
        let first = if h.labels.is_empty() { 0.0 } else { by_chance };
        let choice = 2.0 * (first + (candidates.max(1) as f64).ln() * further_ones);
        let further = 2.0 * FURTHER.ln() * further_ones;
        h.cost / temperature + h.size as f64 * readings.ln() + choice + further + unusual
    };
    let gap = |h: &Hypothesis| excess(h.cost / readings);
    let explanation = |h: &Hypothesis| {
        let found = h.found.map(|i| &findings.found[i].explanation);
        found.unwrap_or(&findings.none)
    };
    // On the logs that were fitted to, and on those held out.
    let gaps = |h: &Hypothesis| {
        let of = explanation(h);
        [
            excess(of.fit.cost / bench.train.readings as f64),
            excess(of.held_out / bench.held_readings()),
        ]
    };
    let plain = |h: &Hypothesis| excess(explanation(h).held_plain / bench.held_readings());
    // A refinement that hardly betters the simpler effect is no answer of its own, nor is an
    // unusual effect that hardly betters a usual one.
    let idle: Vec<bool> = all
        .iter()
        .map(|h| {
            all.iter().any(|simpler| {
                (refines(findings, h, simpler) || stands_in(bench, h, simpler))
                    && !(gap(simpler) > NEGLIGIBLE && gap(h) < WORTH * gap(simpler))
            })
        })
        .collect();
    // The simplest set that no larger one betters by enough.
    let mut best = 0;
    let most = all.iter().map(|h| h.labels.len()).max().unwrap_or(0);
    for count in 1..=most {
        let next = (0..all.len())
            .filter(|&i| all[i].labels.len() == count && !idle[i])
            .min_by(|&a, &b| score(&all[a]).total_cmp(&score(&all[b])));
        let Some(next) = next else { continue };
        let (before, after) = (&all[best], &all[next]);
        let better = score(after) < score(before);
        let worth = if before.labels.is_empty() {
            let mut pairs = gaps(before).into_iter().zip(gaps(after));
            gap(before) > NEGLIGIBLE
                || pairs.all(|(before, after)| after < WORTH_FIRST * before)
                    && plain(after) < SHRINKS * plain(before)
        } else {
            gap(before) > NEGLIGIBLE && gap(after) < WORTH * gap(before)
        };
        if better && worth {
            best = next;
        }
    }
    let base = score(&all[best]);
    for i in 0..all.len() {
        let mut worse = score(&all[i]) - base;
        // What the rule of parsimony passes over is not more probable than what it picks.
        if i != best {
            let passed_over = all[i].labels.len() > all[best].labels.len() || idle[i];
            worse = worse.max(if passed_over { 6.0 } else { 0.0 });
        }
        all[i].probability = (-0.5 * worse).exp();
    }
    let left = gap(&all[best]);
    let rest = (left / gap(&all[0]).max(1e-9)).powi(2).min(1.0);
    let unknown = if best == 0 {
        // Where long replays tell nothing, short ones may still leave a gap.
        let short = findings.short.unwrap_or(0.0);
        sigmoid((short.max(left) - NEGLIGIBLE) / 0.3).clamp(0.02, 0.999)
    } else {
        let share = sigmoid((rest / REST).ln() / SHARPNESS);
        (share * sigmoid((left - NEGLIGIBLE) / 0.3)).clamp(0.001, 0.999)
    };
    let ambiguous = (0..all.len())
        .filter(|&i| {
            let Some(found) = all[i].found.map(|f| &findings.found[f]) else {
                return false;
            };
            i != best
                && best != 0
                && !idle[i]
                && !contains(found, &all[best].labels)
                && all[i].labels.len() <= all[best].labels.len()
                && (all[i].cost - all[best].cost) / temperature < APART
        })
        .collect();
    Judgement::of(all, (best, ambiguous), (unknown, rest))
}
