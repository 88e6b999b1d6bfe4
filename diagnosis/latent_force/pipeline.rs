//! From a study to what its result is told from, by the missing force.

mod null;
mod replays;
mod rows;
mod shooting;
mod told;

use asid_core::{Progress, Result};

use crate::bench::Bench;
use crate::candidate::enumerate;
use crate::decision::{Rules, decide};
use crate::diagnose::{Contact, Settings};
use crate::machine::Machine;
use crate::prepare::{dataset, set_reading_noise};
use crate::study::Study;
use crate::work::Work;

use super::context::begin;
use super::fit::{Hypothesis, fit};
use super::fitted_value::Unknown;
use super::left::left;
use super::picture::forces;
use super::search::{Breadth, search};
use super::segments::DURATIONS;
use super::selection::gather;
use super::steps::{beside, known, noise_with_steps, shown};

use null::Null;
use replays::replay;
use rows::{Rows, along, replays_are_affordable};
pub use shooting::Handover;
use shooting::shoot;

/// Most linearisations of the fit without effects.
const ROUNDS: usize = 15;
/// Diagnoses a study; hands it over where bodies touch and whole replays are to decide there.
///
/// # Errors
/// When a parameter cannot be set or the engine fails.
pub fn diagnose(
    study: &Study,
    machine: Machine,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<std::result::Result<Work, Handover>> {
    progress.begin("smoothing the logs", 1);
    let (without, contact) = (&settings.without[..], settings.contact);
    let breadth = Breadth {
        false_alarms: settings.false_alarms,
        seed: settings.seed,
        ..Breadth::default()
    };
    let (mut bench, nominal) = dataset(study, machine)?;
    set_reading_noise(&mut bench, &study.noise);
    let shown_steps = shown(&bench.train.logs);
    // Until the end, where gaps are told in units of the sensors' own noise.
    bench.set_noise(&noise_with_steps(&bench.train.logs));
    let logs = bench.train.logs.clone();
    let unknowns = study.parameters.iter().zip(&nominal);
    let hypothesis = Hypothesis {
        specs: Vec::new(),
        unknowns: unknowns.map(|(p, n)| Unknown::of_study(p, *n)).collect(),
    };
    let rows = Rows::of(&bench, &nominal)?;
    let affordable = || replays_are_affordable(&bench, &rows.shown, without);
    if rows.touch() && (contact == Contact::Replays || contact == Contact::Auto && false && affordable()) {
        let shot = {
            let parameters = (&study.parameters[..], &nominal[..]);
            let taken = rows.cut(study, &bench, DURATIONS[0]);
            let (context, estimate) = begin(&bench.machine, &logs, taken, parameters)?;
            shoot(&context, (&hypothesis, &nominal), estimate, progress)?
        };
        progress.end();
        return Ok(Err(Handover {
            machine: bench.machine,
            shot: Some(shot),
        }));
    }
    let (outcome, candidates, left_out, firsts, drawn, members) = {
        let null = Null {
            study,
            bench: &bench,
            rows: &rows,
            logs: &logs,
            hypothesis: &hypothesis,
            nominal: &nominal,
            progress,
        };
        let (context, mut none) = null.fit()?;
        let rounds = (ROUNDS, progress);
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
        let steps = known(&shown_steps, &candidates);
        let members: Vec<usize> = steps.iter().map(|s| s.candidate).collect();
        let offered = (&candidates[..], &members[..]);
        let outcome = search(&context, &none, offered, breadth, progress)?;
        let firsts = (0..context.walks.len()).filter(|&w| context.walks[w].rows[0] == 0);
        let firsts = firsts.collect::<Vec<_>>();
        let drawn = (
            forces(&context, &outcome, &candidates)?,
            left(&context, &outcome),
        );
        let outcome = beside(outcome, &steps, &candidates);
        (outcome, candidates, left_out, firsts, drawn, members)
    };
    progress.begin("replaying", 1);
    let parts = (&candidates[..], &outcome, &members[..]);
    let (mut findings, sets) = replay(&mut bench, parts, &firsts, progress)?;
    (findings.forces, findings.left) = drawn;
    progress.end();
    let evidence = gather(&bench, &outcome, (&sets, &members), &findings, &candidates)?;
    let judgement = decide(&evidence, &Rules::default());
    Ok(Ok(Work {
        none: vec![findings.none.clone()],
        bench,
        candidates,
        left_out,
        findings,
        evidence: Some(evidence),
        judgement,
        nominal,
    }))
}
