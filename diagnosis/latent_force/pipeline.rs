//! From a study to what its result is told from, by the missing force.

use asid_core::layout::JointKind;
use asid_core::{Layout, Progress, Result};

use crate::bench::{Bench, Explanation, Stage};
use crate::candidate::{Candidate, enumerate};
use crate::fit::Effort;
use crate::machine::Machine;
use crate::predict::State;
use crate::prepare::{dataset, set_reading_noise};
use crate::result::MissingForce;
use crate::search::{Findings, Found};
use crate::starts::given_start;
use crate::study::Study;
use crate::trajectory::Trajectory;
use crate::work::Work;

use super::estimate::{Estimate, begin};
use super::fit::{Fitted, Hypothesis, fit, settle_noise};
use super::search::{Breadth, Outcome, Set, search};
use super::selection::select;
use super::unknown::Unknown;
use super::walk::Walk;

/// Linearisations and rounds of EM of the first smoothing.
const FIRST: (usize, usize) = (4, 8);
/// Most linearisations of the fit without effects.
const ROUNDS: usize = 15;
/// Physics steps of one walk along all logs times degrees of freedom, at most, and rows of a log that are walked in any
/// case: a walk is taken once a coordinate and once a candidate, and both grow with the degrees of freedom.
const BUDGET: f64 = 72_000.0;
const FEWEST: usize = 150;
/// Physics steps of a replay of all logs times coordinates of the starts that they leave open up to which starts are fitted
/// once more with the values; beyond it they stay as smoothed.
const REPLAYED: usize = 500_000;
/// Most sets besides the verdict's that are replayed.
const RIVALS: usize = 4;

/// Whether anything touches in some row: there the method is not for the machine, whose contact forces would pass for noise.
fn touches(shown: &Trajectory) -> bool {
    let mut episodes = shown.episodes.iter();
    episodes.any(|e| e.contact.iter().any(|f| *f > 0.0))
}

/// Diagnoses a study; gives the machine back where it is one for another method.
///
/// # Errors
/// When a parameter cannot be set or the engine fails.
pub fn diagnose(
    study: &Study,
    machine: Machine,
    without: &[String],
    progress: &dyn Progress,
) -> Result<std::result::Result<Work, Machine>> {
    progress.begin("smoothing the logs", 1);
    let (mut bench, nominal) = dataset(study, machine)?;
    set_reading_noise(&mut bench, &study.noise);
    let layout = bench.layout().clone();
    let logs = bench.train.logs.clone();
    let walks = within_budget(
        (0..logs.episodes.len())
            .map(|e| Walk::new(&logs, e, layout.timestep))
            .collect(),
        layout.nv,
    );
    let given: Vec<Option<State>> = study
        .train
        .iter()
        .map(|(_, e)| {
            e.initial
                .as_ref()
                .map(|_| given_start(&bench.machine.plant, e))
        })
        .collect();
    let home = asid_core::problem::home(&layout);
    let still = [&home.0[..], &home.1[..]].concat();
    let otherwise: Vec<Vec<f64>> = walks.iter().map(|w| still.repeat(w.len())).collect();
    let unknowns = study.parameters.iter().zip(&nominal);
    let hypothesis = Hypothesis {
        specs: Vec::new(),
        unknowns: unknowns.map(|(p, n)| Unknown::of_study(p, *n)).collect(),
    };
    let searched = {
        let (context, mut estimate) = begin(
            &bench.machine,
            &logs,
            walks,
            (given, bench.open.clone()),
            (&study.parameters, &nominal),
            &otherwise,
        )?;
        let model = bench.machine.with(&[])?;
        let rows: Vec<&[usize]> = context.walks.iter().map(|w| &w.rows[..]).collect();
        let along = |theta: &[f64], states: &[Vec<f64>]| {
            let values = (&study.parameters[..], theta);
            Trajectory::along(&*model, &bench.machine.plant, values, &logs, states, &rows)
        };
        if touches(&along(&nominal, &estimate.trajectory)?) {
            None
        } else {
            settle_noise(&context, &hypothesis, &nominal, &mut estimate, FIRST)?;
            let first = fit(&context, &hypothesis, &nominal, &estimate, ROUNDS)?;
            let mut estimate = first.estimate;
            estimate.free_at_rest(&context);
            estimate.set_resolution(layout.nv);
            let none = fit(&context, &hypothesis, &first.theta, &estimate, ROUNDS)?;
            progress.end();
            let shown = along(&none.theta, &none.estimate.trajectory)?;
            let (candidates, left_out) = enumerate(&bench.machine, &shown, without);
            let outcome = search(&context, &none, &candidates, Breadth::default(), progress)?;
            Some((outcome, candidates, left_out))
        }
    };
    let Some((outcome, candidates, left_out)) = searched else {
        progress.end();
        return Ok(Err(bench.machine));
    };
    progress.begin("replaying", 1);
    let (findings, sets) = replay(&mut bench, &candidates, &outcome)?;
    progress.end();
    let judgement = select(&bench, &outcome, &sets, &findings, &candidates);
    Ok(Ok(Work {
        none: vec![findings.none.clone()],
        bench,
        candidates,
        left_out,
        findings,
        judgement,
        nominal,
    }))
}

