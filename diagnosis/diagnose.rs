//! A diagnosis from a study to its result.

mod cost;

use asid_core::progress::UntilLate;
use asid_core::{Progress, Result, Streams};
use asid_effects::EffectSpec;
use asid_results::evidence::Evidence;

use crate::calibration::calibrate;
use crate::candidate::{Candidate, enumerate};
use crate::confidence::{Confidence, Untried};
use crate::intake::Intake;
use crate::latent_force;
use crate::latent_force::search::FALSE_ALARMS;
use crate::machine::Machine;
use crate::prepare::{Prepared, plain_residuals, prepare};
use crate::result::{DiagnosisResult, NotTried};
use crate::search::{Breadth, Findings, Search};
use crate::study::Study;
use crate::telling::Telling;
use crate::trace::DiagnosisTrace;
use crate::trajectory::Trajectory;
use crate::verdict::judge;

pub use crate::work::Work;
use cost::{cost_scatter, final_noise};

/// How logs are taken in which bodies touch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Contact {
    /// By whole replays where one of each candidate is affordable, else in segments.
    #[default]
    Auto,
    /// By whole replays.
    Replays,
    /// In segments as long as their slopes keep their promise.
    Segments,
}

/// Settings of a diagnosis.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Seed of all chance.
    pub seed: u64,
    /// How widely to search.
    pub breadth: Breadth,
    /// Effects of the catalogue that are left out, by name.
    pub without: Vec<String>,
    /// How logs are taken in which bodies touch.
    pub contact: Contact,
    /// Rate of false alarms that the decision is made at.
    pub false_alarms: f64,
    /// Whether the diagnosis is repeated on simulated logs for as long as there is time.
    pub calibrate: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            seed: 0,
            breadth: Breadth::default(),
            without: Vec::new(),
            contact: Contact::default(),
            false_alarms: FALSE_ALARMS,
            calibrate: false,
        }
    }
}

/// A finished diagnosis.
pub struct Diagnosis {
    /// `result.json`.
    pub result: DiagnosisResult,
    /// What the report shows besides.
    pub trace: DiagnosisTrace,
    /// What the decision rests on; `None` where replays decide.
    pub evidence: Option<Evidence>,
    /// Effects of the verdict, with their values; empty for none.
    pub effects: Vec<EffectSpec>,
    /// Values of the study's parameters that go with them.
    pub values: Vec<f64>,
}

/// Gap in units of the noise from which on a verdict leaves so much that the other way to take the wiring is tried as well: the right
/// wiring and the right effect leave the noise.
const DOUBTFUL: f64 = 2.0;
/// Share of the gap that the other way must leave at most to stand: each way estimates the noise for itself, and a tenth of it is chance.
const BETTER: f64 = 0.8;

/// Diagnoses a study on a machine, with outliers left out of its logs and its wiring mended. Where an effect can look like what
/// was mended, and a gap is left all the same, the wiring is taken the other way too, and what leaves less stands. The way
/// that is more probable beforehand comes first.
///
/// # Errors
/// When a parameter cannot be set or a rollout fails.
pub fn diagnose(
    study: &Study,
    machine: Machine,
    settings: Settings,
    progress: &dyn Progress,
) -> Result<(Diagnosis, Work)> {
    progress.begin("looking at the logs", 1);
    let mut intake = Intake::of(study, &machine)?;
    progress.end();
    let (first, second) = intake.ways();
    let again = second.map(|_| (machine.clone(), settings.clone()));
    let rehearsed = (settings.calibrate).then(|| (machine.clone(), settings.clone()));
    let (mut diagnosis, mut work) = diagnose_physics(first, machine, settings, progress)?;
    let left = diagnosis.result.gap.refined;
    if let (Some((machine, settings)), Some(second)) = (again, second)
        && left > DOUBTFUL
        && !progress.is_stopped()
    {
        progress.note("the wiring taken the other way");
        let other = diagnose_physics(second, machine, settings, progress)?;
        if other.0.result.gap.refined < BETTER * left {
            (diagnosis, work) = other;
            intake.turn();
        }
    }
    intake.settle();
    let (bench, point) = (&work.bench, &work.findings.none.fit.point);
    let residuals = plain_residuals(bench, &bench.train, &[], point)?;
    let whiteness = crate::checks::whiteness(&bench.train.logs, &residuals);
    if let Some((machine, settings)) = rehearsed {
        let parts = (&diagnosis, &work);
        let found = calibrate(&intake.study, &machine, parts, &settings, progress)?;
        if found.runs == 0 {
            diagnosis.result.not_tried.push(NotTried {
                stage: "calibration: there was no time for a single run".into(),
                effects: Vec::new(),
            });
        }
        diagnosis.result.calibration = Some(found);
    }
    intake.tell(&mut diagnosis.result, whiteness);
    Ok((diagnosis, work))
}

