//! The mapping as a table: on the terminal, in the picture, as JSON.

use std::io::Write as _;

use anyhow::Result;
use asid_logs::propose::{Match, Proposal};
use asid_report::number::significant;
use serde::Serialize;

use super::super::output::OutFolder;
use super::super::result::{SCHEMA, figure};

/// A row of the mapping, for JSON.
#[derive(Serialize)]
struct Row<'a> {
    name: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    from: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    unit: Option<&'a str>,
    sign: f64,
    scale: f64,
    offset: f64,
    delay: f64,
    rate: f64,
    reasons: &'a [String],
}

/// How a column is read, in brief.
fn reading(found: &Match) -> String {
    let Some(m) = &found.mapping else {
        return String::new();
    };
    let mut parts = Vec::new();
    parts.extend(m.unit.clone());
    if m.scale != 1.0 {
        parts.push(format!("× {}", figure(m.scale)));
    }
    if m.sign < 0.0 {
        parts.push("× -1".into());
    }
    if m.offset != 0.0 {
        parts.push(format!("+ {}", figure(m.offset)));
    }
    if m.delay != 0.0 {
        parts.push(format!("{} s late", figure(m.delay)));
    }
    parts.join(" ")
}

/// The cells of a quantity: its column, how it is read, rate, values, reasons.
pub(super) fn cells(found: &Match) -> [String; 5] {
    let Some(mapping) = &found.mapping else {
        return ["-", "", "", "", "no column"].map(str::to_owned);
    };
    let [low, high] = found.values;
    [
        mapping.from.clone().unwrap_or_else(|| found.name.clone()),
        reading(found),
        rate(found.rate),
        format!("{} to {}", figure(low), figure(high)),
        found.reasons.join(", "),
    ]
}

/// Rate from which on it is told in whole Hz: two digits are enough to see a wrong unit.
const WHOLE: f64 = 10.0;

/// Text of a rate, Hz.
fn rate(rate: f64) -> String {
    if rate >= WHOLE {
        format!("{rate:.0}")
    } else {
        significant(rate, 2)
    }
}

/// Largest number of columns that are named; the rest is counted.
const NAMED: usize = 12;

/// Names of columns in a row, abbreviated if there are many; `None` for an empty list.
pub(super) fn listed(names: &[String]) -> Option<String> {
    let mut all: Vec<String> = names.iter().take(NAMED).cloned().collect();
    if names.len() > NAMED {
        all.push(format!("and {} more", names.len() - NAMED));
    }
    (!all.is_empty()).then(|| all.join(", "))
}

/// Prints the mapping as a table, then the source of the time stamps and the unused columns.
pub(super) fn show(proposal: &Proposal, stamps: Option<&str>) -> Result<()> {
    let head = ["quantity", "column", "read as", "Hz", "values", "because"];
    let mut rows = vec![head.map(str::to_owned)];
    for found in &proposal.matches {
        let [column, read, rate, values, why] = cells(found);
        rows.push([found.name.clone(), column, read, rate, values, why]);
    }
    let width = |i: usize| rows.iter().map(|r| r[i].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    let mut stdout = std::io::stdout().lock();
    for row in &rows {
        let cells = row
            .iter()
            .zip(&widths)
            .map(|(cell, w)| format!("{cell:<w$}"));
        let line = cells.collect::<Vec<_>>().join("  ");
        writeln!(stdout, "{}", line.trim_end())?;
    }
    if let Some(stamps) = stamps {
        writeln!(stdout, "time is column {stamps}")?;
    }
    if let Some(start) = listed(&proposal.start) {
        writeln!(stdout, "state of the first row: {start}")?;
    }
    if let Some(unused) = listed(&proposal.unused) {
        writeln!(stdout, "not used: {unused}")?;
    }
    Ok(())
}

/// Prints the mapping as JSON.
pub(super) fn json(
    proposal: &Proposal,
    stamps: Option<&str>,
    notes: &[String],
    out: Option<&OutFolder>,
) -> Result<()> {
    let rows = proposal.matches.iter().map(|found| {
        let m = found.mapping.as_ref();
        Row {
            name: &found.name,
            from: m.map(|m| m.from.as_deref().unwrap_or(&m.name)),
            unit: m.and_then(|m| m.unit.as_deref()),
            sign: m.map_or(1.0, |m| m.sign),
            scale: m.map_or(1.0, |m| m.scale),
            offset: m.map_or(0.0, |m| m.offset),
            delay: m.map_or(0.0, |m| m.delay),
            rate: found.rate,
            reasons: &found.reasons,
        }
    });
    let summary = serde_json::json!({
        "schema": SCHEMA,
        "columns": rows.collect::<Vec<_>>(),
        "stamps": stamps,
        "start": proposal.start,
        "unused": proposal.unused,
        "notes": notes,
        "out": out.map(OutFolder::path),
    });
    writeln!(std::io::stdout(), "{summary:#}")?;
    Ok(())
}
