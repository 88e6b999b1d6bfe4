//! From a study to what its result is told from, by the missing force.

use asid_core::{Layout, Progress, Result};

use crate::bench::{Bench, Explanation, Stage};
use crate::candidate::{Candidate, enumerate};
use crate::diagnose::Contact;
use crate::fit::Effort;
use crate::machine::Machine;
use crate::predict::State;
use crate::prepare::{dataset, set_reading_noise};
use crate::result::{Isolability, MissingForce, NotTried, RankedSet};
use crate::search::{Findings, Found};
use crate::starts::given_start;
use crate::study::Study;
use crate::trajectory::Trajectory;
use crate::work::Work;

use super::context::{Taken, begin};
use super::estimate::Estimate;
use super::fit::{Fitted, Hypothesis, Slopes, fit, settle_noise};
use super::initial::{from_readings, scales};
use super::picture::{dofs, forces};
use super::search::{Breadth, Outcome, Set, name_of, search};
use super::segments::cut;
use super::selection::select;
use super::touching::touching;
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
/// Physics steps of a replay of all logs for each candidate up to which machines that touch something go by whole replays: a search
/// by them takes some twenty such rounds, and a core 10^5 to 3 x 10^5 steps a second.
const AFFORDABLE: usize = 1_500_000;
/// Most sets besides the verdict's that are replayed.
const RIVALS: usize = 4;
/// Most sets that are listed with their evidence.
const RANKED: usize = 20;
/// Steps a rad that angles between effects are told in: a picture shows degrees.
const ANGLES: f64 = 1e4;

