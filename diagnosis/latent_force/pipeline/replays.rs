//! Open-loop replays of the model without effects, of the set that stands and of its rivals.

use std::collections::BTreeSet;
use std::sync::Arc;

use asid_core::progress::UntilLate;
use asid_core::{Progress, Result};
use asid_effects::EffectSpec;
use nalgebra::{DMatrix, DVector};

use crate::bench::{Bench, Explanation, Local, Trial};
use crate::candidate::Candidate;
use crate::findings::{Findings, Found, LEAST_GAP, Repeats};
use crate::fit::{Begin, Effort, Region, StartSlopes, cost, fit};
use crate::latent_force::fit::Fitted;
use crate::latent_force::search::{Outcome, Set, labels_of, name_of};
use crate::latent_force::walk::Walk;
use crate::predict::{Point, State};
use crate::result::NotTried;
use crate::trajectory::Trajectory;

use super::known_replays::KnownReplays;
use super::told::{detection_limits, isolability, missing_forces, p_value, ranking};

/// Limit of the physics steps of a replay of all logs times the open coordinates of the initial
/// states.
///
/// Up to this limit, initial states are fitted once more with the values. Beyond it they stay as
/// smoothed.
const REPLAYED: usize = 500_000;
/// Most rivals that are replayed.
const RIVALS: usize = 4;
/// Difference of evidence, in nats, up to which two sets always count as equal.
const LEVEL: f64 = 1.0;

/// Initial states of the training episodes: as smoothed by a fit if the logs leave them open,
/// otherwise as the logs give them.
///
/// `firsts` are the walks that begin an episode.
fn smoothed_starts(bench: &Bench, fitted: &Fitted, firsts: &[usize]) -> Vec<State> {
    let layout = bench.layout();
    let width = layout.nq + layout.nv;
    if bench.open.is_empty() {
        return bench.train.starts.clone();
    }
    let state = |states: &Vec<f64>| State {
        qpos: states[..layout.nq].to_vec(),
        qvel: states[layout.nq..width].to_vec(),
    };
    let trajectory = &fitted.estimate.trajectory;
    firsts.iter().map(|&w| state(&trajectory[w])).collect()
}

/// Region of the values that a fit considers possible.
///
/// Its covariance about the posterior mean is that of the posterior, plus the outer product of the
/// distance from the present values to that mean. `None` for a set that was enlarged and not fitted
/// yet.
fn region(fitted: &Fitted) -> Option<Region> {
    let places = fitted.hypothesis.free();
    if places.len() != fitted.ahead.len() {
        return None;
    }
    let ahead = DVector::from_column_slice(&fitted.ahead);
    let mean = places.iter().zip(&fitted.ahead);
    let mean = mean.map(|(&i, ahead)| fitted.theta[i] + ahead).collect();
    let covariance = &fitted.covariance + &ahead * ahead.transpose();
    Region::new(places, mean, covariance)
}

/// All fitted sets, one for each set of names, in descending order of evidence.
///
/// The set that stands is one of them, whether or not it was fitted in a round. The set of the
/// `known` candidates, if there are any, is always among them, even if another set
/// has the same names beside tolerances.
fn all_sets(outcome: &Outcome, candidates: &[Candidate], known: &[usize]) -> Vec<Set> {
    let mut sets: Vec<Set> = Vec::new();
    let named = |set: &Set| {
        let mut members = labels_of(candidates, &set.candidates);
        members.sort_unstable();
        (!known.is_empty() && set.candidates == known, members)
    };
    let stands = |set: &Set| set.candidates == outcome.best.candidates;
    let best = Some(&outcome.best).filter(|set| !set.candidates.is_empty());
    let confirmed = outcome.rounds.iter().flat_map(|r| &r.confirmed);
    for set in confirmed.chain(best) {
        let members = named(set);
        match sets.iter_mut().find(|s| named(s) == members) {
            // A set with tolerances and the same set without them are the same answer.
            Some(same) if stands(set) && !stands(same) => *same = set.clone(),
            Some(same) if stands(same) && !stands(set) => {}
            Some(same) if same.fitted.evidence < set.fitted.evidence => *same = set.clone(),
            Some(_) => {}
            None => sets.push(set.clone()),
        }
    }
    sets.sort_by(|a, b| b.fitted.evidence.total_cmp(&a.fitted.evidence));
    sets
}

