//! The check of the wiring, and its faults in words.

use crate::result::{CheckResult, WiringResult};
use crate::wiring::OfSomeLogs;

use super::{CLOCK, Intake, ZERO};

impl Intake {
    /// Returns the check of the wiring; `None` if the study says that its columns are right.
    pub(super) fn wiring_check(&self) -> Option<CheckResult> {
        if self.study.wired {
            return None;
        }
        let each: Vec<String> = self.wiring.iter().map(in_words).collect();
        if let Some(apart) = &self.apart {
            let also = if each.is_empty() {
                String::new()
            } else {
                format!("; in all logs {}", each.join("; "))
            };
            return Some(CheckResult {
                check: "wiring".into(),
                ok: false,
                detail: format!("{}{also}", of_some_logs(apart)),
            });
        }
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
                        .filter(|w| !w.mend.is_empty())
                        .map(|w| w.mend.replace('\n', " "))
                        .collect::<Vec<_>>()
                        .join(" ")
                )
            },
        })
    }
}

/// Describes a fault of some logs alone in words.
pub(super) fn of_some_logs(apart: &OfSomeLogs) -> String {
    let logs: Vec<String> = apart.logs.iter().map(|l| format!("`{l}`")).collect();
    format!(
        "{} in {} alone (probability {:.2}); this answer is without {}: correct it, or take it out of the study",
        fault_in_words(apart.fault, &apart.columns),
        logs.join(" and "),
        apart.probability,
        if logs.len() == 1 {
            "this log"
        } else {
            "these logs"
        },
    )
}

/// Describes a wiring fault in words.
pub(super) fn in_words(wiring: &WiringResult) -> String {
    let what = fault_in_words(&wiring.fault, &wiring.columns);
    format!("{what} (probability {:.2})", wiring.probability)
}

/// Describes a kind of fault and its columns in words.
fn fault_in_words(fault: &str, columns: &[String]) -> String {
    let columns: Vec<String> = columns.iter().map(|c| format!("`{c}`")).collect();
    let columns = columns.join(" and ");
    let what = match fault {
        "wiring-swapped" => "are swapped",
        "wiring-sign" => "counts the other way",
        "wiring-unit" => "is in another unit",
        ZERO => "has another zero",
        CLOCK => "are late or early against the commands",
        _ => "are wired otherwise",
    };
    format!("{columns} {what}")
}