/// The first rows of each walk, as many as the budget of physics steps allows: a screening takes all of them once a column.
fn within_budget(walks: Vec<Walk>, nv: usize) -> Vec<Walk> {
    let steps: usize = walks.iter().flat_map(|w| &w.substeps).sum();
    let share = BUDGET / (steps.max(1) * nv.max(1)) as f64;
    if share >= 1.0 {
        return walks;
    }
    let part = |w: &Walk| {
        let rows = (share * w.len() as f64).round() as usize;
        w.part(0..rows.max(FEWEST).min(w.len()))
    };
    walks.iter().map(part).collect()
}

/// Starts of the training episodes as a fit smoothed them, where the logs leave them open.
fn smoothed_starts(bench: &Bench, fitted: &Fitted) -> Vec<State> {
    let layout = bench.layout();
    let width = layout.nq + layout.nv;
    if bench.open.is_empty() {
        return bench.train.starts.clone();
    }
    fitted
        .estimate
        .trajectory
        .iter()
        .map(|states| State {
            qpos: states[..layout.nq].to_vec(),
            qvel: states[layout.nq..width].to_vec(),
        })
        .collect()
}

/// What is missing at each degree of freedom, without effects and with those that stand.
fn missing_forces(layout: &Layout, outcome: &Outcome) -> Vec<MissingForce> {
    let (before, after) = (&outcome.none.estimate, &outcome.best.fitted.estimate);
    let deviation = |e: &Estimate, d: usize| (e.noise.q[d] + e.noise.white[d]).sqrt();
    let dofs = layout.joints.iter().flat_map(|joint| {
        let axes: &[(&str, &str)] = match joint.kind {
            JointKind::Slide => &[("", "N")],
            JointKind::Hinge => &[("", "N m")],
            JointKind::Ball => &[(".rx", "N m"), (".ry", "N m"), (".rz", "N m")],
            JointKind::Free => &[
                (".x", "N"),
                (".y", "N"),
                (".z", "N"),
                (".rx", "N m"),
                (".ry", "N m"),
                (".rz", "N m"),
            ],
        };
        axes.iter()
            .map(|(axis, unit)| (format!("{}{axis}", joint.name), *unit))
    });
    dofs.enumerate()
        .map(|(d, (dof, unit))| MissingForce {
            dof,
            unit: unit.to_owned(),
            identified: deviation(before, d),
            refined: deviation(after, d),
            correlation_time: before.noise.tau[d],
        })
        .collect()
}

/// All sets that were fitted, each once, the most evident first.
fn all_sets(outcome: &Outcome) -> Vec<Set> {
    let mut sets: Vec<Set> = Vec::new();
    for set in outcome.rounds.iter().flat_map(|r| &r.confirmed) {
        let mut members = set.candidates.clone();
        members.sort_unstable();
        let same = |s: &&mut Set| {
            let mut other = s.candidates.clone();
            other.sort_unstable();
            other == members
        };
        match sets.iter_mut().find(same) {
            Some(known) if known.fitted.evidence < set.fitted.evidence => *known = set.clone(),
            Some(_) => {}
            None => sets.push(set.clone()),
        }
    }
    sets.sort_by(|a, b| b.fitted.evidence.total_cmp(&a.fitted.evidence));
    sets
}

/// Replays the model without effects, the set that stands and its nearest rivals, open loop; with the sets behind the
/// findings.
fn replay(
    bench: &mut Bench,
    candidates: &[Candidate],
    outcome: &Outcome,
) -> Result<(Findings, Vec<Set>)> {
    let episodes = &bench.train.logs.episodes;
    let steps: usize = episodes.iter().map(|e| e.plan.physics_steps()).sum();
    bench.stages = vec![Stage {
        record: bench.train.clone(),
        episodes: (0..episodes.len()).collect(),
        open: if steps * bench.fitted.len() > REPLAYED {
            Vec::new()
        } else {
            bench.fitted.clone()
        },
    }];
    let study = bench.parameters.len();
    let of = |fitted: &Fitted, members: &[usize], effort: Effort| -> Result<Explanation> {
        let mut at = study;
        let chosen: Vec<_> = members
            .iter()
            .map(|&c| {
                let n = candidates[c].parameters().len();
                let values = fitted.theta[at..at + n].to_vec();
                at += n;
                (&candidates[c], values)
            })
            .collect();
        let starts = smoothed_starts(bench, fitted);
        bench.explain(0, &chosen, &fitted.theta[..study], &starts, effort)
    };
    let none = of(&outcome.none, &[], Effort::BRIEF)?;
    let mut sets = all_sets(outcome);
    let best = &outcome.best.candidates;
    let stands = sets.iter().position(|s| s.candidates == *best);
    if let Some(place) = stands {
        sets.remove(place);
        sets.insert(0, outcome.best.clone());
    }
    sets.truncate(1 + RIVALS);
    let mut found = Vec::new();
    for (i, set) in sets.iter().enumerate() {
        let effort = if i == 0 && stands.is_some() {
            Effort::BRIEF
        } else {
            Effort::LOOK
        };
        found.push(Found {
            candidates: set.candidates.clone(),
            explanation: of(&set.fitted, &set.candidates, effort)?,
        });
    }
    let findings = Findings {
        none,
        short: None,
        found,
        missing: missing_forces(bench.layout(), outcome),
        screened: Vec::new(),
    };
    Ok((findings, sets))
}
