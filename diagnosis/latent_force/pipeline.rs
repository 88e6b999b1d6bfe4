//! The whole diagnosis by the missing force: from a study to the input of the report.

mod begin_values;
mod known_replays;
mod replays;
mod rows;
mod told;
mod without_effects;

use asid_core::{Error, Progress, Result};

use crate::candidate::{Candidate, LeftOut, enumerate};
use crate::ceiling::Left;
use crate::decision::{Rules, decide};
use crate::explained_noise::with_slow_noise;
use crate::findings::Repeats;
use crate::machine::Machine;
use crate::prepare::{dataset, set_reading_noise};
use crate::settings::Settings;
use crate::study::Study;
use crate::trace::ForceTrace;
use crate::work::Work;

use super::context::Context;
use super::fit::{Fitted, Hypothesis, fit};
use super::fitted_value::Unknown;
use super::half_step::step_error;
use super::left::left;
use super::picture::forces;
use super::search::{OpenLoop, Outcome, Set, search, with_own_steps};
use super::segments::firsts;
use super::selection::gather;
use super::steps::{Shown, beside, known, noise_with_steps, shown};

use begin_values::begin_values;
use known_replays::KnownReplays;
use replays::{Replays, replay};
use rows::{Rows, along};
use without_effects::{Null, Stands};

/// Most linearisations of the fit without effects.
const ROUNDS: usize = 15;

/// Excess power, relative to that without effects, from which on a remainder is most of the gap:
/// half, as in the decision ([`crate::decision`]).
const MOST: f64 = 0.5;

/// What is kept of a search once its logs are released.
struct Searched {
    outcome: Outcome,
    candidates: Vec<Candidate>,
    left_out: Vec<LeftOut>,
    /// Candidates that the logs show directly, without a search.
    members: Vec<usize>,
    /// Walks that begin an episode.
    firsts: Vec<usize>,
    repeats: Option<Repeats>,
    /// Excess power that replays of the set that stands leave of the training logs, and whether
    /// that is most of a gap that exists without effects.
    excess: f64,
    leaves_most: bool,
    /// The missing force along the logs, and what is left of it.
    drawn: (Vec<ForceTrace>, Vec<Left>),
}

impl Searched {
    /// This result, or the one before it if that leaves no more.
    fn or(self, before: Option<Self>) -> Self {
        match before {
            Some(before) if before.excess <= self.excess => before,
            _ => self,
        }
    }
}

/// Fits the model without effects, and searches for effects.
///
/// Where bodies touch, a small force shows the more the longer it acts. So the search uses the
/// longest segments whose replays can be repeated. It tries in this order:
///
/// 1. Whole logs: for a ball whose spin no sensor reads, they keep the spin of the throw.
/// 2. The longest stretches of contact.
/// 3. The shortest segments, whose replays are nearly linear in the initial state.
/// 4. Whole logs whose derivatives mislead.
///
/// Each is searched only if replays of whole logs still leave most of the gap with the answer
/// before it. The answer that leaves least stands.
fn searched(null: Null<'_>, shown_steps: &[Shown], settings: &Settings) -> Result<Searched> {
    let how = (shown_steps, settings);
    let mut short = null.shortest()?;
    if !short.context.has_segments() || !leaves_a_gap(null, &short)? {
        return searched_in(null, &mut short, how);
    }
    let is_open = |found: &Searched| found.leaves_most && !null.progress.is_stopped();
    let mut whole = null.whole(&short)?;
    let mut found = match &mut whole {
        Some((whole, false)) => Some(searched_in(null, whole, how)?),
        _ => None,
    };
    let mut long = None;
    if found.as_ref().is_none_or(is_open) {
        long = null.longer(&mut short)?;
    }
    let repeats = long.as_ref().unwrap_or(&short).repeats;
    for stands in [long, Some(short)].iter_mut().flatten() {
        if found.as_ref().is_none_or(is_open) {
            let other = searched_in(null, stands, how)?;
            found = Some(Searched { repeats, ..other }.or(found));
        }
    }
    if let Some((mut whole, true)) = whole
        && found.as_ref().is_none_or(is_open)
    {
        found = Some(searched_in(null, &mut whole, how)?.or(found));
    }
    found.ok_or_else(|| Error::Failed("no segments were searched".into()))
}

/// Whether replays of whole logs with the model without effects leave a gap.
fn leaves_a_gap(null: Null<'_>, stands: &Stands<'_>) -> Result<bool> {
    let replays = Replays {
        bench: null.bench,
        candidates: &[],
        firsts: &firsts(&stands.context.walks),
        open: Vec::new(),
        known: KnownReplays::default(),
        progress: null.progress,
    };
    replays.leaves_a_gap(&stands.none)
}

