//! Collects the evidence for the decision from a search by the missing force.

use std::collections::BTreeSet;

use asid_core::{Progress, Result};
use asid_mjcf::Plant;
use asid_results::evidence::{Evidence, Fitted, Replayed, Screened, Tried};

use crate::bench::held_out::{Explained, misfits};
use crate::bench::{Bench, Explanation};
use crate::candidate::{Candidate, nameable};
use crate::checks::{RICHARDSON, change_by_step};
use crate::decision::is_small;
use crate::findings::{Findings, trials};
use crate::fit::cost;
use crate::skill::about_the_mean;

use super::estimate::{LEAST_LEFT, NOTHING};
use super::search::{Outcome, Set, labels_of, log_prior, refined_by};

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

/// Sets that were screened upon a base and never fitted, in any round.
///
/// Their evidence is relative to the model without effects, to first order, and includes prior
/// odds. As all fitted sets do, they contain the `known` candidates.
fn screened(
    plant: &Plant,
    outcome: &Outcome,
    (candidates, known): (&[Candidate], &[usize]),
    tried: &[Tried],
) -> Vec<Screened> {
    let none = outcome.none.evidence;
    let effects = |set: &[usize]| {
        let others = set.iter().filter(|c| !known.contains(c));
        let all: Vec<usize> = others.chain(known).copied().collect();
        labels(candidates, &all)
    };
    let confirmed = || outcome.rounds.iter().flat_map(|r| &r.confirmed);
    let raced = outcome.rounds.iter().flat_map(|r| &r.raced);
    let mut fitted: BTreeSet<Vec<String>> = raced.map(|set| effects(set)).collect();
    fitted.extend(confirmed().map(|set| effects(&set.candidates)));
    fitted.extend(tried.iter().map(|t| t.effects.clone()));
    let mut all: Vec<Screened> = Vec::new();
    for round in &outcome.rounds {
        // The fitted base: the model without effects, or a set of an earlier round.
        let own = |set: &Set| -> Vec<usize> {
            let own = set.candidates.iter().filter(|c| !known.contains(c));
            own.copied().collect()
        };
        let base = confirmed().find(|set| own(set) == round.base);
        let evidence = base.map_or(none, |set| set.fitted.evidence);
        let prior = log_prior(plant, candidates, &[&round.base[..], known].concat());
        for seen in &round.screened {
            // A finer law takes the place of the simpler one.
            let finer = seen.set.iter();
            let simpler: Vec<usize> = finer.filter_map(|&c| refined_by(candidates, c)).collect();
            let stay = round.base.iter().filter(|c| !simpler.contains(c));
            let stay: Vec<usize> = stay.chain(known).copied().collect();
            let names = base.map_or(0, |set| set.names.among(&stay).count());
            all.push(Screened {
                effects: effects(&[&stay[..], &seen.set].concat()),
                names: names + seen.names,
                evidence: evidence - none + seen.gain + prior,
            });
        }
    }
    all.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    // Of sets with the same effects the most evident one is kept.
    all.retain(|s| fitted.insert(s.effects.clone()));
    all.truncate(SCREENED);
    all
}

/// What the decision needs of a fitted set.
fn of_fit(plant: &Plant, outcome: &Outcome, candidates: &[Candidate], set: &Set) -> Fitted {
    let prior = log_prior(plant, candidates, &set.candidates);
    Fitted {
        effects: labels(candidates, &set.candidates),
        names: set.names.count(),
        evidence: set.fitted.evidence - outcome.none.evidence + prior,
        prior,
    }
}