/// Replays of fitted sets, from their smoothed initial states.
pub(super) struct Replays<'a> {
    pub(super) bench: &'a Bench,
    pub(super) candidates: &'a [Candidate],
    /// Walks that begin an episode.
    pub(super) firsts: &'a [usize],
    /// Coordinates of the initial states that are fitted together with the values.
    pub(super) open: Vec<usize>,
    /// Replays that were made before.
    pub(super) known: KnownReplays,
    pub(super) progress: &'a dyn Progress,
}

impl Replays<'_> {
    /// Physics steps of one replay of all training logs.
    pub(super) fn steps(&self) -> usize {
        let episodes = self.bench.train.logs.episodes.iter();
        episodes.map(|e| e.plan.physics_steps()).sum()
    }

    /// Excess power per reading that replays of a fitted set leave of the training logs, in units
    /// of the noise.
    pub(super) fn excess(&self, fitted: &Fitted, members: &[usize]) -> Result<f64> {
        Ok((self.left(fitted, members)? - 1.0).max(0.0))
    }

    /// Whether the model without effects leaves a gap in the training logs or in the held-out logs.
    pub(super) fn leaves_a_gap(&self, none: &Fitted) -> Result<bool> {
        let (bench, least) = (self.bench, LEAST_GAP * LEAST_GAP);
        if self.left(none, &[])? > least {
            return Ok(true);
        }
        let (_, residuals) = bench.replay_held_out(&[], &none.theta, &bench.test.starts)?;
        let left = cost(&residuals) / bench.held_readings().max(1.0);
        // A replay that diverged leaves NaN.
        Ok(left.is_nan() || left > least)
    }

    /// Mean square that replays of a fitted set leave of the training logs, in units of the noise;
    /// infinite if a replay diverges.
    fn left(&self, fitted: &Fitted, members: &[usize]) -> Result<f64> {
        let left = cost(&self.residuals(fitted, members)?);
        Ok(if left.is_nan() { f64::INFINITY } else { left })
    }

    /// Residuals that replays of a fitted set leave of the training logs.
    ///
    /// They are in units of the noise, divided by the square root of the number of readings.
    pub(super) fn residuals(&self, fitted: &Fitted, members: &[usize]) -> Result<Vec<f64>> {
        self.residuals_at(&self.point(fitted), (fitted, members))
    }

    /// The same residuals for replays from the initial states that the logs give.
    pub(super) fn as_logged(&self, fitted: &Fitted, members: &[usize]) -> Result<Vec<f64>> {
        let point = Point {
            theta: fitted.theta.clone(),
            starts: self.bench.train.starts.clone(),
        };
        self.residuals_at(&point, (fitted, members))
    }

    fn residuals_at(
        &self,
        point: &Point,
        (fitted, members): (&Fitted, &[usize]),
    ) -> Result<Vec<f64>> {
        self.known.residuals((members, point), || {
            let bench = self.bench;
            let trials = self.trials(fitted, members);
            let mut predictor = bench.predictor(&trials, &bench.train)?;
            let residuals = predictor.residuals(std::slice::from_ref(point))?.pop();
            let mut residuals = residuals.unwrap_or_default();
            let scale = (bench.train.readings.max(1) as f64).sqrt();
            residuals.iter_mut().for_each(|r| *r /= scale);
            Ok(residuals)
        })
    }

    /// Fits the values of a set to whole replays from its smoothed initial states, and returns the
    /// excess power that is left, with the set.
    ///
    /// The covariance of the set is that of the fit times the total misfit: how far the misfit
    /// could have moved each value if all of it pulled in one direction.
    pub(super) fn fitted(&self, set: &Set) -> Result<(f64, Set)> {
        let bench = self.bench;
        let trials = self.trials(&set.fitted, &set.candidates);
        let unknowns = bench.unknowns(&trials);
        let mut predictor = bench.predictor(&trials, &bench.train)?;
        let begin = Begin::at(self.point(&set.fitted), (&self.open, &bench.reach));
        let how = (Effort::BRIEF, &UntilLate(self.progress) as &dyn Progress);
        let found = fit(&mut predictor, (bench.layout(), &unknowns), begin, how)?;
        let mut set = set.clone();
        set.fitted.theta.clone_from(&found.point.theta);
        let free = set.fitted.hypothesis.free();
        let place = |i: usize| found.free.iter().position(|&f| f == free[i]);
        let excess = (found.cost - bench.train.readings as f64).max(1.0);
        set.fitted.covariance = DMatrix::from_fn(free.len(), free.len(), |i, j| {
            let places = place(i).zip(place(j));
            places.map_or(0.0, |at| excess * found.covariance[at])
        });
        let left = found.cost / bench.train.readings.max(1) as f64 - 1.0;
        let left = if left.is_nan() {
            f64::INFINITY
        } else {
            left.max(0.0)
        };
        Ok((left, set))
    }

    /// States of a fitted set along some walks, `rows x (nq + nv)` each.
    pub(super) fn states(
        &self,
        fitted: &Fitted,
        members: &[usize],
        walks: &[Walk],
    ) -> Result<Vec<Vec<f64>>> {
        let bench = self.bench;
        let specs: Vec<EffectSpec> = (members.iter())
            .map(|&c| self.candidates[c].spec.clone())
            .collect();
        let model = bench.machine.refined(&specs)?;
        let parameters = fitted.hypothesis.parameters();
        let shown = Trajectory::of(
            &*model,
            &bench.machine.plant,
            &parameters,
            &bench.train.logs,
            &self.point(fitted),
            bench.machine.threads,
        )?;
        let layout = bench.layout();
        let along = |walk: &Walk| {
            let path = &shown.episodes[walk.episode];
            let row = |&k: &usize| {
                let place = &path.qpos[k * layout.nq..(k + 1) * layout.nq];
                let speed = &path.qvel[k * layout.nv..(k + 1) * layout.nv];
                [place, speed].concat()
            };
            walk.rows.iter().flat_map(row).collect()
        };
        Ok(walks.iter().map(along).collect())
    }

    /// Candidates of a fitted set, each with its values.
    fn trials(&self, fitted: &Fitted, members: &[usize]) -> Vec<Trial<'_>> {
        let mut at = self.bench.parameters.len();
        let with_values = |&c: &usize| {
            let n = self.candidates[c].parameters().len();
            at += n;
            (&self.candidates[c], fitted.theta[at - n..at].to_vec())
        };
        members.iter().map(with_values).collect()
    }

    /// Values of a fitted set, with its smoothed initial states.
    fn point(&self, fitted: &Fitted) -> Point {
        Point {
            theta: fitted.theta.clone(),
            starts: smoothed_starts(self.bench, fitted, self.firsts),
        }
    }

    /// Replays a fitted set of candidates, with the posterior of its values from the local fit,
    /// which allows for a missing force.
    fn of(
        &self,
        fitted: &Fitted,
        members: &[usize],
        how: (Effort, Option<&StartSlopes>),
    ) -> Result<Explanation> {
        let mut of = self.replayed(fitted, members, how)?;
        for (k, i) in fitted.hypothesis.free().into_iter().enumerate() {
            of.local[i] = Some(Local {
                mean: fitted.theta[i] + fitted.ahead[k],
                variance: fitted.covariance[(k, k)],
            });
        }
        Ok(of)
    }

    /// Replays a set of candidates at its values, with the derivatives with respect to the initial
    /// states of a similar set (`like`).
    fn replayed(
        &self,
        fitted: &Fitted,
        members: &[usize],
        (effort, like): (Effort, Option<&StartSlopes>),
    ) -> Result<Explanation> {
        let region = region(fitted);
        let begin = Begin {
            like,
            region: region.as_ref(),
            ..Begin::at(self.point(fitted), (&self.open, &self.bench.reach))
        };
        let how = (effort, &UntilLate(self.progress) as &dyn Progress);
        self.bench
            .explain(&self.trials(fitted, members), begin, how)
    }
}

