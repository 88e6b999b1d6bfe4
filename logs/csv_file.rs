//! Text tables with any names: CSV, with commas, semicolons or tabs.
//!
//! [`crate::episode`] reads CSV files too. It knows the model and the meaning of each column, and
//! refuses a cell that is not a number. Here neither is known yet: every column with numbers
//! becomes a series, and [`propose`](crate::propose) finds its meaning. Both read the same
//! [table](crate::text_table).

use std::path::Path;

use crate::raw::RawLog;
use crate::table_file::{self, Column};
use crate::text_table::{TextTable, text};

/// Reads a file. Cells that are not numbers are missing; columns without any number are left out.
///
/// The stamps are in the column of the name `stamps`, or in the one that looks like it.
///
/// # Errors
/// When the file is no table, its header repeats a name, or it has no column of stamps.
pub fn read(path: &Path, name: &str, stamps: Option<&str>) -> Result<RawLog, String> {
    let text = text(path)?;
    let table = TextTable::of(&text)?;
    let mut columns: Vec<Column> = table.header.iter().map(|n| Column::named(n)).collect();
    for row in table.rows() {
        let row = row?;
        for (i, column) in columns.iter_mut().enumerate() {
            let number = row.number_in(i);
            if number.is_none() && column.text.is_empty() {
                row.cell(i).clone_into(&mut column.text);
            }
            column.values.push(number.unwrap_or(f64::NAN));
        }
    }
    table_file::log(name, &columns, stamps)
}
