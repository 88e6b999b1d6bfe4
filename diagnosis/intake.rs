//! Prepares logs before any physics: leaves out outliers, skips dead sensors, corrects the wiring,
//! and reports all of it.

mod absent;
mod estimated_short;
mod open_loop;
mod share_left;
mod unchanging;
mod wiring_check;

use asid_core::Result;
use asid_logs::episode::ColumnMapping;

use crate::machine::Machine;
use crate::outliers::{self, LeftOut};
use crate::result::{CheckResult, DiagnosisResult, WiringResult};
use crate::study::Study;
use crate::wiring::{self, OfSomeLogs, Settings};

pub use absent::{Absent, absent};
pub use estimated_short::Short;
use share_left::share_left;
pub use unchanging::{Unchanging, pass_over};
use wiring_check::{in_words, of_some_logs};

/// Share of the residual power up to which corrected wiring is the more probable cause.
///
/// The power is that of replays of the model as given, as a geometric mean over the columns
/// concerned. Below this share the remainder is less than what the fault explains.
const HALF: f64 = 0.5;

/// Name of the fault that all readings are late or early.
const CLOCK: &str = "wiring-clock";
/// Name of the fault that a reading has another zero.
const ZERO: &str = "wiring-offset";

/// A study whose logs are ready for a diagnosis.
#[derive(Clone)]
pub struct Intake {
    /// The study without outliers in its logs, with the wiring that is in use.
    pub study: Study,
    /// The study with the other wiring, if everything that was corrected is in doubt.
    other: Option<Study>,
    /// Whether `study` has the corrected wiring.
    is_mended: bool,
    /// Wiring faults that can be corrected.
    wiring: Vec<WiringResult>,
    /// The mappings that correct them.
    mappings: Vec<ColumnMapping>,
    /// The study before the correction, if a clock was corrected.
    ///
    /// Readings must be interpolated only once: each interpolation correlates their noise further.
    before: Option<Study>,
    /// Fault of some logs alone, which are left out as far as others remain.
    apart: Option<OfSomeLogs>,
    left_out: Vec<LeftOut>,
    /// Sensors that some logs read and others do not.
    absent: Vec<Absent>,
    /// Sensors that never change and are skipped.
    unchanging: Vec<Unchanging>,
}

