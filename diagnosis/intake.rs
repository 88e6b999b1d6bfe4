//! What happens to logs before any physics: outliers are left out, wiring is mended, and both are said.

use asid_core::Result;

use crate::machine::Machine;
use crate::outliers::{self, LeftOut};
use crate::result::{CheckResult, DiagnosisResult, WiringResult};
use crate::study::Study;
use crate::wiring::{self, Settings};

/// Faults that effects can look like: friction holds a drive back as a late clock does, and a load shifts it as another zero
/// does. Nothing looks like a sign, a unit or a swap.
const IMITABLE: [&str; 2] = ["wiring-clock", "wiring-offset"];

/// A study whose logs are ready for a diagnosis.
pub struct Intake {
    /// The study, with outliers left out of its logs and its wiring mended.
    pub study: Study,
    /// The same without mended wiring, where all that was mended is of a kind that physics can look like.
    doubted: Option<Study>,
    /// Faults of wiring that were mended.
    wiring: Vec<WiringResult>,
    left_out: Vec<LeftOut>,
}

impl Intake {
    /// Looks at the logs of a study.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn of(study: &Study, machine: &Machine) -> Result<Self> {
        let mut study = study.clone();
        let left_out = {
            let logs = study.train.iter_mut().chain(&mut study.test);
            let mut logs: Vec<_> = logs.map(|(_, e)| e).collect();
            outliers::leave_out(&mut logs, &machine.plant.layout)
        };
        let (mut wiring, mut doubted) = (Vec::new(), None);
        if !study.wired {
            let mended = wiring::mend(&study, machine, &Settings::default())?;
            let imitable = |w: &WiringResult| IMITABLE.contains(&&*w.fault);
            if !mended.wiring.is_empty() && mended.wiring.iter().all(imitable) {
                doubted = Some(study);
            }
            (study, wiring) = (mended.study, mended.wiring);
        }
        Ok(Self {
            study,
            doubted,
            wiring,
            left_out,
        })
    }

    /// The study with its wiring as given, where an effect can look like what was mended.
    #[must_use]
    pub fn doubted(&self) -> Option<&Study> {
        self.doubted.as_ref()
    }

    /// Goes on with the wiring as given.
    pub fn take_as_given(&mut self) {
        if let Some(study) = self.doubted.take() {
            self.study = study;
            self.wiring.clear();
        }
    }

    /// Says in a result what was done, and what the noise is like.
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
        if !self.wiring.is_empty() {
            let each: Vec<String> = self.wiring.iter().map(in_words).collect();
            result.sentence = format!(
                "Wiring: {}; the lines under `wiring` belong into the study file, and what follows is said with them. {}",
                each.join("; "),
                result.sentence
            );
        }
    }

    /// What was passed over or mended as the logs were read; nothing where nothing was.
    fn log_check(&self) -> Option<CheckResult> {
        let mut lines: Vec<(String, usize, bool)> = Vec::new();
        for (_, notes) in &self.study.notes {
            for line in notes.lines() {
                match lines.iter_mut().find(|(l, ..)| *l == line) {
                    Some((_, files, _)) => *files += 1,
                    None => lines.push((line, 1, notes.is_suspicious())),
                }
            }
        }
        let all = self.study.notes.len();
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

    fn wiring_check(&self) -> Option<CheckResult> {
        if self.study.wired {
            return None;
        }
        let each: Vec<String> = self.wiring.iter().map(in_words).collect();
        Some(CheckResult {
            check: "wiring".into(),
            ok: each.is_empty(),
            detail: if each.is_empty() {
                "columns mean what their names say".into()
            } else {
                format!(
                    "{}: put into the study file {}",
                    each.join("; "),
                    self.wiring
                        .iter()
                        .map(|w| w.mend.replace('\n', " "))
                        .collect::<Vec<_>>()
                        .join(" ")
                )
            },
        })
    }
}

/// A fault of wiring in words.
fn in_words(wiring: &WiringResult) -> String {
    let columns: Vec<String> = wiring.columns.iter().map(|c| format!("`{c}`")).collect();
    let columns = columns.join(" and ");
    let what = match &*wiring.fault {
        "wiring-swapped" => "are swapped",
        "wiring-sign" => "counts the other way",
        "wiring-unit" => "is in another unit",
        "wiring-offset" => "has another zero",
        "wiring-clock" => "are late or early against the commands",
        _ => "are wired otherwise",
    };
    format!("{columns} {what} (probability {:.2})", wiring.probability)
}
