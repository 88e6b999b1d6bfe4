//! Faults of wiring: judged apart from the verdict, which is of the study after the mending.

use serde::Serialize;

use crate::answer::{Answer, WiringFound};
use crate::label::{Label, WiringTruth};

/// Faults of wiring of one case.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Wiring {
    /// Faults there are.
    pub faults: usize,
    /// Of these, found: by name, at the same columns.
    pub found: usize,
    /// Faults named that are not there.
    pub false_alarms: usize,
}

/// Whether both are the same fault at the same columns. A fault of all readings may name any of them, or none: a clock
/// is late for all of them at once.
fn same(found: &WiringFound, truth: &WiringTruth) -> bool {
    let all = |a: &[String], b: &[String]| a.iter().all(|c| b.contains(c));
    let clock = truth.fault == "wiring-clock" && all(&found.columns, &truth.columns);
    let columns = all(&found.columns, &truth.columns) && all(&truth.columns, &found.columns);
    found.fault == truth.fault && (columns || clock)
}

impl Wiring {
    /// Of a case; `answer` is missing where there was none.
    #[must_use]
    pub fn of(label: &Label, answer: Option<&Answer>) -> Self {
        let named: Vec<&WiringFound> = answer.into_iter().flat_map(Answer::named_wiring).collect();
        let is_found = |t: &&WiringTruth| named.iter().any(|f| same(f, t));
        let is_true = |f: &&&WiringFound| label.wiring.iter().any(|t| same(f, t));
        Self {
            faults: label.wiring.len(),
            found: label.wiring.iter().filter(is_found).count(),
            false_alarms: named.len() - named.iter().filter(is_true).count(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_counts_at_its_columns_only() {
        let truth = |fault: &str, columns: &[&str]| WiringTruth {
            fault: fault.into(),
            columns: columns.iter().map(|c| (*c).to_owned()).collect(),
            value: 0.0,
        };
        let found = |fault: &str, columns: &[&str], p: Option<f64>| WiringFound {
            fault: fault.into(),
            columns: columns.iter().map(|c| (*c).to_owned()).collect(),
            probability: p,
        };
        let label = Label {
            wiring: vec![
                truth("wiring-swapped", &["a", "b"]),
                truth("wiring-clock", &["a", "b"]),
            ],
            ..Label::default()
        };
        let answer = Answer {
            wiring: vec![
                found("wiring-swapped", &["b", "a"], Some(0.9)),
                found("wiring-clock", &[], None),
                found("wiring-sign", &["a"], Some(0.8)),
                found("wiring-sign", &["b"], Some(0.2)),
            ],
            ..Answer::default()
        };
        let scored = Wiring::of(&label, Some(&answer));
        assert_eq!(
            scored,
            Wiring {
                faults: 2,
                found: 2,
                false_alarms: 1
            }
        );
        assert_eq!(Wiring::of(&label, None).found, 0);
    }
}
