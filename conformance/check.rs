//! What a check is, the row that it gives, and the printed table.

use std::fmt::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};

use asid_core::{Backend, Capabilities, Result};
use serde::{Deserialize, Serialize};

use crate::deviations;
use crate::named::Named;

/// Largest figure that passes, for engines of double and of single precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    double: f64,
    single: f64,
}

impl Tolerance {
    /// The same tolerance for both precisions, if the arithmetic does not matter.
    #[must_use]
    pub const fn same(value: f64) -> Self {
        Self {
            double: value,
            single: value,
        }
    }

    /// A tolerance by precision, if the remaining deviation is rounding.
    #[must_use]
    pub const fn by_precision(double: f64, single: f64) -> Self {
        Self { double, single }
    }

    /// The tolerance that applies to an engine.
    #[must_use]
    pub fn of(self, capabilities: Capabilities) -> f64 {
        if capabilities.contains(Capabilities::DOUBLE_PRECISION) {
            self.double
        } else {
            self.single
        }
    }
}

/// One question to an engine, answered by a number.
#[derive(Clone, Copy, Debug)]
pub struct Check {
    /// Name, `family/what`.
    pub name: &'static str,
    /// Capabilities that an engine must claim for the question to make sense.
    pub needs: Capabilities,
    /// Unit of the figure; empty for a ratio or a count.
    pub unit: &'static str,
    /// Largest magnitude of the figure that passes.
    pub tolerance: Tolerance,
    /// Where the tolerance comes from.
    pub reason: &'static str,
    /// Measures the figure: a deviation, zero at best.
    pub measure: Measure,
}

/// How a check measures its figure.
#[derive(Clone, Copy, Debug)]
pub enum Measure {
    /// Measured on every engine that claims what the check needs.
    Figure(fn(&dyn Backend) -> Result<f64>),
    /// Measured on what an engine accepts although it need not.
    ///
    /// `None` if it refuses all of it, or if nothing that it claims could show it.
    Taken(fn(&dyn Backend) -> Result<Option<f64>>),
}

impl Measure {
    fn of(self, backend: &dyn Backend) -> Result<Option<f64>> {
        match self {
            Self::Figure(measure) => measure(backend).map(Some),
            Self::Taken(measure) => measure(backend),
        }
    }
}

impl Check {
    /// The check's family: the first part of its name.
    #[must_use]
    pub fn family(&self) -> &'static str {
        self.name.split('/').next().unwrap_or_default()
    }

    /// Runs the check on a backend. An error or a panic of the engine gives a failed row.
    #[must_use]
    pub fn run(&self, backend: &dyn Backend) -> Row {
        let capabilities = backend.capabilities();
        let tolerance = self.tolerance.of(capabilities);
        let mut row = Row {
            engine: backend.name().to_owned(),
            check: self.name.to_owned(),
            value: None,
            tolerance,
            unit: self.unit.to_owned(),
            outcome: Outcome::NotClaimed,
            reason: self.reason.to_owned(),
            note: String::new(),
        };
        let lacking = self.needs - capabilities;
        if !lacking.is_empty() {
            let names: Vec<&str> = lacking.iter_names().map(|(name, _)| name).collect();
            row.note = format!("does not claim {}", names.join(", "));
            return row;
        }
        let asked_of_all = ["faults", "claims"].contains(&self.family());
        if !capabilities.intersects(crate::MOVES) && !asked_of_all {
            row.note = "claims neither ARTICULATION nor FREE_BODIES: nothing moves".into();
            return row;
        }
        row.outcome = Outcome::Fail;
        let named = Named::new(backend, self.name);
        match catch_unwind(AssertUnwindSafe(|| self.measure.of(&named))) {
            Ok(Ok(None)) => {
                row.outcome = Outcome::NotClaimed;
                row.note =
                    "refuses what it need not take, or claims nothing that would show it".into();
            }
            Ok(Ok(Some(value))) if value.abs() <= tolerance => {
                row.value = Some(value);
                row.outcome = Outcome::Pass;
            }
            Ok(Ok(Some(value))) if value.is_finite() => row.value = Some(value),
            Ok(Ok(Some(value))) => row.note = format!("the figure is {value}"),
            Ok(Err(error)) => row.note = error.to_string(),
            Err(panic) => {
                let text = panic
                    .downcast_ref::<String>()
                    .map(String::as_str)
                    .or_else(|| panic.downcast_ref::<&str>().copied())
                    .unwrap_or("without a message");
                row.note = format!("panicked: {text}");
            }
        }
        excused(row, deviations::find(backend.name(), self.name))
    }

    /// The documents that the check gives to an engine, in order and each once.
    ///
    /// If the engine refuses one and this ends the check, later ones are missing.
    #[must_use]
    pub fn scenes(&self, backend: &dyn Backend) -> Vec<String> {
        let named = Named::new(backend, self.name);
        // The result of the check does not matter here.
        let _ = catch_unwind(AssertUnwindSafe(|| self.measure.of(&named)));
        named.scenes()
    }
}

