//! A log as it was recorded: series of numbers, each with the stamps of its own stream.

use std::collections::HashMap;

use crate::align;
use crate::episode::{Angle, LogNotes, Table};
use crate::series::Series;

/// A log of one episode.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawLog {
    /// Name of its file, with the episode's number where a file holds several.
    pub name: String,
    /// Its series, by name.
    pub series: Vec<Series>,
    /// Column of the stamps, for a table.
    pub stamps: Option<String>,
    /// Unit that the name of this column states.
    pub stamps_unit: Option<&'static str>,
    /// Columns of a table without any number.
    pub numberless: Vec<Numberless>,
    /// Remarks for the user: streams that could not be read, and why.
    pub remarks: Vec<String>,
}

/// A column of a table without any number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Numberless {
    /// Its name.
    pub name: String,
    /// Its first cell that is not empty; empty where all are, or where the format has no text.
    pub cell: String,
}

impl Numberless {
    /// Its name, with its first text if any.
    #[must_use]
    pub fn told(&self) -> String {
        if self.cell.is_empty() {
            self.name.clone()
        } else {
            format!("{} (`{}`)", self.name, self.cell)
        }
    }
}

impl RawLog {
    /// The series of this name.
    #[must_use]
    pub fn series(&self, name: &str) -> Option<&Series> {
        self.series.iter().find(|s| s.name == name)
    }

    /// Concatenates logs, with every series that any of them has.
    ///
    /// A quantity that rests in one episode may move in another.
    #[must_use]
    pub fn joined<'l>(logs: impl IntoIterator<Item = &'l Self>) -> Self {
        let mut logs = logs.into_iter();
        let Some(mut whole) = logs.next().cloned() else {
            return Self::default();
        };
        for log in logs {
            let rows = log.series.iter().map(|s| s.time.len()).max().unwrap_or(0);
            let between = log.duration() / rows.max(2) as f64;
            let ends = whole.series.iter().filter_map(|s| s.time.last());
            let after = ends.copied().fold(0.0, f64::max) + between;
            let first = log.series.iter().filter_map(|s| s.time.first());
            let shift = after - first.copied().fold(f64::INFINITY, f64::min);
            for more in &log.series {
                let later = more.time.iter().map(|t| t + shift);
                match whole.series.iter_mut().find(|s| s.name == more.name) {
                    Some(own) => {
                        own.time.extend(later);
                        own.values.extend(&more.values);
                    }
                    None => whole.series.push(Series {
                        time: later.collect(),
                        ..more.clone()
                    }),
                }
            }
            for more in &log.numberless {
                if !whole.numberless.iter().any(|own| own.name == more.name) {
                    whole.numberless.push(more.clone());
                }
            }
            for remark in &log.remarks {
                if !whole.remarks.contains(remark) {
                    whole.remarks.push(remark.clone());
                }
            }
        }
        whole
            .numberless
            .retain(|n| !whole.series.iter().any(|s| s.name == n.name));
        whole
    }

    /// Time from the first stamp to the last, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        let ends = |s: &Series| Some((*s.time.first()?, *s.time.last()?));
        let (mut first, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
        for (a, b) in self.series.iter().filter_map(ends) {
            first = first.min(a);
            last = last.max(b);
        }
        (last - first).max(0.0)
    }

    /// The series of these names as a table (see [`align`]), and notes of the unused streams.
    ///
    /// Time counts from the first row. The turns of these `angles` are counted before anything is
    /// interpolated.
    #[must_use]
    pub fn table(
        &self,
        commands: &[String],
        readings: &[String],
        angles: &[Angle],
    ) -> (Table, LogNotes) {
        let found = |names: &[String]| -> Vec<&Series> {
            let all = names.iter().filter_map(|name| self.series(name));
            all.filter(|s| !s.time.is_empty()).collect()
        };
        let (sent, read) = (found(commands), found(readings));
        let (counted, turns) = self.with_counted_turns(&read, angles);
        let read: Vec<&Series> = (read.iter().map(|own| {
            let counted = counted.iter().find(|s| s.name == own.name);
            counted.unwrap_or(own)
        }))
        .collect();
        let rows = align::rows(if read.is_empty() { &sent } else { &read });
        let mut columns: Vec<(String, Vec<f64>)> = sent
            .iter()
            .map(|s| (s.name.clone(), align::commands(s, &rows)))
            .collect();
        let readings = read.iter();
        columns.extend(readings.map(|s| (s.name.clone(), align::readings(s, &rows))));
        let first = rows.first().copied().unwrap_or(0.0);
        let names: Vec<&Series> = sent.into_iter().chain(read).collect();
        let notes = LogNotes {
            passed_over: self.passed_over(&names),
            turns,
            ..LogNotes::default()
        };
        let time = rows.iter().map(|t| t - first).collect();
        (Table { time, columns }, notes)
    }

    /// Those of some series whose angles jump by a turn, without the jumps, and their sensors with
    /// the number of jumps.
    fn with_counted_turns(
        &self,
        read: &[&Series],
        angles: &[Angle],
    ) -> (Vec<Series>, Vec<(String, usize)>) {
        let jumping = |angle: &Angle| {
            let own = read.iter().find(|s| s.name == angle.column)?;
            let mut series = (*own).clone();
            let jumps = angle.unwrap_column(&mut series.values);
            (jumps > 0).then(|| (series, (angle.sensor.clone(), jumps)))
        };
        angles.iter().filter_map(jumping).unzip()
    }

    /// Streams without a chosen series; for a log that is one table, columns that are not chosen.
    fn passed_over(&self, chosen: &[&Series]) -> Vec<String> {
        let mut used: HashMap<&str, bool> = HashMap::new();
        let mut order = Vec::new();
        for s in &self.series {
            let own = if s.stream.is_empty() {
                &s.name
            } else {
                &s.stream
            };
            let entry = used.entry(own).or_insert_with(|| {
                order.push(own);
                false
            });
            *entry |= chosen.iter().any(|c| c.name == s.name);
        }
        let unused = order.into_iter().filter(|name| !used[name.as_str()]);
        unused.cloned().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(name: &str, stream: &str, points: &[(f64, f64)]) -> Series {
        Series {
            name: name.into(),
            stream: stream.into(),
            time: points.iter().map(|p| p.0).collect(),
            values: points.iter().map(|p| p.1).collect(),
        }
    }

    #[test]
    fn rows_are_those_of_the_readings_and_what_is_not_used_is_named() {
        let log = RawLog {
            series: vec![
                series("/a.x", "/a", &[(5.0, 1.0), (5.2, 2.0), (5.4, 3.0)]),
                series(
                    "/b.u",
                    "/b",
                    &[(1.0, 7.0), (4.9, 5.0), (5.3, 6.0), (40.0, 0.0)],
                ),
                series("/c.z", "/c", &[(5.1, 9.0)]),
            ],
            ..RawLog::default()
        };
        let (table, notes) = log.table(&["/b.u".into()], &["/a.x".into(), "absent".into()], &[]);
        for (t, want) in table.time.iter().zip([0.0, 0.2, 0.4]) {
            assert!((t - want).abs() < 1e-12);
        }
        let (u, x) = (&table.columns[0].1, &table.columns[1].1);
        assert_eq!(x, &[1.0, 2.0, 3.0]);
        assert!(
            u[0] == 5.0 && (u[1] - 5.5).abs() < 1e-9 && u[2] == 6.0,
            "{u:?}"
        );
        assert_eq!(notes.passed_over, ["/c"]);
        assert_eq!(table.columns.len(), 2);
        assert!((log.duration() - 39.0).abs() < 1e-12);
    }
}
