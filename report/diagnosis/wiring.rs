//! Wiring faults, shown before everything else: what is wrong with the columns, and the lines that
//! correct it.

use asid_results::diagnosis::DiagnosisResult;

use super::words::{joined, probability};
use crate::page::{Column, Section, Table};

pub(super) fn section(d: &DiagnosisResult) -> Option<Section> {
    if d.wiring.is_empty() {
        return None;
    }
    let columns = vec![
        Column::text("fault"),
        Column::prose("columns"),
        Column::number("probability"),
    ];
    let table = d.wiring.iter().fold(Table::new(columns), |table, w| {
        table.row(vec![
            w.fault.clone().into(),
            joined(&w.columns, "and").into(),
            probability(w.probability).into(),
        ])
    });
    let section = Section::new("Wiring")
        .lead(
            "Columns of the logs that do not mean what their names say. All other results on this page are computed with these faults corrected. \
             The lines below make the same corrections in the study file.",
        )
        .table(table);
    let mut shown: Vec<&str> = Vec::new();
    Some(d.wiring.iter().fold(section, |section, w| {
        if shown.contains(&&*w.mend) {
            return section;
        }
        shown.push(&w.mend);
        section.command(w.mend.clone())
    }))
}