/// Diagnoses a study whose logs are in order.
pub(crate) fn diagnose_physics(
    study: &Study,
    machine: Machine,
    settings: Settings,
    progress: &dyn Progress,
) -> Result<(Diagnosis, Work)> {
    let by_force = latent_force::pipeline::diagnose(study, machine, &settings, progress)?;
    let latent_force::pipeline::Handover { machine, shot } = match by_force {
        Ok(mut work) => {
            work.findings = final_noise(&mut work.bench, study, &work.candidates, work.findings)?;
            work.none = vec![work.findings.none.clone()];
            return tell(study, work, settings, progress);
        }
        Err(handover) => handover,
    };
    let streams = Streams::new(settings.seed);
    // A search by replays has fitted its values.
    let until_late = UntilLate(progress);
    let progress: &dyn Progress = &until_late;
    progress.begin("fitting the study's parameters", 1);
    let Prepared {
        mut bench,
        none,
        nominal,
        mut scatter,
        is_whole,
    } = prepare(study, (machine, shot), streams.stream("scatter"), progress)?;
    progress.end();
    let last = &none[none.len() - 1];
    let model = bench.machine.with(&[])?;
    let shown = Trajectory::of(
        &*model,
        &bench.machine.plant,
        &bench.parameters,
        &bench.train.logs,
        &last.fit.point,
        bench.machine.threads,
    )?;
    let (candidates, left_out) = enumerate(&bench.machine, &shown, &settings.without);
    let findings = if is_whole {
        Findings::without_search(last.clone())
    } else {
        Search {
            bench: &mut bench,
            scatter: &mut scatter,
            candidates: &candidates,
            breadth: settings.breadth,
            progress,
        }
        .run(&none)?
    };
    let findings = final_noise(&mut bench, study, &candidates, findings)?;
    let scatter = cost_scatter(&bench, &findings.none)?;
    let chance = (candidates.len(), settings.false_alarms);
    let mut judgement = judge(&bench, &findings, chance, scatter);
    let best = judgement
        .best_explanation()
        .found
        .map(|i| &findings.found[i].explanation);
    let left = best.unwrap_or(&findings.none).held_plain / bench.held_readings().max(1.0);
    let seen = (left, !findings.not_tried.is_empty());
    let confidence = Confidence::default();
    let untried = untried(&findings, &candidates, &confidence);
    confidence.settle(&mut judgement, seen, &untried);
    let work = Work {
        bench,
        candidates,
        left_out,
        findings,
        none,
        evidence: None,
        judgement,
        nominal,
    };
    tell(study, work, settings, progress)
}

/// What the replay search screened and never fitted, by how near its cost is to the least.
fn untried(findings: &Findings, candidates: &[Candidate], confidence: &Confidence) -> Vec<Untried> {
    let is_fitted = |c: usize| findings.found.iter().any(|f| f.candidates == [c]);
    let screened = || findings.screened.iter();
    let least = screened().map(|s| s.cost).fold(f64::INFINITY, f64::min);
    let unfitted = screened().filter(|s| !is_fitted(s.candidate));
    let untried = unfitted.map(|s| Untried {
        labels: vec![candidates[s.candidate].label()],
        weight: confidence.passes(least / s.cost),
    });
    untried.collect()
}

/// Tells what was found.
fn tell(
    study: &Study,
    work: Work,
    settings: Settings,
    progress: &dyn Progress,
) -> Result<(Diagnosis, Work)> {
    progress.begin("telling", 1);
    let mut diagnosis = Telling {
        study,
        bench: &work.bench,
        candidates: &work.candidates,
        left_out: &work.left_out,
        findings: &work.findings,
        judgement: &work.judgement,
        nominal: &work.nominal,
        settings,
        stopped: progress.is_stopped(),
    }
    .tell()?;
    diagnosis.evidence = work.evidence.clone();
    progress.end();
    Ok((diagnosis, work))
}
