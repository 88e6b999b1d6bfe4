//! Collects the evidence for the decision from a search by the missing force.

use asid_core::{Progress, Result};
use asid_mjcf::Plant;
use asid_results::evidence::{Evidence, Replayed, Screened, Tried};

use crate::bench::held_out::{Explained, misfits};
use crate::bench::{Bench, Explanation};
use crate::candidate::{Candidate, nameable};
use crate::checks::{RICHARDSON, change_by_step};
use crate::decision::is_small;
use crate::findings::{Findings, trials};
use crate::fit::cost;
use crate::skill::about_the_mean;

use super::estimate::{LEAST_LEFT, NOTHING};
use super::search::{Outcome, Set, labels_of, log_prior};

/// Largest number of screened, unfitted sets that are kept: those further behind have a negligible
/// probability.
const SCREENED: usize = 40;

/// Labels of a set, sorted.
fn labels(candidates: &[Candidate], set: &[usize]) -> Vec<String> {
    let mut labels = labels_of(candidates, set);
    labels.sort();
    labels
}

/// Mean squared residuals of whole replays of an explanation.
fn replayed(bench: &Bench, of: &Explanation, held_out: f64) -> Replayed {
    Replayed {
        train: of.fit.cost / bench.train.readings.max(1) as f64,
        held_out: held_out / bench.held_readings().max(1.0),
    }
}

/// Sets that were screened upon a base and never fitted.
///
/// Their evidence is relative to the model without effects, to first order, and includes prior
/// odds.
fn screened(
    plant: &Plant,
    outcome: &Outcome,
    candidates: &[Candidate],
    tried: &[Tried],
) -> Vec<Screened> {
    let none = outcome.none.evidence;
    let mut all: Vec<Screened> = Vec::new();
    for round in &outcome.rounds {
        // The fitted base: the model without effects, or a set of an earlier round.
        let sets = outcome.rounds.iter().flat_map(|r| &r.confirmed);
        let of_base = sets.clone().filter(|s| s.candidates == round.base);
        let base = of_base.map(|s| (s.fitted.evidence, s.names)).next();
        let (evidence, names) = if round.base.is_empty() {
            (none, 0)
        } else {
            base.unwrap_or((none, 0))
        };
        let raced: Vec<Vec<String>> = round.raced.iter().map(|s| labels(candidates, s)).collect();
        for seen in &round.screened {
            let members: Vec<usize> = round.base.iter().chain(&seen.set).copied().collect();
            let effects = labels(candidates, &members);
            if raced.contains(&effects) {
                continue;
            }
            all.push(Screened {
                effects,
                names: names + seen.names,
                evidence: evidence - none + seen.gain + log_prior(plant, candidates, &round.base),
            });
        }
    }
    all.retain(|s| !tried.iter().any(|t| t.effects == s.effects));
    all.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    all.truncate(SCREENED);
    all
}

/// Collects what the decision is based on.
///
/// `sets` are those behind the findings, in their order. `known` are the candidates that the logs
/// show without a search.
///
/// # Errors
/// When a rollout fails.
pub fn gather(
    bench: &Bench,
    outcome: &Outcome,
    (sets, known): (&[Set], &[usize]),
    (findings, candidates): (&Findings, &[Candidate]),
    progress: &dyn Progress,
) -> Result<Evidence> {
    let plant = &bench.machine.plant;
    let tried = sets.iter().zip(&findings.found);
    let place = |set: &[usize]| sets.iter().position(|s| s.candidates == set);
    let found = place(&outcome.best.candidates);
    let mut tried: Vec<Tried> = tried
        .map(|(set, found)| {
            let prior = log_prior(plant, candidates, &set.candidates);
            Tried {
                effects: labels(candidates, &set.candidates),
                names: set.names,
                evidence: set.fitted.evidence - outcome.none.evidence + prior,
                prior,
                replayed: replayed(bench, &found.explanation, found.explanation.held_out),
            }
        })
        .collect();
    // The decision compares the residuals that no initial state can absorb.
    let of_found = found.map(|i| &findings.found[i]);
    let of_found = of_found.map(|of| (trials(candidates, &of.candidates, &of.explanation), of));
    let mut compared: Vec<Explained<'_>> = vec![(&[], &findings.none)];
    compared.extend(
        of_found
            .iter()
            .map(|(trials, of)| (&trials[..], &of.explanation)),
    );
    let misfits = misfits(bench, &compared, progress)?;
    let none = replayed(bench, &findings.none, misfits[0]);
    if let (Some(i), Some(&left)) = (found, misfits.get(1)) {
        tried[i].replayed = replayed(bench, compared[1].1, left);
    }
    let [before, after] = outcome.missing;
    let is_missing = before.force.sqrt() > NOTHING || before.readings > LEAST_LEFT;
    let stopped = !outcome.untried.is_empty();
    // One more replay, at half the time step. A name in a small gap requires it, and so does a
    // large gap without a missing force.
    let is_asked = if stopped {
        is_small(none) && found.is_some()
    } else {
        is_missing || found.is_some() || !is_small(none)
    };
    let own_error = if is_asked {
        let change = change_by_step(bench, &findings.none, &bench.machine.halved()?)?;
        // A replay that diverges gives no estimate.
        let finite = Some(cost(&change)).filter(|c| c.is_finite());
        finite.map_or(f64::NAN, |c| {
            RICHARDSON.powi(2) * c / bench.train.readings.max(1) as f64
        })
    } else {
        f64::NAN
    };
    Ok(Evidence {
        schema: 1,
        candidates: nameable(candidates),
        none,
        mean: Replayed {
            train: about_the_mean(&bench.train.logs),
            held_out: about_the_mean(&bench.test.logs),
        },
        repeatable: !findings.repeats.is_some_and(|r| r.scatters),
        screened: screened(plant, outcome, candidates, &tried),
        tried,
        found,
        known: place(known).filter(|_| !known.is_empty()),
        own_error,
        is_missing,
        left: after.relative_to(before),
        stopped,
    })
}
