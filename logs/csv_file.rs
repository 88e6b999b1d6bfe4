//! Tables of text with any names: CSV, with commas, semicolons or tabs.
//!
//! [`crate::episode`] reads CSV files too. It knows the model and what each column is, and refuses a cell that is no
//! number. Here neither is known yet: every column with numbers becomes a series, and [`propose`](crate::propose) finds
//! out what it is. What divides cells and what is a number in one is the same for both.

use std::path::Path;

use crate::episode::{cell_number, delimiter, refuse_twice};
use crate::raw::RawLog;
use crate::table_file;

/// Reads a file. Cells that are no numbers are missing; columns without any number are left out.
///
/// # Errors
/// When the file is no table, a name stands twice in its header, or it has no column of stamps.
pub fn read(path: &Path, name: &str) -> Result<RawLog, String> {
    let text = std::fs::read(path).map_err(|e| e.to_string())?;
    let text = String::from_utf8_lossy(&text);
    // A mark of the byte order, as Excel writes it.
    let text = text.trim_start_matches('\u{feff}');
    let first = text.lines().next().unwrap_or_default();
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .flexible(true)
        .delimiter(delimiter(first))
        .from_reader(text.as_bytes());
    let header = reader.headers().map_err(|e| e.to_string())?.clone();
    refuse_twice(&header)?;
    let mut columns: Vec<(String, Vec<f64>)> = header
        .iter()
        .map(|name| (name.to_owned(), Vec::new()))
        .collect();
    for record in reader.records() {
        let record = record.map_err(|e| e.to_string())?;
        for (i, (_, values)) in columns.iter_mut().enumerate() {
            let number = record.get(i).and_then(cell_number);
            values.push(number.unwrap_or(f64::NAN));
        }
    }
    table_file::log(name, columns)
}
