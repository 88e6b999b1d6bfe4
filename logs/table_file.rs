//! Converts a table with any names to a log: finds the column of the stamps.

use crate::episode::{seconds, stamps_read_as};
use crate::raw::{Numberless, RawLog};
use crate::series::Series;

/// A column of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// Its numbers, one for each row; NaN where there is none.
    pub values: Vec<f64>,
    /// Its first cell that is neither a number nor missing; empty if there is none.
    pub text: String,
}

impl Column {
    /// A column without a row.
    #[must_use]
    pub fn named(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            ..Self::default()
        }
    }

    /// Whether no row has a number.
    fn is_numberless(&self) -> bool {
        self.values.iter().all(|x| !x.is_finite())
    }
}

/// Names that programs give to columns of stamps, the usual ones first.
const STAMPS: [&str; 12] = [
    "time",
    "timestamp",
    "stamp",
    "t",
    "__time",
    "elapsed",
    "seconds",
    "sec",
    "time_s",
    "clock",
    "header.stamp",
    "monotonic",
];

/// Rank of a name as a column of stamps, the usual ones lower; `None` for other names.
fn rank(name: &str) -> Option<usize> {
    let name = name.to_lowercase();
    // Remove a unit in brackets, or after an underscore.
    let bare = name.split(['[', '(']).next().unwrap_or_default().trim();
    let units = ["_ns", "_us", "_ms", "_s", "_sec"];
    let plain = units
        .iter()
        .find_map(|u| bare.strip_suffix(u))
        .unwrap_or(bare);
    let at = |name: &str| STAMPS.iter().position(|s| *s == name);
    at(bare).or_else(|| at(plain))
}

/// The column of the stamps: by its name, else the first that strictly increases.
#[must_use]
pub fn stamps(columns: &[Column]) -> Option<usize> {
    let named = (0..columns.len()).filter_map(|i| Some((rank(&columns[i].name)?, i)));
    let grows = |values: &[f64]| values.len() > 2 && values.windows(2).all(|w| w[1] > w[0]);
    named
        .min()
        .map(|(_, i)| i)
        .or_else(|| columns.iter().position(|c| grows(&c.values)))
}

/// The log of a table. Columns without a number are left out.
///
/// # Errors
/// When no column has stamps, or they are not numbers.
pub fn log(name: &str, columns: &[Column]) -> Result<RawLog, String> {
    let Some(place) = stamps(columns) else {
        let names: Vec<&str> = columns.iter().take(8).map(|c| &*c.name).collect();
        return Err(format!(
            "has no column of stamps: one named `time`, or one that only grows; its columns are {}",
            names.join(", ")
        ));
    };
    let stamps = &columns[place];
    if stamps.is_numberless() {
        return Err(numberless_stamps(stamps));
    }
    let mut time = stamps.values.clone();
    let unit = seconds(&mut time);
    let first = time.iter().copied().find(|t| t.is_finite()).unwrap_or(0.0);
    time.iter_mut().for_each(|t| *t -= first);
    let others = || {
        let all = columns.iter().enumerate();
        all.filter(|(i, _)| *i != place).map(|(_, c)| c)
    };
    let numberless = others().filter(|c| !c.name.is_empty() && c.is_numberless());
    Ok(RawLog {
        name: name.to_owned(),
        numberless: numberless
            .map(|c| Numberless {
                name: c.name.clone(),
                cell: c.text.clone(),
            })
            .collect(),
        series: others().filter_map(|c| series(&time, c)).collect(),
        stamps: Some(stamps.name.clone()),
        remarks: unit.map(stamps_read_as).into_iter().collect(),
    })
}

/// The error for a column of stamps without a number.
fn numberless_stamps(stamps: &Column) -> String {
    let holds = if stamps.text.is_empty() {
        "is empty".to_owned()
    } else {
        format!("holds no numbers but text such as `{}`", stamps.text)
    };
    format!(
        "column `{}`, the stamps, {holds}: write seconds, or ms, us or ns from a common start, in place of dates",
        stamps.name
    )
}

/// A column as a series, in the order of the stamps; `None` where it has no number.
fn series(time: &[f64], column: &Column) -> Option<Series> {
    let points = time.iter().zip(&column.values);
    let mut points: Vec<(f64, f64)> = points
        .map(|(t, x)| (*t, *x))
        .filter(|(t, x)| t.is_finite() && x.is_finite())
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    (!points.is_empty()).then(|| Series {
        name: column.name.clone(),
        stream: String::new(),
        time: points.iter().map(|p| p.0).collect(),
        values: points.iter().map(|p| p.1).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_are_found_by_name_and_else_by_growing() {
        let column = |name: &str, values: &[f64]| Column {
            values: values.to_vec(),
            ..Column::named(name)
        };
        let rows = [
            column("q", &[1.0, 1.0, 1.0]),
            column("frame", &[1.0, 2.0, 3.0]),
            column("Time [ms]", &[0.0, 10.0, 20.0]),
        ];
        assert_eq!(stamps(&rows), Some(2));
        assert_eq!(stamps(&rows[..2]), Some(1));
        assert_eq!(stamps(&rows[..1]), None);
        let log = log("log", &rows).unwrap();
        assert_eq!(log.stamps.as_deref(), Some("Time [ms]"));
        assert_eq!(log.series.len(), 2);
    }

    /// Symptom: a table with a row of units below its header had no column at all ("nothing is left
    /// in the log").
    ///
    /// Cause: stamps were counted from the first cell, which was no number, so that none was.
    #[test]
    fn a_row_without_a_stamp_leaves_the_other_rows_theirs() {
        let column = |name: &str, values: [f64; 3]| Column {
            values: values.into(),
            ..Column::named(name)
        };
        for start in [0.0, 1.7e9] {
            let time = column("time", [f64::NAN, start, start + 0.01]);
            let angle = column("angle", [f64::NAN, 1.0, 2.0]);
            let log = log("log", &[time, angle]).unwrap();
            let [found] = &log.series[..] else {
                panic!("{:?}", log.series)
            };
            assert_eq!(found.values, [1.0, 2.0]);
            assert_eq!(found.time[0], 0.0);
            assert!((found.time[1] - 0.01).abs() < 1e-6, "{:?}", found.time);
        }
    }

    #[test]
    fn stamps_that_are_dates_are_named() {
        let column = |name: &str, text: &str, value: f64| Column {
            name: name.into(),
            text: text.into(),
            values: vec![value; 2],
        };
        let columns = [
            column("time", "2026-01-01T10:00:00", f64::NAN),
            column("q", "", 1.0),
        ];
        let said = log("log", &columns).unwrap_err();
        assert!(
            said.contains(
                "column `time`, the stamps, holds no numbers but text such as `2026-01-01T10:00:00`"
            ),
            "{said}"
        );
    }
}
