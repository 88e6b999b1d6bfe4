//! The end of the page: the study's parameters, the checks, the next steps, and the command that
//! repeats it.

use asid_results::diagnosis::{DiagnosisResult, Kind, ParameterResult};
use asid_results::trace::DiagnosisTrace;

use super::words::{count, joined};
use crate::markup::capitalise;
use crate::number::{Precision, quantity, round};
use crate::page::{Cell, Column, Section, Table, Tone};

pub(super) fn next(d: &DiagnosisResult) -> Option<Section> {
    let next = &d.next_experiment;
    if next.how.is_empty() && next.separates.is_empty() {
        return None;
    }
    let section = Section::new("The next experiment")
        .lead("What the robot could do to tell apart what these logs cannot.");
    let mut facts = Vec::new();
    if !next.separates.is_empty() {
        facts.push(("tells apart".to_owned(), joined(&next.separates, "and")));
    }
    if !next.file.is_empty() {
        facts.push(("commands".to_owned(), next.file.clone()));
    }
    let section = if facts.is_empty() {
        section
    } else {
        section.facts(facts)
    };
    Some(if next.how.is_empty() {
        section
    } else {
        section.text(capitalise(&next.how))
    })
}

pub(super) fn parameters(d: &DiagnosisResult) -> Option<Section> {
    if d.parameters.is_empty() {
        return None;
    }
    let lead = match d.verdict.kind {
        Kind::Effects => {
            "Parameters that the study fits under every explanation, with their values beside the verdict's effects: without these, the values would make up for \
             what the model lacks."
        }
        Kind::Unknown => {
            "Parameters that the study fits under every explanation: their values may make up for what the model lacks."
        }
        Kind::None => "Parameters that the study fits under every explanation, with their values.",
    };
    let nominal = d.parameters.iter().any(|p| p.nominal.is_some());
    let mut columns = vec![Column::text("parameter")];
    if nominal {
        columns.push(Column::number("as given"));
    }
    columns.extend([
        Column::number("estimate ± std"),
        Column::number("95 % interval"),
    ]);
    let table = d.parameters.iter().fold(Table::new(columns), |table, p| {
        let precision = Precision::of(p.estimate, p.std);
        let mut row: Vec<Cell> = vec![p.name.clone().into()];
        if nominal {
            let given = p.nominal.map(|n| quantity(&round(n, 4), &p.unit));
            row.push(given.unwrap_or_else(|| "–".to_owned()).into());
        }
        let estimate = precision.with_uncertainty(p.estimate, p.std);
        row.push(quantity(&estimate, &p.unit).into());
        row.push(interval(p, precision).into());
        table.row(row)
    });
    Some(
        Section::new("The study's parameters")
            .lead(lead)
            .table(table),
    )
}

pub(super) fn tolerances(d: &DiagnosisResult) -> Option<Section> {
    if d.tolerances.is_empty() {
        return None;
    }
    let columns = vec![
        Column::text("effect"),
        Column::text("at"),
        Column::text("values"),
    ];
    let table = d.tolerances.iter().fold(Table::new(columns), |table, t| {
        let value = |(name, x): (&String, &f64)| format!("{name} {}", round(*x, 3));
        let values: Vec<String> = t.parameters.iter().map(value).collect();
        table.row(vec![
            t.effect.clone().into(),
            t.site.clone().into(),
            values.join(", ").into(),
        ])
    });
    Some(
        Section::new("Within tolerances")
            .lead(
                "What an ordinary machine has that is as its model says: fitted together, each value with the prior of its tolerance, \
                 and not named. The refined model has them.",
            )
            .table(table),
    )
}

fn interval(p: &ParameterResult, precision: Precision) -> String {
    if p.interval95.iter().all(|x| x.is_finite()) {
        quantity(&precision.interval(p.interval95), &p.unit)
    } else {
        "–".to_owned()
    }
}

pub(super) fn checks(d: &DiagnosisResult) -> Option<Section> {
    if d.checks.is_empty() {
        return None;
    }
    let columns = vec![Column::prose("check"), Column::text("result")];
    let ordered = (d.checks.iter().filter(|c| !c.ok)).chain(d.checks.iter().filter(|c| c.ok));
    let table = ordered.fold(Table::new(columns), |table, c| {
        let result = if c.ok {
            Cell::toned("ok", Tone::Good)
        } else {
            Cell::toned("not ok", Tone::Bad)
        };
        table.row(vec![
            Cell::from(c.check.clone()).note(c.detail.clone()),
            result,
        ])
    });
    Some(
        Section::new("Checks")
            .lead("Whether the logs and the model can carry a diagnosis at all. Failed checks come first.")
            .table(table),
    )
}

pub(super) fn not_tried(d: &DiagnosisResult) -> Option<Section> {
    if d.not_tried.is_empty() {
        return None;
    }
    let columns = vec![Column::prose("what"), Column::prose("of which effects")];
    let table = d.not_tried.iter().fold(Table::new(columns), |table, n| {
        let effects = match &n.effects[..] {
            [] => "–".to_owned(),
            effects => joined(effects, "and"),
        };
        table.row(vec![n.stage.clone().into(), effects.into()])
    });
    Some(
        Section::new("Stopped early")
            .lead("The search was stopped, by a time limit or by hand. This was left out; with more time the answer may change.")
            .table(table),
    )
}

pub(super) fn left_out(t: &DiagnosisTrace) -> Option<Section> {
    if t.left_out.is_empty() {
        return None;
    }
    let columns = vec![Column::text("candidate"), Column::prose("why")];
    let table = t.left_out.iter().fold(Table::new(columns), |table, left| {
        table.row(vec![left.name.clone().into(), left.value.clone().into()])
    });
    let summary = format!("{} of the catalogue", count(t.left_out.len(), "candidate"));
    Some(
        Section::new("What could not be tried")
            .lead("Effects that this model, engine or data do not allow: the diagnosis says nothing of them.")
            .folded(summary, Section::new("").table(table)),
    )
}

pub(super) fn repeat(t: &DiagnosisTrace) -> Option<Section> {
    if t.command.is_empty() && t.files.is_empty() && t.versions.is_empty() {
        return None;
    }
    let mut section = Section::new("Repeat it")
        .lead("The same seed and binary give the same result, at any thread count.");
    if !t.command.is_empty() {
        section = section.command(t.command.clone());
    }
    let versions = t.versions.iter().map(|v| (v.name.clone(), v.value.clone()));
    section = section.facts(versions.collect());
    if !t.files.is_empty() {
        let columns = vec![Column::text("file"), Column::prose("holds")];
        section = section.table(t.files.iter().fold(Table::new(columns), |table, f| {
            table.row(vec![f.name.clone().into(), f.what.clone().into()])
        }));
    }
    Some(section)
}