/// Searches for effects with a fitted model without effects, in the segments that it was fitted in.
fn searched_in(
    null: Null<'_>,
    stands: &mut Stands<'_>,
    (shown_steps, settings): (&[Shown], &Settings),
) -> Result<Searched> {
    let Null {
        bench, progress, ..
    } = null;
    let none = without_steps(null, stands)?;
    let context = &stands.context;
    let firsts = firsts(&context.walks);
    let none = led_by_replays(null, context, none, &firsts)?;
    progress.end();
    let states = &none.estimate.trajectory;
    let shown = along(bench, &context.walks, &none.theta, states)?;
    let offered = (&settings.without[..], &bench.parameters[..]);
    let (candidates, left_out) = enumerate(&bench.machine, &shown, offered);
    let steps = known(shown_steps, &candidates);
    let members: Vec<usize> = steps.iter().map(|s| s.candidate).collect();
    let offered = (&candidates[..], &members[..]);
    let replays = Replays {
        bench,
        candidates: &candidates,
        firsts: &firsts,
        open: Vec::new(),
        known: KnownReplays::default(),
        progress,
    };
    let excess = |set: &Set| replays.excess(&set.fitted, &set.candidates);
    let residuals = |set: &Set| replays.residuals(&set.fitted, &set.candidates);
    let as_logged = |set: &Set| replays.as_logged(&set.fitted, &set.candidates);
    let fitted = |set: &Set| replays.fitted(set);
    let states = |set: &Set| replays.states(&set.fitted, &set.candidates, &context.walks);
    let open_loop = OpenLoop {
        excess: &excess,
        residuals: &residuals,
        as_logged: &as_logged,
        fitted: &fitted,
        states: &states,
        steps: replays.steps(),
        is_gap: replays.leaves_a_gap(&none)?,
    };
    let how = (open_loop, progress);
    let mut outcome = search(context, &none, offered, settings.breadth, how)?;
    if let Ok(finer) = bench.machine.halved() {
        with_own_steps(context, &candidates, &finer, &mut outcome, progress)?;
    }
    let drawn = (
        forces(context, &outcome, &candidates)?,
        left(context, &outcome),
    );
    let excess = excess(&outcome.best)?;
    let without = replays.excess(&outcome.none, &[])?;
    let leaves_most = open_loop.is_gap && excess >= MOST * without;
    let outcome = beside(outcome, &steps, &candidates);
    Ok(Searched {
        outcome,
        candidates,
        left_out,
        members,
        firsts,
        repeats: stands.repeats,
        drawn,
        excess,
        leaves_most,
    })
}

/// Refits the model without effects with the fixed terms of all models that follow.
///
/// Along rows these are the engine's own error, the free forces at rest and at the start, and the
/// resolution of the missing force.
fn without_steps(null: Null<'_>, stands: &mut Stands<'_>) -> Result<Fitted> {
    let (context, none) = (&mut stands.context, &mut stands.none);
    let (bench, hypothesis) = (null.bench, null.hypothesis);
    if context.walks.iter().any(|w| w.segment.is_none())
        && let Ok(finer) = bench.machine.halved()
    {
        let (model, states) = ((hypothesis, &none.theta[..]), &none.estimate.trajectory);
        context.step_error = step_error(context, model, states, &finer)?;
    }
    let shares = none.estimate.missing(context).share < 1.0;
    if shares {
        none.estimate.free_at_rest(context);
        none.estimate.free_at_start(context);
        none.estimate.set_resolution(context);
    }
    if shares || context.step_error.columns() > 0 {
        let from = (&none.estimate, &none.slopes);
        let rounds = (ROUNDS, null.progress);
        return fit(context, hypothesis, &none.theta, from, rounds);
    }
    Ok(none.clone())
}

/// Continues the fit without effects from values fitted to replays of whole logs, if these leave
/// less than half of what the model leaves.
///
/// In segments whose derivatives mislead, a fit may end far from the study's parameters. A name
/// would then stand in for them.
fn led_by_replays(
    null: Null<'_>,
    context: &Context<'_>,
    none: Fitted,
    firsts: &[usize],
) -> Result<Fitted> {
    if !context.has_segments() || null.hypothesis.free().is_empty() {
        return Ok(none);
    }
    let replays = Replays {
        bench: null.bench,
        candidates: &[],
        firsts,
        open: Vec::new(),
        known: KnownReplays::default(),
        progress: null.progress,
    };
    let (left, fitted) = replays.fitted(&Set::without_effects(&none))?;
    if left >= (1.0 - MOST) * replays.excess(&none, &[])? {
        return Ok(none);
    }
    let from = (&none.estimate, &none.slopes.renewed());
    let rounds = (ROUNDS, null.progress);
    let again = fit(context, null.hypothesis, &fitted.fitted.theta, from, rounds)?;
    Ok(if again.evidence > none.evidence {
        again
    } else {
        none
    })
}

/// Diagnoses a study.
///
/// # Errors
/// When a parameter cannot be set or the engine fails.
pub fn diagnose(
    study: &Study,
    machine: Machine,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Work> {
    progress.begin("smoothing the logs", 1);
    let (mut bench, nominal) = dataset(study, machine)?;
    set_reading_noise(&mut bench, &study.noise);
    let shown_steps = shown(&bench.train.logs);
    // Until the end, where gaps are reported in units of the sensors' own noise.
    bench.set_noise(&noise_with_steps(&bench.train.logs));
    let logs = bench.train.logs.clone();
    let unknowns = study.parameters.iter().zip(&nominal);
    let hypothesis = Hypothesis {
        specs: Vec::new(),
        unknowns: unknowns.map(|(p, n)| Unknown::of_study(p, *n)).collect(),
    };
    let rows = Rows::of(&bench, &nominal)?;
    let null = Null {
        study,
        bench: &bench,
        rows: &rows,
        logs: &logs,
        hypothesis: &hypothesis,
        begin: &begin_values(&bench, &rows, &nominal)?,
        progress,
    };
    let found = searched(null, &shown_steps, settings)?;
    let (candidates, outcome, members) = (found.candidates, found.outcome, found.members);
    progress.begin("replaying", 1);
    let parts = (&candidates[..], &outcome, &members[..]);
    let segments = (&found.firsts[..], found.repeats);
    let (mut findings, sets) = replay(&bench, parts, segments, progress)?;
    (findings.forces, findings.left) = found.drawn;
    with_slow_noise(&mut bench, study, &candidates, &mut findings)?;
    let told = (&findings, &candidates[..]);
    let evidence = gather(&bench, &outcome, (&sets, &members), told, progress)?;
    progress.end();
    let judgement = decide(&evidence, &Rules::default());
    Ok(Work {
        bench,
        candidates,
        left_out: found.left_out,
        findings,
        evidence,
        judgement,
        nominal,
    })
}