/// Efforts of the fits to whole replays without effects and of the set that stands, and the number
/// of rivals to replay.
///
/// Stages that time does not allow are added to `not_tried`.
fn efforts(
    repeats: Option<Repeats>,
    progress: &dyn Progress,
    not_tried: &mut Vec<NotTried>,
) -> (Effort, Effort, usize) {
    let mut cut = |stage: &str| {
        not_tried.push(NotTried {
            stage: stage.into(),
            effects: Vec::new(),
        });
    };
    // Whole replays that cannot be repeated carry no information about values.
    let values = match repeats {
        Some(Repeats { scatters: true, .. }) => Effort::LOOK,
        _ => Effort::BRIEF,
    };
    // A stopped search fits only the values of the set that stands.
    let (of_none, rivals) = if progress.is_stopped() {
        cut("replays of rivals");
        (Effort::LOOK, 0)
    } else {
        (values, RIVALS)
    };
    let of_best = if progress.is_late() {
        cut("fit of the values to whole replays");
        Effort::LOOK
    } else {
        values
    };
    (of_none, of_best, rivals)
}

/// The sets to replay, and whether the first of them is the set that stands.
///
/// They are the set that stands, if it was fitted, `rivals` in descending order of evidence, and
/// the set of the `known` candidates. Sets that contain the one that stands are no rivals of it, and
/// come after all others.
fn replayed_sets(
    outcome: &Outcome,
    mut sets: Vec<Set>,
    (known, rivals): (&[usize], usize),
) -> (Vec<Set>, bool) {
    let best = &outcome.best.candidates;
    let stands = sets.iter().position(|s| s.candidates == *best);
    if let Some(place) = stands {
        sets.remove(place);
        sets.insert(0, outcome.best.clone());
    }
    let holds_it = |s: &Set| stands.is_some() && best.iter().all(|c| s.candidates.contains(c));
    if let Some(others) = sets.get_mut(usize::from(stands.is_some())..) {
        others.sort_by_key(holds_it);
    }
    // A twin is always a rival, even if time is out.
    let is_level = |s: &Set| (s.fitted.evidence - outcome.best.fitted.evidence).abs() < LEVEL;
    let rivals = rivals.max(usize::from(sets.get(1).is_some_and(is_level)));
    let of_known = sets.iter().position(|s| s.candidates == known);
    let of_known = of_known.filter(|i| *i > rivals).map(|i| sets.remove(i));
    sets.truncate(1 + rivals);
    sets.extend(of_known);
    (sets, stands.is_some())
}

