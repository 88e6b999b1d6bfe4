//! Reads logs: one file an episode, CSV or (with the feature `parquet`) Parquet, with the same columns.
//!
//! A log is checked as it is read: whatever is wrong is told with its file, row and column, and what is ordinary
//! (other columns, other units of time, doubled stamps, commands at a lower rate) is mended and noted.
//! The first row of data is row 2, as a spreadsheet of the CSV file counts it; a Parquet file's
//! rows are counted the same way.

mod clock;
mod csv;
mod delay;
mod mapping;
mod notes;
#[cfg(feature = "parquet")]
mod parquet;
mod reader;
mod table;

use std::path::Path;

use crate::episode::Episode;
use crate::error::{Error, Result};
use crate::layout::Layout;

pub use self::csv::{cell_number, delimiter};
#[cfg(feature = "parquet")]
pub use self::parquet::ParquetFile;
pub use clock::seconds;
use mapping::Source;
pub use mapping::{ColumnMapping, unit_factor};
pub use notes::LogNotes;
pub use table::{Table, of_table, quantities, wanted};

impl Episode {
    /// Reads a log of a scene with this layout; a name that ends in `.parquet` is a Parquet
    /// file, any other CSV. Columns may come in any order, sensors may be missing, and columns that the scene does
    /// not know are passed over; columns `qpos.*` and `qvel.*` hold the state at the first row.
    ///
    /// # Errors
    /// When the file cannot be read or a row or column is wrong; the message names both.
    pub fn read(path: &Path, layout: &Layout) -> Result<Self> {
        read(path, layout, &[]).map(|(episode, _)| episode)
    }

    /// The same log as another wiring of its columns would have given it: factor, offset and delay of the mappings
    /// are applied to the quantities as they were read, and `from` names the quantity that a column holds.
    ///
    /// # Errors
    /// When a mapping names what the scene does not have.
    pub fn remapped(&self, layout: &Layout, mappings: &[ColumnMapping]) -> Result<Self> {
        mappings.iter().try_for_each(|m| m.check(layout))?;
        let mut episode = self.clone();
        let width = self.width();
        let mut late = Vec::with_capacity(width);
        let places: Vec<String> = (self.channels.iter())
            .flat_map(|c| (0..c.len).map(|i| entry_name(&c.name, c.len, i)))
            .collect();
        let mut at = 0;
        for channel in &self.channels {
            for i in 0..channel.len {
                let source = Source::of(mappings, &channel.name, (channel.len > 1).then_some(i));
                let from = places
                    .iter()
                    .position(|p| *p == source.column)
                    .unwrap_or(at);
                for k in 0..self.rows() {
                    let x = self.readings[k * width + from];
                    episode.readings[k * width + at] = source.factor * x + source.offset;
                }
                late.push(source.delay);
                at += 1;
            }
        }
        let nu = self.actuators.len();
        let mut commands = Vec::with_capacity(nu);
        for (a, name) in self.actuators.iter().enumerate() {
            let source = Source::of(mappings, &format!("ctrl.{name}"), None);
            let held = |n: &String| format!("ctrl.{n}") == source.column;
            let from = self.actuators.iter().position(held).unwrap_or(a);
            for k in 0..self.rows() {
                let x = self.ctrl[k * nu + from];
                episode.ctrl[k * nu + a] = source.factor * x + source.offset;
            }
            commands.push(source.delay);
        }
        delay::readings(&mut episode, layout, &late);
        delay::commands(&mut episode, &commands);
        Ok(episode)
    }
}

/// Name of an entry of a sensor, as its column has it.
fn entry_name(sensor: &str, len: usize, entry: usize) -> String {
    if len == 1 {
        sensor.to_owned()
    } else {
        format!("{sensor}.{entry}")
    }
}

/// Reads a log whose columns mean what `mappings` say, as [`Episode::read`] does; with what was passed over or mended.
///
/// # Errors
/// When the file cannot be read, or a row, a column or a mapping is wrong; the message names it.
pub fn read(
    path: &Path,
    layout: &Layout,
    mappings: &[ColumnMapping],
) -> Result<(Episode, LogNotes)> {
    mappings.iter().try_for_each(|m| m.check(layout))?;
    let ending = path.extension().map(|e| e.to_ascii_lowercase());
    let read = |path: &Path| match ending.as_deref().and_then(|e| e.to_str()) {
        #[cfg(feature = "parquet")]
        Some("parquet") => parquet::read(path, layout, mappings),
        #[cfg(not(feature = "parquet"))]
        Some("parquet") => Err(
            "is a Parquet file, which this build cannot read: build with `--features parquet`, \
                 or convert it to CSV"
                .to_owned(),
        ),
        _ => csv::read(path, layout, mappings),
    };
    read(path).map_err(|message| Error::Log {
        path: path.to_owned(),
        message,
    })
}

#[cfg(test)]
mod tests;