/// Turns a failed row into a known deviation if the table of deviations covers it.
fn excused(mut row: Row, known: Option<&deviations::Deviation>) -> Row {
    if row.outcome == Outcome::Fail
        && let Some(known) = known
    {
        row.note = known.reason.clone();
        if row.value.is_some_and(|value| value.abs() <= known.allowed) {
            row.outcome = Outcome::KnownDeviation;
        }
    }
    row
}

/// Outcome of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// Within the tolerance.
    Pass,
    /// Beyond it, or an unexpected error.
    Fail,
    /// The engine does not claim what the check needs, or refuses what it need not accept.
    NotClaimed,
    /// Beyond the tolerance, but within what the table of deviations allows.
    KnownDeviation,
}

impl Outcome {
    /// Text in tables.
    #[must_use]
    pub fn label(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "FAIL",
            Self::NotClaimed => "not-claimed",
            Self::KnownDeviation => "known-deviation",
        }
    }
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.label())
    }
}

/// Answer of one engine to one check.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the backend.
    pub engine: String,
    /// Name of the check.
    pub check: String,
    /// The figure, if there is one.
    pub value: Option<f64>,
    /// Largest magnitude that passes.
    pub tolerance: f64,
    /// Unit of both.
    pub unit: String,
    /// Outcome.
    pub outcome: Outcome,
    /// Where the tolerance comes from.
    pub reason: String,
    /// Reason why there is no figure, capabilities that are not claimed, or reason of a known
    /// deviation.
    pub note: String,
}

impl Row {
    /// The figure as a share of its tolerance, 1 at the limit; a count if the tolerance is zero.
    ///
    /// `None` without a figure.
    #[must_use]
    pub fn share(&self) -> Option<f64> {
        let value = self.value?.abs();
        if self.tolerance > 0.0 {
            Some(value / self.tolerance)
        } else {
            Some(value)
        }
    }

    /// The family of the check.
    #[must_use]
    pub fn family(&self) -> &str {
        self.check.split('/').next().unwrap_or_default()
    }

    /// Whether the engine fails to do what it claims.
    #[must_use]
    pub fn is_failure(&self) -> bool {
        self.outcome == Outcome::Fail
    }
}

/// Rows as a table in plain text, one line each.
#[must_use]
pub fn table(rows: &[Row]) -> String {
    let check = rows.iter().map(|r| r.check.len()).max().unwrap_or(0).max(5);
    let engine = rows
        .iter()
        .map(|r| r.engine.len())
        .max()
        .unwrap_or(0)
        .max(6);
    let mut text = format!(
        "{:engine$}  {:check$}  {:>10}  {:>9}  {:6}  {:15}  reason\n",
        "engine", "check", "figure", "tolerance", "unit", "outcome"
    );
    for row in rows {
        let value = row
            .value
            .map_or_else(|| "-".to_owned(), |v| format!("{v:.2e}"));
        let reason = if row.note.is_empty() {
            &row.reason
        } else {
            &row.note
        };
        // Writing into a String cannot fail.
        let _ = writeln!(
            text,
            "{:engine$}  {:check$}  {value:>10}  {:>9.1e}  {:6}  {:15}  {reason}",
            row.engine,
            row.check,
            row.tolerance,
            row.unit,
            row.outcome.label(),
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(value: Option<f64>, outcome: Outcome) -> Row {
        Row {
            engine: "engine".into(),
            check: "family/check".into(),
            value,
            tolerance: 0.1,
            unit: "m".into(),
            outcome,
            reason: "of the tolerance".into(),
            note: String::new(),
        }
    }

    #[test]
    fn a_known_deviation_excuses_what_it_allows_and_no_more() {
        let known = deviations::Deviation {
            engine: "engine".into(),
            check: "family/check".into(),
            allowed: 0.3,
            reason: "of the deviation".into(),
        };
        let after = |value, outcome| excused(row(value, outcome), Some(&known)).outcome;
        assert_eq!(after(Some(-0.2), Outcome::Fail), Outcome::KnownDeviation);
        assert_eq!(after(Some(0.4), Outcome::Fail), Outcome::Fail);
        assert_eq!(after(None, Outcome::Fail), Outcome::Fail);
        assert_eq!(after(Some(0.05), Outcome::Pass), Outcome::Pass);
        assert_eq!(
            excused(row(Some(0.2), Outcome::Fail), None).outcome,
            Outcome::Fail
        );
    }

    #[test]
    fn a_share_is_of_the_tolerance() {
        assert_eq!(row(Some(-0.05), Outcome::Pass).share(), Some(0.5));
        assert_eq!(row(None, Outcome::Fail).share(), None);
    }
}