/// Replays the model without effects, the set that stands and its nearest rivals open loop, and
/// returns the findings with the replayed sets.
///
/// The set of the `known` candidates is always among them.
pub(super) fn replay(
    bench: &Bench,
    (candidates, outcome, known): (&[Candidate], &Outcome, &[usize]),
    (firsts, repeats): (&[usize], Option<Repeats>),
    progress: &dyn Progress,
) -> Result<(Findings, Vec<Set>)> {
    let mut replays = Replays {
        bench,
        candidates,
        firsts,
        open: Vec::new(),
        known: KnownReplays::default(),
        progress,
    };
    if replays.steps() * bench.open.len() <= REPLAYED && !progress.is_stopped() {
        replays.open.clone_from(&bench.open);
    }
    let mut not_tried: Vec<NotTried> = (outcome.untried.iter())
        .map(|u| NotTried {
            stage: u.stage.to_owned(),
            effects: u.sets.iter().map(|s| name_of(candidates, s)).collect(),
        })
        .collect();
    let (of_none, of_best, rivals) = efforts(repeats, progress, &mut not_tried);
    let none = replays.of(&outcome.none, &[], (of_none, None))?;
    let mut sets = all_sets(outcome, candidates, known);
    let mut ranking = ranking(candidates, outcome, &sets);
    // With tolerances and without them it is the same answer.
    let mut listed = BTreeSet::new();
    ranking.retain(|r| listed.insert(r.effects.clone()));
    if progress.is_stopped() {
        // Derivatives with respect to tolerances take longer than those of all names.
        let best = &outcome.best.candidates;
        let is_tolerance = |&c: &usize| candidates[c].is_tolerance;
        sets.retain(|s| s.candidates == *best || !s.candidates.iter().any(is_tolerance));
    }
    let (sets, stands) = replayed_sets(outcome, sets, (known, rivals));
    // Replays without effects may be far from the logs, where derivatives differ. So only the steps
    // of the differences are shared.
    let mut like = Arc::new(StartSlopes {
        steps: none.fit.starts.steps.clone(),
        columns: Vec::new(),
    });
    let mut found: Vec<Found> = Vec::new();
    for (i, set) in sets.iter().enumerate() {
        let effort = if i == 0 && stands {
            of_best
        } else {
            Effort::LOOK
        };
        let explanation = replays.of(&set.fitted, &set.candidates, (effort, Some(&like)))?;
        if i == 0 {
            like = Arc::clone(&explanation.fit.starts);
        }
        found.push(Found {
            candidates: set.candidates.clone(),
            explanation,
        });
    }
    let findings = Findings {
        none,
        found,
        missing: missing_forces(bench.layout(), outcome),
        forces: Vec::new(),
        ranking,
        isolability: isolability(candidates, outcome),
        detection_limits: detection_limits(candidates, outcome),
        p_value: p_value(outcome),
        left: Vec::new(),
        repeats,
        not_tried,
    };
    Ok((findings, sets))
}

