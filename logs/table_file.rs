//! A table of any names as a log: which column has the stamps.

use crate::episode::seconds;
use crate::raw::RawLog;
use crate::series::Series;

/// Names of columns of stamps, as programs write them, the usual ones first.
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

/// Whether a name is one of a column of stamps, and how usual: lower is more so.
fn rank(name: &str) -> Option<usize> {
    let name = name.to_lowercase();
    // A unit in brackets, or behind an underscore.
    let bare = name.split(['[', '(']).next().unwrap_or_default().trim();
    let units = ["_ns", "_us", "_ms", "_s", "_sec"];
    let plain = units
        .iter()
        .find_map(|u| bare.strip_suffix(u))
        .unwrap_or(bare);
    let at = |name: &str| STAMPS.iter().position(|s| *s == name);
    at(bare).or_else(|| at(plain))
}

/// The column of stamps among some: by its name, else the first that only grows.
#[must_use]
pub fn stamps(columns: &[(String, Vec<f64>)]) -> Option<usize> {
    let named = (0..columns.len()).filter_map(|i| Some((rank(&columns[i].0)?, i)));
    let grows = |values: &[f64]| values.len() > 2 && values.windows(2).all(|w| w[1] > w[0]);
    named
        .min()
        .map(|(_, i)| i)
        .or_else(|| columns.iter().position(|(_, values)| grows(values)))
}

/// The log of a table. Columns without a number are left out.
///
/// # Errors
/// When no column has stamps.
pub fn log(name: &str, columns: Vec<(String, Vec<f64>)>) -> Result<RawLog, String> {
    let Some(place) = stamps(&columns) else {
        let names: Vec<&str> = columns.iter().take(8).map(|(n, _)| &**n).collect();
        return Err(format!(
            "has no column of stamps: one named `time`, or one that only grows; its columns are {}",
            names.join(", ")
        ));
    };
    let mut time = columns[place].1.clone();
    seconds(&mut time);
    let first = time.iter().copied().find(|t| t.is_finite()).unwrap_or(0.0);
    time.iter_mut().for_each(|t| *t -= first);
    let numberless = columns.iter().enumerate().filter(|(i, (name, values))| {
        *i != place && !name.is_empty() && values.iter().all(|x| !x.is_finite())
    });
    let numberless: Vec<&str> = numberless.map(|(_, (name, _))| &**name).collect();
    let series = columns.iter().enumerate().filter(|(i, _)| *i != place);
    let series = series.filter_map(|(_, (name, values))| {
        let points = time.iter().zip(values);
        let mut points: Vec<(f64, f64)> = points
            .map(|(t, x)| (*t, *x))
            .filter(|(t, x)| t.is_finite() && x.is_finite())
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        (!points.is_empty()).then(|| Series {
            name: name.clone(),
            stream: String::new(),
            time: points.iter().map(|p| p.0).collect(),
            values: points.iter().map(|p| p.1).collect(),
        })
    });
    Ok(RawLog {
        name: name.to_owned(),
        series: series.collect(),
        stamps: Some(columns[place].0.clone()),
        remarks: if numberless.is_empty() {
            Vec::new()
        } else {
            vec![format!(
                "columns without a number are not read: {}",
                numberless.join(", ")
            )]
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_are_found_by_name_and_else_by_growing() {
        let column = |name: &str, values: &[f64]| (name.to_owned(), values.to_vec());
        let rows = [
            column("q", &[1.0, 1.0, 1.0]),
            column("frame", &[1.0, 2.0, 3.0]),
            column("Time [ms]", &[0.0, 10.0, 20.0]),
        ];
        assert_eq!(stamps(&rows), Some(2));
        assert_eq!(stamps(&rows[..2]), Some(1));
        assert_eq!(stamps(&rows[..1]), None);
        let log = log("log", rows.to_vec()).unwrap();
        assert_eq!(log.stamps.as_deref(), Some("Time [ms]"));
        assert_eq!(log.series.len(), 2);
    }
}
