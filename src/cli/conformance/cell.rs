//! One engine's answer to one check, as a cell of the page.

use asid_conformance::{Outcome, Row};
use asid_report::number::{quantity, significant};
use asid_report::page::{Cell, Gauge, Tone};

/// Text of a value; its unit stands beside the tolerance.
fn figure(row: &Row) -> String {
    row.value
        .map_or_else(|| "–".to_owned(), |value| significant(value, 2))
}

/// A tolerance with its unit.
pub fn limit(row: &Row) -> String {
    quantity(&significant(row.tolerance, 2), &row.unit)
}

fn tone(outcome: Outcome) -> Tone {
    match outcome {
        Outcome::Pass => Tone::Good,
        Outcome::KnownDeviation => Tone::Fair,
        Outcome::Fail => Tone::Bad,
        Outcome::NotClaimed => Tone::Plain,
    }
}

/// Tooltip of a row.
fn hint(row: &Row) -> String {
    let share = match row.share() {
        Some(share) if row.tolerance > 0.0 => {
            format!(
                ", {} of the tolerance {}",
                significant(share, 2),
                limit(row)
            )
        }
        _ => String::new(),
    };
    let note = if row.note.is_empty() {
        String::new()
    } else {
        format!(": {}", row.note)
    };
    format!(
        "{} on {}: {}{share}{note}",
        row.check, row.engine, row.outcome
    )
}

/// One engine's cell of a check.
pub fn cell(row: Option<&Row>) -> Cell {
    let Some(row) = row else {
        return Cell::from("");
    };
    let tone = tone(row.outcome);
    let cell = match row.outcome {
        Outcome::NotClaimed => Cell::from("").note("not claimed"),
        Outcome::Pass => Cell::from(figure(row)),
        Outcome::Fail if row.value.is_none() => Cell::toned("error", tone),
        _ => Cell::toned(figure(row), tone),
    };
    let cell = match row.share() {
        // With a tolerance of zero, a count has no place on the scale.
        Some(share) if row.tolerance > 0.0 || share == 0.0 => cell.gauge(Gauge::new(share, tone)),
        Some(_) => cell.gauge(Gauge::new(f64::INFINITY, tone)),
        None => cell,
    };
    cell.hint(hint(row))
}
