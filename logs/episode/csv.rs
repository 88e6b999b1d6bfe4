//! Logs as CSV files.

use std::path::Path;

use asid_core::Episode;
use asid_core::layout::Layout;

use super::reader::Reader;
use super::{Angle, ColumnMapping, LogNotes};
use crate::text_table::{TextTable, text};

/// Reads a CSV file.
pub(super) fn read(
    path: &Path,
    layout: &Layout,
    columns: (&[ColumnMapping], &[Angle]),
) -> Result<(Episode, LogNotes), String> {
    let text = text(path)?;
    let table = TextTable::of(&text)?;
    let mut reader = Reader::new(layout, columns, table.header.clone())?;
    for row in table.rows() {
        let row = row?;
        reader.row(row.number, |column| {
            let number = row.number_in(column);
            number.ok_or_else(|| row.cell(column).to_owned())
        })?;
    }
    reader.finish()
}
