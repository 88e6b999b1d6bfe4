//! Scores wiring faults, separately from the verdict, which is about the study after the
//! correction.
//!
//! A reading with a constant shift has two descriptions: a wrong zero of its column, and a bias of
//! its sensor. Both are the same physics. If the label has the bias, an answer that corrects the
//! zero has named it.

use serde::Serialize;

use crate::answer::{Answer, WiringFound};
use crate::label::{Label, WiringTruth, name_of, site_of};

/// Wiring faults of one case.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Wiring {
    /// Number of true faults.
    pub faults: usize,
    /// Number of true faults that were found: by name, at the same columns.
    pub found: usize,
    /// Number of named faults that are absent.
    pub false_alarms: usize,
}

/// Whether both are the same fault at the same columns.
///
/// A fault of all readings may name any of them or none: a clock is late for all of them at once.
fn same(found: &WiringFound, truth: &WiringTruth) -> bool {
    let all = |a: &[String], b: &[String]| a.iter().all(|c| b.contains(c));
    let clock = truth.fault == "wiring-clock" && all(&found.columns, &truth.columns);
    let columns = all(&found.columns, &truth.columns) && all(&truth.columns, &found.columns);
    found.fault == truth.fault && (columns || clock)
}

/// The effect that is the same physics as [`SHIFT`] of a column of its sensor.
const BIAS: &str = "sensor-bias";
/// The fault of a constant shift of a column.
const SHIFT: &str = "wiring-offset";

/// Causes of a label that an answer has named by correcting the zero of a column.
pub fn named_by_mending<'a>(label: &'a Label, answer: &Answer) -> impl Iterator<Item = &'a String> {
    let mended = |cause: &&String| {
        name_of(cause) == BIAS && answer.named_wiring().any(|f| is_bias_at(f, site_of(cause)))
    };
    let given = |cause: &&String| {
        let at = |t: &WiringTruth| t.columns.iter().any(|c| sensor_of(c) == site_of(cause));
        !label.wiring.iter().any(|t| t.fault == SHIFT && at(t))
    };
    let causes: Vec<&String> = label.effects.iter().filter(given).filter(mended).collect();
    causes.into_iter()
}

/// Whether a fault is a constant shift of a sensor's columns.
fn is_bias_at(found: &WiringFound, sensor: &str) -> bool {
    let all = found
        .columns
        .iter()
        .all(|c| c == sensor || sensor_of(c) == sensor);
    found.fault == SHIFT && !found.columns.is_empty() && all
}

/// Sensor of a column, which is called `NAME`, or `NAME.0` for an entry.
fn sensor_of(column: &str) -> &str {
    match column.rsplit_once('.') {
        Some((sensor, entry)) if entry.parse::<usize>().is_ok() => sensor,
        _ => column,
    }
}

impl Wiring {
    /// Scores the wiring of a case; `answer` is missing if there is none.
    #[must_use]
    pub fn of(label: &Label, answer: Option<&Answer>) -> Self {
        let named: Vec<&WiringFound> = answer.into_iter().flat_map(Answer::named_wiring).collect();
        let is_found = |t: &&WiringTruth| named.iter().any(|f| same(f, t));
        let causes: Vec<&String> =
            answer.map_or_else(Vec::new, |a| named_by_mending(label, a).collect());
        let is_true = |f: &&&WiringFound| {
            let cause = |c: &&String| is_bias_at(f, site_of(c));
            label.wiring.iter().any(|t| same(f, t)) || causes.iter().any(cause)
        };
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

    /// Symptom: a bias that was corrected as a wrong zero counted as wrong, and as a false alarm of
    /// wiring.
    #[test]
    fn a_column_whose_zero_is_mended_names_the_bias_of_its_sensor() {
        let shift = |column: &str| Answer {
            wiring: vec![WiringFound {
                fault: SHIFT.into(),
                columns: vec![column.into()],
                probability: Some(0.9),
            }],
            ..Answer::default()
        };
        let label = Label {
            effects: vec!["sensor-bias@tip".into(), "armature@hip".into()],
            ..Label::default()
        };
        let named = |answer: &Answer| named_by_mending(&label, answer).count();
        assert_eq!(named(&shift("tip")), 1);
        assert_eq!(named(&shift("tip.2")), 1);
        assert_eq!(named(&shift("angle")), 0);
        assert_eq!(Wiring::of(&label, Some(&shift("tip.2"))).false_alarms, 0);
        assert_eq!(Wiring::of(&label, Some(&shift("angle"))).false_alarms, 1);
        // If the wiring is wrong as well, correcting the column does not name the bias.
        let both = Label {
            wiring: vec![WiringTruth {
                fault: SHIFT.into(),
                columns: vec!["tip.0".into()],
                value: 0.1,
            }],
            ..label.clone()
        };
        assert_eq!(named_by_mending(&both, &shift("tip.0")).count(), 0);
    }
}
