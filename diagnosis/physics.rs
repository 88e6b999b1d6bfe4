//! A diagnosis of logs with correct wiring: what the machine does that its model does not.

use asid_core::{Progress, Result};

use crate::explained_noise::with_noise_left;
use crate::latent_force;
use crate::machine::Machine;
use crate::settings::Settings;
use crate::study::Study;
use crate::telling::{Diagnosis, Telling};
use crate::work::Work;

/// Diagnoses a study whose logs are in order.
pub(crate) fn diagnose_physics(
    study: &Study,
    machine: Machine,
    settings: Settings,
    progress: &dyn Progress,
) -> Result<(Diagnosis, Work)> {
    let mut work = latent_force::pipeline::diagnose(study, machine, &settings, progress)?;
    with_noise_left(&mut work.bench, study, &mut work.findings);
    tell(study, work, settings, progress)
}

/// Turns what was found into a result.
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
