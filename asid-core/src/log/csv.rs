//! Logs as CSV files.

use std::path::Path;

use super::{ColumnMapping, LogNotes, Reader};
use crate::episode::Episode;
use crate::layout::Layout;
use crate::scene::one_line;

/// How writers of CSV files put a missing number, besides an empty cell: NumPy and pandas, R, SQL, JSON.
const MISSING: [&str; 6] = ["nan", "na", "n/a", "null", "none", "-"];

/// Reads a CSV file.
pub(super) fn read(
    path: &Path,
    layout: &Layout,
    mappings: &[ColumnMapping],
) -> Result<(Episode, LogNotes), String> {
    let told = |e: csv::Error| one_line(&e.to_string());
    let mut file = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_path(path)
        .map_err(told)?;
    let header = file.headers().map_err(told)?;
    let header = header.iter().map(str::to_owned).collect();
    let mut reader = Reader::new(layout, mappings, header)?;
    for (i, record) in file.records().enumerate() {
        let record = record.map_err(|e| format!("row {}: {}", i + 2, told(e)))?;
        reader.row(|column| {
            let text = record.get(column).unwrap_or("");
            if text.is_empty() || MISSING.iter().any(|m| text.eq_ignore_ascii_case(m)) {
                return Ok(f64::NAN);
            }
            let parsed: Option<f64> = text.parse().ok();
            let finite = parsed.filter(|x| x.is_finite());
            finite.ok_or_else(|| text.to_owned())
        })?;
    }
    reader.finish()
}