#[cfg(test)]
mod tests {
    use crate::latent_force::search::by_hand::{candidate, outcome, round, set, tolerance};

    use super::*;

    /// Symptom: with the steps of a coarse encoder beside tolerances the verdict was `none`. Cause:
    /// the steps alone have the same names, and were left out as the same answer.
    #[test]
    fn known_steps_are_a_set_of_their_own_beside_tolerances_with_them() {
        let candidates = [candidate("sensor-quantization@q"), tolerance("mass@cart")];
        let beside = set(&candidates, (&[&[0]], &[1]), 830.0);
        let alone = set(&candidates, (&[&[0]], &[]), 800.0);
        let fits = vec![beside.clone(), alone];
        let outcome = outcome(vec![round(&[], &[], (&[], fits))], beside);
        let sets = all_sets(&outcome, &candidates, &[0]);
        let members: Vec<&[usize]> = sets.iter().map(|s| &s.candidates[..]).collect();
        assert_eq!(members, [&[0, 1][..], &[0]]);
        let (replayed, stands) = replayed_sets(&outcome, sets, (&[0], 0));
        assert!(stands && replayed.len() == 2);
        // A search that knows no steps gives one answer for one set of names.
        assert_eq!(all_sets(&outcome, &candidates, &[]).len(), 1);
    }

    /// Symptom: a search ended with a name, and the verdict was `unknown`. Cause: the set that
    /// stands was looked for among the fits of the rounds. This one had been fitted between two
    /// rounds, without a name of a trial base that it does not need.
    #[test]
    fn the_set_that_stands_is_replayed_wherever_it_was_fitted() {
        let candidates = ["actuator-delay@m", "sensor-drift@q"].map(candidate);
        let fitted = |names: &[&[usize]], evidence| set(&candidates, (names, &[]), evidence);
        let rounds = vec![
            round(&[], &[], (&[], vec![fitted(&[&[0]], 60.0)])),
            round(&[0], &[], (&[], vec![fitted(&[&[0], &[1]], 190.0)])),
        ];
        let outcome = outcome(rounds, fitted(&[&[1]], 180.0));
        let sets = all_sets(&outcome, &candidates, &[]);
        let (replayed, stands) = replayed_sets(&outcome, sets, (&[], 4));
        assert!(stands && replayed[0].candidates == [1]);
        assert_eq!(replayed.len(), 3);
    }
}