/// Sets that were fitted in any round and not replayed, apart from those that name nothing.
///
/// Without a replay they are no verdict, and they take their share of the probability.
fn fitted(
    plant: &Plant,
    outcome: &Outcome,
    candidates: &[Candidate],
    tried: &[Tried],
) -> Vec<Fitted> {
    let confirmed = outcome.rounds.iter().flat_map(|r| &r.confirmed);
    let mut all: Vec<Fitted> = confirmed
        .map(|set| of_fit(plant, outcome, candidates, set))
        .collect();
    all.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    let mut seen: BTreeSet<Vec<String>> = tried.iter().map(|t| t.effects.clone()).collect();
    seen.insert(Vec::new());
    // Of sets with the same effects the most evident one is kept.
    all.retain(|f| f.evidence.is_finite() && seen.insert(f.effects.clone()));
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
            let of = of_fit(plant, outcome, candidates, set);
            Tried {
                effects: of.effects,
                names: of.names,
                evidence: of.evidence,
                prior: of.prior,
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
        fitted: fitted(plant, outcome, candidates, &tried),
        screened: screened(plant, outcome, (candidates, known), &tried),
        tried,
        found,
        known: place(known).filter(|_| !known.is_empty()),
        own_error,
        is_missing,
        left: after.relative_to(before),
        stopped,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::tests::plant;
    use crate::latent_force::search::by_hand::{candidate, outcome, round, set};

    /// Dry friction, friction that falls with the speed, viscous friction, a bias, and steps.
    fn candidates() -> Vec<Candidate> {
        let labels = [
            "coulomb-friction@slide",
            "stribeck-friction@slide",
            "viscous-friction@slide",
            "sensor-bias@place",
            "sensor-quantization@place",
        ];
        labels.map(candidate).into()
    }

    /// Symptom: sets that were fitted had a share of the probability as sets that never were, one
    /// of them with dry friction beside the law that refines it. Cause: a screened set was compared
    /// with the fits of its own round, and the finer law was added to the simpler one.
    #[test]
    fn what_was_fitted_in_any_round_is_not_told_as_screened_only() {
        let candidates = candidates();
        let fitted = |names: &[&[usize]], evidence| set(&candidates, (names, &[]), evidence);
        let [dry, bias, both] = [
            fitted(&[&[0]], 50.0),
            fitted(&[&[3]], 40.0),
            fitted(&[&[0], &[2]], 57.0),
        ];
        let rounds = vec![
            round(
                &[],
                &[(&[0], 50.0), (&[2], 20.0), (&[0, 2], 60.0)],
                (&[&[0], &[2]], vec![dry, bias]),
            ),
            round(
                &[0],
                &[(&[1], 5.0), (&[2], 8.0), (&[3], 3.0)],
                (&[&[1]], vec![both.clone()]),
            ),
            round(&[3], &[(&[0], 10.0)], (&[], Vec::new())),
        ];
        let found = screened(&plant(), &outcome(rounds, both), (&candidates, &[]), &[]);
        // Two rounds saw the same set, once with less evidence.
        let [rest] = &found[..] else {
            panic!("{found:?}")
        };
        assert_eq!(
            rest.effects,
            ["coulomb-friction@slide", "sensor-bias@place"]
        );
        assert_eq!((rest.names, rest.evidence), (2, 53.0));
    }

    /// Symptom: beside the steps of an encoder, sets that were screened later lost the evidence of
    /// their base. Cause: every fitted set has the steps, and the base of a round does not.
    #[test]
    fn screened_sets_have_the_known_steps_as_fitted_ones_do() {
        let candidates = candidates();
        let fitted = |names: &[&[usize]], evidence| set(&candidates, (names, &[]), evidence);
        let [dry, steps] = [fitted(&[&[0], &[4]], 850.0), fitted(&[&[4]], 800.0)];
        let rounds = vec![
            round(
                &[],
                &[(&[0], 50.0), (&[2], 20.0)],
                (&[&[0]], vec![dry.clone(), steps]),
            ),
            round(&[0], &[(&[3], 3.0)], (&[], Vec::new())),
        ];
        let found = screened(&plant(), &outcome(rounds, dry), (&candidates, &[4]), &[]);
        let told: Vec<(usize, usize, f64)> = found
            .iter()
            .map(|s| (s.effects.len(), s.names, s.evidence))
            .collect();
        assert_eq!(told, [(3, 3, 853.0), (2, 2, 820.0)]);
    }
}
