//! Converts a table with any names to a log: finds the column of the stamps.

use crate::episode::{seconds, stamps_in, stamps_read_as};
use crate::raw::{Numberless, RawLog};
use crate::series::Series;
use asid_core::Error;

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

    /// Its name, or its place in the table of these `columns` if it has none.
    fn shown(&self, columns: &[Self]) -> String {
        if !self.name.is_empty() {
            return self.name.clone();
        }
        let place = columns.iter().position(|c| std::ptr::eq(c, self));
        format!("column {} without a name", place.unwrap_or(0) + 1)
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

/// Words in the names of columns that hold times.
const WORDS: [&str; 3] = ["time", "clock", "stamp"];
/// Units that a column of stamps has at the end of its name, as `_ms`, `[ms]` or `(ms)`.
const UNITS: [(&str, &str); 5] = [
    ("ns", "ns"),
    ("us", "us"),
    ("ms", "ms"),
    ("s", "s"),
    ("sec", "s"),
];

/// A name without the unit at its end, and that unit.
fn without_unit(name: &str) -> (String, Option<&'static str>) {
    let name = name.to_lowercase();
    let known = |text: &str| UNITS.iter().find(|(own, _)| *own == text).map(|u| u.1);
    if let Some((bare, rest)) = name.split_once(['[', '(']) {
        let unit = known(rest.trim_end_matches([']', ')', ' ']).trim());
        return (bare.trim().to_owned(), unit);
    }
    match name.rsplit_once('_') {
        Some((bare, end)) if known(end).is_some() => (bare.to_owned(), known(end)),
        _ => (name, None),
    }
}

/// Rank of a name as a column of stamps, the usual ones lower; `None` for other names.
fn rank(name: &str) -> Option<usize> {
    let at = |name: &str| STAMPS.iter().position(|s| *s == name);
    at(&name.to_lowercase()).or_else(|| at(&without_unit(name).0))
}

/// The column of the stamps: by its name, else the first that strictly increases and whose name
/// speaks of time, else the first that strictly increases.
#[must_use]
pub fn stamps(columns: &[Column]) -> Option<usize> {
    let named = (0..columns.len()).filter_map(|i| Some((rank(&columns[i].name)?, i)));
    let grows = |values: &[f64]| values.len() > 2 && values.windows(2).all(|w| w[1] > w[0]);
    // A column without a name, as pandas writes one for its index, counts rows.
    let growing = || {
        let all = 0..columns.len();
        all.filter(|i| !columns[*i].name.is_empty() && grows(&columns[*i].values))
    };
    let of_time = |i: &usize| {
        let name = columns[*i].name.to_lowercase();
        WORDS.iter().any(|word| name.contains(word))
    };
    // Where no column of these names has a number, its text tells what is wrong.
    let (empty, named): (Vec<_>, Vec<_>) = named.partition(|(_, i)| columns[*i].is_numberless());
    let first = |of: Vec<(usize, usize)>| of.into_iter().min().map(|(_, i)| i);
    first(named)
        .or_else(|| growing().find(of_time))
        .or_else(|| first(empty))
        .or_else(|| growing().next())
}

/// The log of a table, whose stamps are in the column of the `given` name or in the one that is
/// [found](stamps). Columns without a number are left out.
///
/// # Errors
/// When no column has stamps, or they are not numbers.
pub fn log(name: &str, columns: &[Column], given: Option<&str>) -> Result<RawLog, String> {
    let place = match given {
        Some(given) => Some(
            columns
                .iter()
                .position(|c| c.name == given)
                .ok_or_else(|| {
                    let near = Error::nearest(given, columns.iter().map(|c| &*c.name));
                    let near = near.map_or_else(String::new, |near| format!("; is it `{near}`?"));
                    format!("has no column `{given}`, which is to hold the stamps{near}")
                })?,
        ),
        None => stamps(columns),
    };
    let Some(place) = place else {
        let shown = columns.iter().take(8).map(|c| c.shown(columns));
        let names: Vec<String> = shown.collect();
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
    // The unit in its name decides; else that of its rate or date.
    let stated = without_unit(&stamps.name).1;
    let guessed = match stated {
        Some(unit) => {
            stamps_in(unit, &mut time);
            None
        }
        None => seconds(&mut time),
    };
    let first = time.iter().copied().find(|t| t.is_finite()).unwrap_or(0.0);
    time.iter_mut().for_each(|t| *t -= first);
    let others = || {
        let all = columns.iter().enumerate();
        all.filter(|(i, _)| *i != place).map(|(_, c)| c)
    };
    let (named, nameless): (Vec<_>, Vec<_>) = others().partition(|c| !c.name.is_empty());
    let numberless = named.iter().filter(|c| c.is_numberless());
    // The first one may be an index, which nobody misses.
    let lost = nameless.iter().filter(|c| !std::ptr::eq(**c, &columns[0]));
    let lost = lost.filter(|c| !c.is_numberless());
    let lost = lost.map(|c| format!("{} is not read: name it in the header", c.shown(columns)));
    Ok(RawLog {
        name: name.to_owned(),
        numberless: numberless
            .map(|c| Numberless {
                name: c.name.clone(),
                cell: c.text.clone(),
            })
            .collect(),
        series: named.iter().filter_map(|c| series(&time, c)).collect(),
        stamps: Some(stamps.name.clone()),
        stamps_unit: stated,
        remarks: guessed
            .map(stamps_read_as)
            .into_iter()
            .chain(lost)
            .collect(),
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
        let log = log("log", &rows, None).unwrap();
        assert_eq!(log.stamps.as_deref(), Some("Time [ms]"));
        assert_eq!(log.series.len(), 2);
    }

    /// Symptom: "not used: , " and "left are ,", and a column without a name was the clock.
    #[test]
    fn a_column_without_a_name_is_told_by_its_place() {
        let column = |name: &str, values: [f64; 3]| Column {
            values: values.into(),
            ..Column::named(name)
        };
        let (counter, time) = ([0.0, 1.0, 2.0], [0.0, 0.01, 0.02]);
        let index = column("", counter);
        let table = [index.clone(), column("time", time), column("", counter)];
        let read = log("log", &table, None).unwrap();
        assert!(read.series.is_empty());
        let expected = "column 3 without a name is not read: name it in the header";
        assert_eq!(read.remarks, [expected]);
        let said = log("log", &[index, column("q", [1.0; 3])], None).unwrap_err();
        assert!(said.contains("column 1 without a name, q"), "{said}");
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
            let log = log("log", &[time, angle], None).unwrap();
            let [found] = &log.series[..] else {
                panic!("{:?}", log.series)
            };
            assert_eq!(found.values, [1.0, 2.0]);
            assert_eq!(found.time[0], 0.0);
            assert!((found.time[1] - 0.01).abs() < 1e-6, "{:?}", found.time);
        }
    }

    /// Symptom: rows at 2 kHz with `time_ms` were read as rows at 2 Hz, and those of a slow log with
    /// `time_s` as rows at 1 kHz.
    ///
    /// Cause: the unit in the name was only taken off, and the rate decided.
    #[test]
    fn the_unit_in_the_name_of_the_stamps_decides() {
        for (name, values, step, unit) in [
            ("time_ms", [0.0, 0.5, 1.0], 5e-4, "ms"),
            ("timestamp_us", [0.0, 250.0, 500.0], 2.5e-4, "us"),
            ("time_s", [0.0, 1.0, 2.0], 1.0, "s"),
            ("Time (s)", [5.0, 6.0, 7.0], 1.0, "s"),
        ] {
            let time = Column {
                values: values.to_vec(),
                ..Column::named(name)
            };
            let angle = Column {
                values: vec![1.0; 3],
                ..Column::named("angle")
            };
            let log = log("log", &[time, angle], None).unwrap();
            assert_eq!(log.stamps_unit, Some(unit), "{name}");
            assert!((log.series[0].time[1] - step).abs() < 1e-12, "{name}");
        }
    }

    /// Symptom: a counter of frames was the clock beside a column `host_clock_s`, and a column `time`
    /// of dates kept `elapsed` from being it.
    #[test]
    fn a_counter_or_dates_are_no_clock_beside_one() {
        let column = |name: &str, values: [f64; 3]| Column {
            values: values.into(),
            text: "2026-01-01".into(),
            ..Column::named(name)
        };
        let (frame, clock) = (
            column("frame", [0.0, 1.0, 2.0]),
            column("host_clock_s", [0.0, 0.02, 0.04]),
        );
        let dates = column("time", [f64::NAN; 3]);
        let elapsed = column("elapsed", [0.0, 0.02, 0.04]);
        let both = [frame.clone(), clock];
        assert_eq!(stamps(&both), Some(1));
        assert_eq!(stamps(&[dates.clone(), elapsed]), Some(1));
        assert_eq!(stamps(&[dates, frame]), Some(0), "its text is told");
        // The user has the last word.
        let given = log("log", &both, Some("frame")).unwrap();
        assert_eq!(given.stamps.as_deref(), Some("frame"));
        let said = log("log", &both, Some("host_clock")).unwrap_err();
        assert!(said.contains("is it `host_clock_s`?"), "{said}");
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
        let said = log("log", &columns, None).unwrap_err();
        assert!(
            said.contains(
                "column `time`, the stamps, holds no numbers but text such as `2026-01-01T10:00:00`"
            ),
            "{said}"
        );
    }
}