impl Intake {
    /// Leaves out outliers and passes over sensors that never change; the wiring stays as it is.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn as_wired(study: &Study, machine: &Machine) -> Result<Self> {
        let sensors = machine.plant.layout.sensors.iter().map(|s| &*s.name);
        let absent = absent(study, sensors);
        let mut study = study.clone();
        let left_out = {
            let logs = study.train.iter_mut().chain(&mut study.test);
            let mut logs: Vec<_> = logs.map(|(_, e)| e).collect();
            outliers::leave_out(&mut logs, &machine.plant.layout)
        };
        let unchanging = pass_over(&mut study, machine)?;
        Ok(Self {
            study,
            other: None,
            is_mended: false,
            wiring: Vec::new(),
            mappings: Vec::new(),
            before: None,
            apart: None,
            left_out,
            absent,
            unchanging,
        })
    }

    /// Checks and prepares the logs of a study.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn of(study: &Study, machine: &Machine) -> Result<Self> {
        let mut intake = Self::as_wired(study, machine)?;
        if intake.study.wired {
            return Ok(intake);
        }
        let mut mended = wiring::mend(&intake.study, machine, &Settings::default())?;
        intake.apart = mended.apart.take();
        if let Some(apart) = &intake.apart {
            let names = &apart.logs;
            for study in [&mut intake.study, &mut mended.study] {
                for logs in [&mut study.train, &mut study.test] {
                    if logs.iter().any(|(name, _)| !names.contains(name)) {
                        logs.retain(|(name, _)| !names.contains(name));
                    }
                }
            }
        }
        if mended.wiring.is_empty() {
            return Ok(intake);
        }
        let as_given = std::mem::replace(&mut intake.study, mended.study);
        (intake.wiring, intake.is_mended) = (mended.wiring, true);
        intake.mappings = mended.mappings;
        if intake.clock().is_some() {
            intake.before = Some(as_given.clone());
        }
        if mended.doubted {
            let share = share_left(&intake, &as_given, machine)?;
            let is_most = share < HALF;
            intake.other = Some(as_given);
            if !is_most {
                intake.turn();
            }
        }
        Ok(intake)
    }

    /// Returns the study, and the study with the other wiring if there is one.
    #[must_use]
    pub fn ways(&self) -> (&Study, Option<&Study>) {
        (&self.study, self.other.as_ref())
    }

    /// Switches to the other wiring.
    pub fn turn(&mut self) {
        if let Some(other) = &mut self.other {
            std::mem::swap(&mut self.study, other);
            self.is_mended = !self.is_mended;
        }
    }

    /// Keeps the present wiring.
    pub fn settle(&mut self) {
        self.other = None;
        if !self.is_mended {
            self.wiring.clear();
        }
    }

    /// Adds to a result what was done to the logs, and what the noise is like.
    pub fn tell(&self, result: &mut DiagnosisResult, whiteness: CheckResult) {
        let first = result.checks.iter().position(|c| c.check != "data");
        let at = first.unwrap_or(result.checks.len());
        let told = [
            self.log_check(),
            self.outlier_check(),
            Some(whiteness),
            self.wiring_check(),
        ];
        result.checks.splice(at..at, told.into_iter().flatten());
        result.wiring.clone_from(&self.wiring);
        if let Some(apart) = &self.apart {
            result.sentence = format!("Wiring: {}. {}", of_some_logs(apart), result.sentence);
        }
        if !self.wiring.is_empty() {
            let each: Vec<String> = self.wiring.iter().map(in_words).collect();
            result.sentence = format!(
                "Wiring: {}; the lines under `wiring` belong into the study file, and what follows is said with them. {}",
                each.join("; "),
                result.sentence
            );
        }
    }

    /// What was skipped or corrected in the logs, apart from their wiring.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let checks = [self.log_check(), self.outlier_check()];
        checks.into_iter().flatten().map(|c| c.detail).collect()
    }

    /// Returns the check of what was skipped or corrected in the logs, unusable sensors first;
    /// `None` if there is nothing.
    fn log_check(&self) -> Option<CheckResult> {
        let unchanging = self.unchanging.iter().map(Unchanging::line);
        let unusable = unchanging.chain(self.absent.iter().map(Absent::line));
        let all = self.study.notes.len();
        let mut lines: Vec<(String, usize, bool)> =
            unusable.map(|line| (line, all, true)).collect();
        for (_, notes) in &self.study.notes {
            for line in notes.lines() {
                match lines.iter_mut().find(|(l, ..)| *l == line) {
                    Some((_, files, _)) => *files += 1,
                    None => lines.push((line, 1, notes.is_suspicious())),
                }
            }
        }
        let ok = !lines.iter().any(|(_, _, suspicious)| *suspicious);
        let text = |(line, files, _): &(String, usize, bool)| {
            if *files == all {
                line.clone()
            } else {
                format!("{line} (in {files} of {all} logs)")
            }
        };
        let detail: Vec<String> = lines.iter().map(text).collect();
        (!detail.is_empty()).then(|| CheckResult {
            check: "log".into(),
            ok,
            detail: detail.join("; "),
        })
    }

    fn outlier_check(&self) -> Option<CheckResult> {
        let each = self
            .left_out
            .iter()
            .map(|l| format!("{} of `{}`", l.count, l.sensor));
        let each: Vec<String> = each.collect();
        (!each.is_empty()).then(|| CheckResult {
            check: "outliers".into(),
            ok: true,
            detail: format!(
                "readings far off those before and after them are left out as missing: {}",
                each.join(", ")
            ),
        })
    }
}
