//! Logs as CSV files.

use std::path::Path;

use super::Reader;
use crate::episode::Episode;
use crate::layout::Layout;
use crate::scene::one_line;

/// Reads a CSV file.
pub(super) fn read(path: &Path, layout: &Layout) -> Result<Episode, String> {
    let told = |e: csv::Error| one_line(&e.to_string());
    let mut file = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_path(path)
        .map_err(told)?;
    let header = file.headers().map_err(told)?;
    let mut reader = Reader::new(layout, header.iter().map(str::to_owned).collect())?;
    for (i, record) in file.records().enumerate() {
        let record = record.map_err(|e| format!("row {}: {}", i + 2, told(e)))?;
        reader.row(|column| {
            let text = record.get(column).unwrap_or("");
            if text.is_empty() {
                return Ok(f64::NAN);
            }
            let parsed: Option<f64> = text.parse().ok();
            let finite = parsed.filter(|x| x.is_finite());
            finite.ok_or_else(|| text.to_owned())
        })?;
    }
    reader.finish()
}
