//! A diagnosis from a study to its result.

use asid_core::{Episode, Error, Layout, Progress, Result};
use asid_results::naming::count;

use crate::calibration::calibrate;
use crate::intake::Intake;
use crate::latent_force::budget::check_rows;
use crate::machine::Machine;
use crate::physics::diagnose_physics;
use crate::prepare::plain_residuals;
use crate::result::NotTried;
use crate::starts::open_coordinates;
use crate::study::Study;

pub use crate::settings::Settings;
pub use crate::telling::Diagnosis;
pub use crate::work::Work;

/// Largest share of the gap that the alternative wiring may leave to be accepted.
///
/// Each alternative estimates the noise for itself, and a tenth of the gap is chance.
const BETTER: f64 = 0.8;
/// Gap in units of the noise from which on the alternative wiring is tried.
///
/// The right wiring and the right effect leave the noise. Below this gap, nothing that leaves the
/// noise is better by as much.
const DOUBTFUL: f64 = 1.0 / BETTER;

/// Fewest rows of a training log, on average: a first speed needs six rows, and the noise needs
/// third differences, of four rows.
const FEWEST_ROWS: usize = 8;

/// Diagnoses a study on a machine, with outliers left out of its logs and its wiring repaired.
///
/// Where an effect can look like the repaired wiring error and a gap remains, the alternative
/// wiring is diagnosed too. The one that leaves less stands. The alternative that is more probable
/// a priori comes first.
///
/// # Errors
/// When the logs have too few rows for a diagnosis, a parameter cannot be set or a rollout fails.
pub fn diagnose(
    study: &Study,
    machine: Machine,
    settings: Settings,
    progress: &dyn Progress,
) -> Result<(Diagnosis, Work)> {
    enough_rows(study, &machine.plant.layout)?;
    check_rows(&machine.plant.layout, &study.train)?;
    progress.begin("looking at the logs", 1);
    let mut intake = Intake::of(study, &machine)?;
    progress.end();
    let (first, second) = intake.ways();
    let physics =
        |study: &Study| diagnose_physics(study, machine.clone(), settings.clone(), progress);
    let (mut diagnosis, mut work) = physics(first)?;
    let left = diagnosis.result.gap.refined;
    if let Some(second) = second
        && left > DOUBTFUL
        && !progress.is_stopped()
    {
        progress.note("the wiring taken the other way");
        let other = physics(second)?;
        if other.0.result.gap.refined < BETTER * left {
            (diagnosis, work) = other;
            intake.turn();
        }
    }
    intake.settle();
    // A clock and a zero are first estimated over short windows; whole logs determine them better.
    if let Some(short) = intake.estimated_short(&diagnosis.effects)
        && !progress.is_stopped()
    {
        progress.note("the wiring was estimated short");
        let mut further = intake.clone();
        further.mend_further(&short, &machine.plant.layout)?;
        let other = physics(&further.study)?;
        // One that was cut short replaces no complete one, unless it predicts better.
        if !progress.is_stopped() || other.0.result.gap.refined < diagnosis.result.gap.refined {
            (diagnosis, work) = other;
            intake = further;
        }
    }
    let (bench, point) = (&work.bench, &work.findings.none.fit.point);
    let residuals = plain_residuals(bench, &bench.train, &[], point)?;
    let whiteness = crate::checks::whiteness(&bench.train.logs, &residuals);
    if settings.calibrate {
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

/// Refuses logs with too few rows, and logs with no more readings than their initial states have
/// unknown coordinates.
///
/// In the latter an initial state fits the readings whatever the machine is, and the absence of a
/// gap means nothing.
///
/// # Errors
/// [`Error::Config`] for such logs; the message names the study.
pub fn enough_rows(study: &Study, layout: &Layout) -> Result<()> {
    let logs = study.train.len();
    let rows: usize = study.train.iter().map(|(_, e)| e.rows()).sum();
    let finite = |e: &Episode| e.readings.iter().filter(|x| x.is_finite()).count();
    let readings: usize = study.train.iter().map(|(_, e)| finite(e)).sum();
    let open = open_coordinates(layout, study).len();
    let message = if rows < FEWEST_ROWS * logs {
        format!(
            "{} in all, too little to tell anything: each needs {FEWEST_ROWS} at least",
            count(rows, "row")
        )
    } else if readings <= open * logs {
        format!(
            "{} in all, too little to tell anything: each needs more than the {} of its start",
            count(readings, "reading"),
            count(open, "unknown coordinate")
        )
    } else {
        return Ok(());
    };
    Err(Error::Config {
        key: "train".into(),
        message: format!(
            "study {}: {} to fit to, {message}; log longer episodes",
            study.name,
            count(logs, "log")
        ),
    })
}
