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
    // The lines of a column with two faults are those of the first.
    let lines = d.wiring.iter().map(|w| &w.mend).filter(|m| !m.is_empty());
    Some(lines.fold(section, |section, mend| section.command(mend.clone())))
}
