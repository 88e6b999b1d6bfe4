//! Reads logs: one file for each episode, CSV or (with the feature `parquet`) Parquet.
//!
//! Both have the same columns. A log is checked as it is read. Errors name the file, row and
//! column. Ordinary deviations (other columns, other units of time, repeated stamps, commands at a
//! lower rate) are repaired and noted. Rows of a CSV file are counted as an editor counts lines.
//! The first row of data of any other log is row 2, as in a CSV file without comments.

mod clock;
mod csv;
mod delay;
mod mapping;
mod notes;
mod orientations;
#[cfg(feature = "parquet")]
mod parquet;
mod reader;
mod remapped;
mod table;
mod turns;

use std::path::Path;

use asid_core::layout::Layout;
use asid_core::{Episode, Error, Result};

#[cfg(feature = "parquet")]
pub use self::parquet::ParquetFile;
#[cfg(feature = "parquet")]
pub(crate) use self::parquet::number_in;
pub use clock::{seconds, stamps_in, stamps_read_as};
pub use mapping::{ColumnMapping, counts, unit_counts, unit_factor};
pub use notes::{LogNotes, check_mapped_columns};
pub use reader::is_of_start;
pub use remapped::remapped;
pub use table::{Table, of_table, quantities, wanted};
pub use turns::{Angle, angles};

use crate::format::LogFormat;

/// Reads a log of a scene with this layout: `.parquet` as a Parquet file, any other name as CSV.
///
/// Columns may have any order, sensors may be missing, and unknown columns are skipped. Columns
/// `qpos.*` and `qvel.*` hold the state at the first row.
///
/// # Errors
/// When the file cannot be read or a row or column is wrong; the message names both.
pub fn read(path: &Path, layout: &Layout) -> Result<Episode> {
    read_mapped(path, layout, &[]).map(|(episode, _)| episode)
}

/// Name of an entry of a sensor, as a column's name.
fn entry_name(sensor: &str, len: usize, entry: usize) -> String {
    if len == 1 {
        sensor.to_owned()
    } else {
        format!("{sensor}.{entry}")
    }
}

/// Reads a log as [`read`] does, with mappings of its columns; also returns notes.
///
/// The notes list what was skipped or repaired.
///
/// # Errors
/// When the file cannot be read, or a row, a column or a mapping is wrong; the message names it.
pub fn read_mapped(
    path: &Path,
    layout: &Layout,
    mappings: &[ColumnMapping],
) -> Result<(Episode, LogNotes)> {
    read_as(LogFormat::of(path), path, layout, (mappings, &[]))
}

/// Reads a log as [`read_mapped`] does, as a Parquet file if that is its kind, else as CSV, and
/// counts the turns of these `angles`.
///
/// # Errors
/// As [`read_mapped`].
pub fn read_as(
    kind: LogFormat,
    path: &Path,
    layout: &Layout,
    (mappings, angles): (&[ColumnMapping], &[Angle]),
) -> Result<(Episode, LogNotes)> {
    mappings.iter().try_for_each(|m| m.check(layout))?;
    let read = |path: &Path| match kind {
        #[cfg(feature = "parquet")]
        LogFormat::Parquet => parquet::read(path, layout, (mappings, angles)),
        #[cfg(not(feature = "parquet"))]
        LogFormat::Parquet => Err(
            "is a Parquet file, which this build cannot read: build with `--features parquet`, \
                 or convert it to CSV"
                .to_owned(),
        ),
        _ => csv::read(path, layout, (mappings, angles)),
    };
    read(path).map_err(|message| Error::Log {
        path: path.to_owned(),
        message,
    })
}

#[cfg(test)]
mod tests;
