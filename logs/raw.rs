//! A log as it was recorded: series of numbers, each with the stamps of its own stream.

use std::collections::HashMap;

use asid_core::log::{LogNotes, Table};

/// One column of a log: a number over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Name: the topic or feature, and the way to the number in it, such as `/joint_states.position.elbow`.
    pub name: String,
    /// The stream that it came in with others: a topic; empty in a file that is one table.
    pub stream: String,
    /// Stamps, s from the log's start, in order.
    pub time: Vec<f64>,
    /// Values, one a stamp, finite.
    pub values: Vec<f64>,
}

/// A log of one episode.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawLog {
    /// Name: that of its file, with the episode's number where a file holds several.
    pub name: String,
    /// Its series, by name.
    pub series: Vec<Series>,
    /// Column of the stamps, of a table.
    pub stamps: Option<String>,
    /// What a reader should know: streams that could not be read, and why.
    pub remarks: Vec<String>,
}

impl RawLog {
    /// The series of this name.
    #[must_use]
    pub fn series(&self, name: &str) -> Option<&Series> {
        self.series.iter().find(|s| s.name == name)
    }

    /// Seconds from the first stamp to the last.
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

    /// The series of these names as a table, and what was not among them, by stream.
    ///
    /// Rows are all stamps from the first reading to the last, and time counts from the first row. A command that was sent
    /// before is held there.
    #[must_use]
    pub fn table(&self, commands: &[String], readings: &[String]) -> (Table, LogNotes) {
        let found = |names: &[String]| -> Vec<&Series> {
            let all = names.iter().filter_map(|name| self.series(name));
            all.filter(|s| !s.time.is_empty()).collect()
        };
        let (sent, read) = (found(commands), found(readings));
        let all = sent.iter().chain(&read);
        let bounding = if read.is_empty() { &sent } else { &read };
        let first = bounding.iter().map(|s| s.time[0]);
        let first = first.fold(f64::INFINITY, f64::min);
        let last = bounding.iter().filter_map(|s| s.time.last().copied());
        let last = last.fold(f64::NEG_INFINITY, f64::max);
        let mut stamps: Vec<f64> = all.clone().flat_map(|s| s.time.iter().copied()).collect();
        stamps.retain(|t| (first..=last).contains(t));
        stamps.sort_by(f64::total_cmp);
        stamps.dedup();
        let mut columns = Vec::new();
        for s in all {
            let mut column = vec![f64::NAN; stamps.len()];
            for (t, x) in s.time.iter().zip(&s.values) {
                if let Ok(row) = stamps.binary_search_by(|other| other.total_cmp(t)) {
                    column[row] = *x;
                }
            }
            columns.push((s.name.clone(), column));
        }
        for (s, (_, column)) in sent.iter().zip(&mut columns) {
            let before = s.time.partition_point(|t| *t <= first);
            if let (Some(cell), Some(k)) = (column.first_mut(), before.checked_sub(1)) {
                *cell = s.values[k];
            }
        }
        let notes = LogNotes {
            passed_over: self.passed_over(&[commands, readings].concat()),
            ..LogNotes::default()
        };
        stamps.iter_mut().for_each(|t| *t -= first);
        (
            Table {
                time: stamps,
                columns,
            },
            notes,
        )
    }

    /// Streams of which nothing is among `names`, and single columns of a log that is one table.
    fn passed_over(&self, names: &[String]) -> Vec<String> {
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
            *entry |= names.contains(&s.name);
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
    fn streams_keep_their_own_times() {
        let log = RawLog {
            series: vec![
                series("/a.x", "/a", &[(0.0, 1.0), (0.2, 2.0)]),
                series("/b.u", "/b", &[(0.1, 5.0), (0.2, 6.0)]),
                series("/c.z", "/c", &[(0.15, 9.0)]),
            ],
            ..RawLog::default()
        };
        let (table, notes) = log.table(&["/b.u".into()], &["/a.x".into(), "absent".into()]);
        assert_eq!(table.time, [0.0, 0.1, 0.2]);
        let (b, a) = (&table.columns[0].1, &table.columns[1].1);
        assert!(a[1].is_nan() && b[0].is_nan());
        assert_eq!([a[0], a[2], b[1], b[2]], [1.0, 2.0, 5.0, 6.0]);
        assert_eq!(notes.passed_over, ["/c"]);
        assert!((log.duration() - 0.2).abs() < 1e-12);
    }

    #[test]
    fn a_log_begins_and_ends_with_its_readings() {
        let log = RawLog {
            series: vec![
                series("x", "", &[(5.0, 1.0), (6.0, 2.0)]),
                series("u", "", &[(1.0, 7.0), (2.0, 8.0), (5.5, 9.0), (40.0, 0.0)]),
            ],
            ..RawLog::default()
        };
        let (table, _) = log.table(&["u".into()], &["x".into()]);
        assert_eq!(table.time, [0.0, 0.5, 1.0]);
        assert_eq!(table.columns[0].1[..2], [8.0, 9.0]);
    }
}
