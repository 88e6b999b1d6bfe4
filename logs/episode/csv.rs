//! Logs as CSV files.

use std::collections::HashMap;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;

use asid_core::Episode;
use asid_core::layout::Layout;
use asid_documents::guard::one_line;

use super::reader::Reader;
use super::{ColumnMapping, LogNotes};

/// How writers of CSV files put a missing number, besides an empty cell: NumPy and pandas, R, SQL, JSON.
const MISSING: [&str; 6] = ["nan", "na", "n/a", "null", "none", "-"];

/// Longest first line that is looked at, bytes: some thousand names.
const LONGEST_HEADER: u64 = 1 << 20;

/// What stands between the cells of a table whose first line is this: a comma, a semicolon or a tab, the most frequent.
#[must_use]
pub fn delimiter(first_line: &str) -> u8 {
    let count = |mark: u8| first_line.bytes().filter(|b| *b == mark).count();
    // The comma wins a draw: it is what the name says.
    let marks = [b'\t', b';', b','];
    marks.into_iter().max_by_key(|m| count(*m)).unwrap_or(b',')
}

/// Refuses a header in which a name stands twice: which of the two columns is meant, nobody can say. Empty names do not count, as of the
/// index that pandas writes.
///
/// # Errors
/// When a name stands twice; the message names it and both columns, counted from 1.
pub fn refuse_twice<'a>(header: impl IntoIterator<Item = &'a str>) -> Result<(), String> {
    let mut seen: HashMap<&str, usize> = HashMap::new();
    for (i, name) in header.into_iter().enumerate() {
        if name.is_empty() {
            continue;
        }
        if let Some(first) = seen.insert(name, i) {
            return Err(format!(
                "column `{name}` stands twice in the header, as column {} and as column {}: rename one of them, or leave it out",
                first + 1,
                i + 1
            ));
        }
    }
    Ok(())
}

/// The number in a cell: NaN where it is missing, `None` where it is no finite number.
#[must_use]
pub fn cell_number(text: &str) -> Option<f64> {
    if text.is_empty() || MISSING.iter().any(|m| text.eq_ignore_ascii_case(m)) {
        return Some(f64::NAN);
    }
    text.parse().ok().filter(|x: &f64| x.is_finite())
}

/// The delimiter of a file; a comma where it cannot be read, which the reader tells of.
fn delimiter_of(path: &Path) -> u8 {
    let mut line = Vec::new();
    if let Ok(file) = std::fs::File::open(path) {
        let _ = BufReader::new(file.take(LONGEST_HEADER)).read_until(b'\n', &mut line);
    }
    delimiter(&String::from_utf8_lossy(&line))
}

/// Reads a CSV file.
pub(super) fn read(
    path: &Path,
    layout: &Layout,
    mappings: &[ColumnMapping],
) -> Result<(Episode, LogNotes), String> {
    let told = |e: csv::Error| one_line(&e.to_string());
    let mut file = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .delimiter(delimiter_of(path))
        .from_path(path)
        .map_err(told)?;
    let header = file.headers().map_err(told)?;
    refuse_twice(header)?;
    let header = header.iter().map(str::to_owned).collect();
    let mut reader = Reader::new(layout, mappings, header)?;
    for (i, record) in file.records().enumerate() {
        let record = record.map_err(|e| format!("row {}: {}", i + 2, told(e)))?;
        reader.row(|column| {
            let text = record.get(column).unwrap_or("");
            cell_number(text).ok_or_else(|| text.to_owned())
        })?;
    }
    reader.finish()
}
