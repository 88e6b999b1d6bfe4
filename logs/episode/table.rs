//! Logs that another reader has converted to columns: recordings of other stacks.
//!
//! Streams with different rates become one table (see [`crate::align`]), with NaN where a row has
//! no reading. Such a log is then read like a CSV file.

use std::path::Path;

use asid_core::layout::Layout;
use asid_core::{Episode, Error, Result};

use super::mapping::Source;
use super::reader::Reader;
use super::{Angle, ColumnMapping, LogNotes, entry_name};

/// Columns of numbers over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Stamps, s; one for each row.
    pub time: Vec<f64>,
    /// Name and values of each column, as long as `time`; NaN where there is no value.
    pub columns: Vec<(String, Vec<f64>)>,
}

/// Names of the columns of the commands and of the readings, under some mappings.
///
/// The columns of an initial state (`qpos.*`, `qvel.*`) are not included.
#[must_use]
pub fn wanted(layout: &Layout, mappings: &[ColumnMapping]) -> [Vec<String>; 2] {
    let commands = layout.actuators.iter();
    let commands = commands.map(|a| Source::of(mappings, &format!("ctrl.{}", a.name), None).column);
    let readings = layout.sensors.iter().flat_map(|s| {
        let entry = move |i: usize| Source::of(mappings, &s.name, (s.len > 1).then_some(i)).column;
        (0..s.len).map(entry)
    });
    [commands.collect(), readings.collect()]
}

/// Names of all quantities that a log may hold: the commands, and every entry of every sensor.
#[must_use]
pub fn quantities(layout: &Layout) -> Vec<String> {
    let commands = layout.actuators.iter().map(|a| format!("ctrl.{}", a.name));
    let sensors = layout.sensors.iter();
    let entries = sensors.flat_map(|s| (0..s.len).map(|i| entry_name(&s.name, s.len, i)));
    commands.chain(entries).collect()
}

/// Reads a table as [`super::read`] reads a file; errors name `path`.
///
/// # Errors
/// When a row, a column or a mapping is wrong; the message names it.
pub fn of_table(
    path: &Path,
    table: &Table,
    layout: &Layout,
    (mappings, angles): (&[ColumnMapping], &[Angle]),
) -> Result<(Episode, LogNotes)> {
    mappings.iter().try_for_each(|m| m.check(layout))?;
    let read = || -> Result<(Episode, LogNotes), String> {
        let names = table.columns.iter().map(|(name, _)| name.clone());
        let header = std::iter::once("time".to_owned()).chain(names).collect();
        let mut reader = Reader::new(layout, (mappings, angles), header)?;
        // The stamps are already in seconds.
        reader.time_factor = Some(1.0);
        for (row, time) in table.time.iter().enumerate() {
            reader.row(row + 2, |column| {
                let x = match column.checked_sub(1) {
                    None => *time,
                    Some(column) => table.columns[column]
                        .1
                        .get(row)
                        .copied()
                        .unwrap_or(f64::NAN),
                };
                if x.is_infinite() {
                    return Err(x.to_string());
                }
                Ok(x)
            })?;
        }
        reader.finish()
    };
    read().map_err(|message| Error::Log {
        path: path.to_owned(),
        message,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::episode::tests::layout;

    #[test]
    fn a_table_is_the_csv_log_of_the_same_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        std::fs::write(&path, "time,ctrl.servo,angle\n0,1,0.25\n0.5,,\n1,3,-0.5\n").unwrap();
        let from_csv = crate::episode::read(&path, &layout()).unwrap();
        let nan = f64::NAN;
        let table = Table {
            time: vec![0.0, 0.5, 1.0],
            columns: vec![
                ("angle".into(), vec![0.25, nan, -0.5]),
                ("ctrl.servo".into(), vec![1.0, nan, 3.0]),
            ],
        };
        let (of_table, _) = of_table(&path, &table, &layout(), (&[], &[])).unwrap();
        assert_eq!(
            (&of_table.time, &of_table.ctrl),
            (&from_csv.time, &from_csv.ctrl)
        );
        assert_eq!(of_table.readings[0], from_csv.readings[0]);
        assert!(of_table.readings[1].is_nan() && from_csv.readings[1].is_nan());
    }

    #[test]
    fn what_is_wanted_are_the_columns_that_mappings_name() {
        let mapping = ColumnMapping {
            from: Some("/imu.tip".into()),
            ..ColumnMapping::of("tip")
        };
        let [commands, readings] = wanted(&layout(), &[mapping]);
        assert_eq!(commands, ["ctrl.servo"]);
        assert_eq!(readings[..2], ["angle", "/imu.tip.0"]);
        assert_eq!(quantities(&layout())[2], "tip.0");
    }
}
