//! A diagnosis from a study to its result.

mod cost;

use asid_core::{Progress, Result};
use asid_effects::EffectSpec;
use asid_results::evidence::Evidence;

use crate::calibration::calibrate;
use crate::intake::Intake;
use crate::latent_force;
use crate::latent_force::search::Breadth;
use crate::machine::Machine;
use crate::prepare::plain_residuals;
use crate::result::{DiagnosisResult, NotTried};
use crate::study::Study;
use crate::telling::Telling;
use crate::trace::DiagnosisTrace;

pub use crate::work::Work;
use cost::final_noise;

/// Settings of a diagnosis.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    /// How widely to search, with the seed of all chance and the rate of false alarms.
    pub breadth: Breadth,
    /// Effects of the catalogue that are left out, by name.
    pub without: Vec<String>,
    /// Whether the diagnosis is repeated on simulated logs for as long as there is time.
    pub calibrate: bool,
}

/// A finished diagnosis.
pub struct Diagnosis {
    /// `result.json`.
    pub result: DiagnosisResult,
    /// What the report shows besides.
    pub trace: DiagnosisTrace,
    /// What the decision rests on.
    pub evidence: Evidence,
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
    let mut work = latent_force::pipeline::diagnose(study, machine, &settings, progress)?;
    work.findings = final_noise(&mut work.bench, study, &work.candidates, work.findings)?;
    tell(study, work, settings, progress)
}

/// Tells what was found.
fn tell(
    study: &Study,
    work: Work,
    settings: Settings,
    progress: &dyn Progress,
) -> Result<(Diagnosis, Work)> {
    progress.begin("telling", 1);
    let diagnosis = Telling {
        study,
        bench: &work.bench,
        candidates: &work.candidates,
        left_out: &work.left_out,
        findings: &work.findings,
        evidence: &work.evidence,
        judgement: &work.judgement,
        nominal: &work.nominal,
        settings,
        stopped: progress.is_stopped(),
    }
    .tell()?;
    progress.end();
    Ok((diagnosis, work))
}