/// Diagnoses a study; gives the machine back where bodies touch and whole replays are asked for there.
///
/// # Errors
/// When a parameter cannot be set or the engine fails.
pub fn diagnose(
    study: &Study,
    machine: Machine,
    (without, contact): (&[String], Contact),
    progress: &dyn Progress,
) -> Result<std::result::Result<Work, Machine>> {
    progress.begin("smoothing the logs", 1);
    let (mut bench, nominal) = dataset(study, machine)?;
    set_reading_noise(&mut bench, &study.noise);
    let logs = bench.train.logs.clone();
    let unknowns = study.parameters.iter().zip(&nominal);
    let hypothesis = Hypothesis {
        specs: Vec::new(),
        unknowns: unknowns.map(|(p, n)| Unknown::of_study(p, *n)).collect(),
    };
    let (taken, shown) = take(study, &bench, &nominal)?;
    let segments = taken.walks.iter().any(|w| w.segment.is_some());
    let affordable = || cost_of_replays(&bench, &shown, without) < AFFORDABLE;
    if segments && (contact == Contact::Replays || contact == Contact::Auto && affordable()) {
        progress.end();
        return Ok(Err(bench.machine));
    }
    let (outcome, candidates, left_out, firsts, forces) = {
        let parameters = (&study.parameters[..], &nominal[..]);
        let (context, mut estimate) = begin(&bench.machine, &logs, taken, parameters)?;
        settle_noise(&context, &hypothesis, &nominal, &mut estimate, FIRST)?;
        let begin = (&estimate, &Slopes::default());
        let rounds = (ROUNDS, progress);
        let mut none = fit(&context, &hypothesis, &nominal, begin, rounds)?;
        if none.estimate.missing(&context).share < 1.0 {
            none.estimate.free_at_rest(&context);
            none.estimate.set_resolution(&context);
            let from = (&none.estimate, &none.slopes);
            none = fit(&context, &hypothesis, &none.theta, from, rounds)?;
        }
        progress.end();
        let shown = along(
            &bench,
            &context.walks,
            &none.theta,
            &none.estimate.trajectory,
        )?;
        let (candidates, left_out) = enumerate(&bench.machine, &shown, without);
        let outcome = search(&context, &none, &candidates, Breadth::default(), progress)?;
        let firsts = (0..context.walks.len()).filter(|&w| context.walks[w].rows[0] == 0);
        let firsts = firsts.collect::<Vec<_>>();
        let forces = forces(&context, &outcome, &candidates)?;
        (outcome, candidates, left_out, firsts, forces)
    };
    progress.begin("replaying", 1);
    let parts = (&candidates[..], &outcome);
    let (mut findings, sets) = replay(&mut bench, parts, &firsts, progress)?;
    findings.forces = forces;
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

/// What the model does along some states.
fn along(bench: &Bench, walks: &[Walk], theta: &[f64], states: &[Vec<f64>]) -> Result<Trajectory> {
    let model = bench.machine.with(&[])?;
    let plant = &bench.machine.plant;
    let values = (&bench.parameters[..], theta);
    let rows: Vec<(usize, &[usize])> = walks.iter().map(|w| (w.episode, &w.rows[..])).collect();
    Trajectory::along(&*model, plant, values, &bench.train.logs, states, &rows)
}

/// Physics steps of a replay of all training logs for each candidate.
fn cost_of_replays(bench: &Bench, shown: &Trajectory, without: &[String]) -> usize {
    let episodes = &bench.train.logs.episodes;
    let steps: usize = episodes.iter().map(|e| e.plan.physics_steps()).sum();
    steps * enumerate(&bench.machine, shown, without).0.len()
}

/// Takes the training logs within the budget, in segments where something touches; with the contacts along them.
fn take(study: &Study, bench: &Bench, nominal: &[f64]) -> Result<(Taken, Trajectory)> {
    let layout = bench.layout();
    let plant = &bench.machine.plant;
    let logs = &bench.train.logs;
    let whole = |e| Walk::new(logs, e, layout.timestep);
    let whole = within_budget((0..logs.episodes.len()).map(whole).collect(), layout.nv);
    let home = asid_core::problem::home(layout);
    let still = [&home.0[..], &home.1[..]].concat();
    let at_home =
        |walks: &[Walk]| -> Vec<Vec<f64>> { walks.iter().map(|w| still.repeat(w.len())).collect() };
    let first = from_readings(plant, logs, &whole, &at_home(&whole));
    let shown = along(bench, &whole, nominal, &first)?;
    let touches = touching(plant, logs, &shown);
    let each = whole.iter().zip(&touches);
    let walks: Vec<Walk> = each.flat_map(|(walk, t)| cut(walk, t)).collect();
    let given = |w: &Walk| {
        let episode = &study.train[w.episode].1;
        let known = w.rows[0] == 0 && episode.initial.is_some();
        known.then(|| given_start(plant, episode))
    };
    let taken = Taken {
        given: walks.iter().map(given).collect(),
        open: bench.open.clone(),
        otherwise: at_home(&walks),
        scale: scales(plant, &first),
        walks,
    };
    Ok((taken, shown))
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

/// Starts of the training episodes as a fit smoothed them, where the logs leave them open; `firsts` are the walks that begin
/// an episode.
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

/// What is missing at each degree of freedom, without effects and with those that stand; empty where all is segments.
fn missing_forces(layout: &Layout, outcome: &Outcome) -> Vec<MissingForce> {
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

/// Sets by their evidence over the model without effects: those that were fitted, then what the first screening had.
fn ranking(candidates: &[Candidate], outcome: &Outcome, fitted: &[Set]) -> Vec<RankedSet> {
    let none = outcome.none.evidence;
    let labels = |set: &[usize]| -> Vec<String> {
        let mut set = set.to_vec();
        set.sort_unstable();
        set.iter().map(|&c| candidates[c].label()).collect()
    };
    let of_fit = |set: &Set| RankedSet {
        effects: labels(&set.candidates),
        screened: None,
        fitted: Some(set.fitted.evidence - none),
    };
    let mut all: Vec<RankedSet> = fitted.iter().map(of_fit).collect();
    for (set, gain) in outcome.rounds.iter().take(1).flat_map(|r| &r.screened) {
        let effects = labels(set);
        match all.iter_mut().find(|r| r.effects == effects) {
            Some(known) => known.screened = Some(*gain),
            None => all.push(RankedSet {
                effects,
                screened: Some(*gain),
                fitted: None,
            }),
        }
    }
    all.truncate(RANKED);
    all
}

/// Principal angles between what leads in the first screening.
fn isolability(candidates: &[Candidate], outcome: &Outcome) -> Option<Isolability> {
    let (leading, cosines) = &outcome.rounds.first()?.alike;
    let n = leading.len();
    let angle = |i: usize, j: usize| {
        let angle = cosines[(i, j)].min(1.0).acos();
        (angle * ANGLES).round() / ANGLES
    };
    let row = |i: usize| (0..n).map(|j| angle(i, j)).collect();
    Some(Isolability {
        effects: leading.iter().map(|&c| candidates[c].label()).collect(),
        angles: (0..n).map(row).collect(),
    })
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
    (candidates, outcome): (&[Candidate], &Outcome),
    firsts: &[usize],
    progress: &dyn Progress,
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
        let starts = smoothed_starts(bench, fitted, firsts);
        bench.explain(0, &chosen, &fitted.theta[..study], &starts, effort)
    };
    let mut not_tried: Vec<NotTried> = (outcome.untried.iter())
        .map(|u| NotTried {
            stage: u.stage.to_owned(),
            effects: u.sets.iter().map(|s| name_of(candidates, s)).collect(),
        })
        .collect();
    let stopped = progress.is_stopped();
    let (once_more, rivals) = if stopped {
        not_tried.push(NotTried {
            stage: "fit of the values to whole replays, and replays of rivals".into(),
            effects: Vec::new(),
        });
        (Effort::LOOK, 0)
    } else {
        (Effort::BRIEF, RIVALS)
    };
    let none = of(&outcome.none, &[], once_more)?;
    let mut sets = all_sets(outcome);
    let ranking = ranking(candidates, outcome, &sets);
    let best = &outcome.best.candidates;
    let stands = sets.iter().position(|s| s.candidates == *best);
    if let Some(place) = stands {
        sets.remove(place);
        sets.insert(0, outcome.best.clone());
    }
    sets.truncate(1 + rivals);
    let mut found = Vec::new();
    for (i, set) in sets.iter().enumerate() {
        let effort = if i == 0 && stands.is_some() {
            once_more
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
        forces: Vec::new(),
        ranking,
        isolability: isolability(candidates, outcome),
        not_tried,
        screened: Vec::new(),
    };
    Ok((findings, sets))
}
