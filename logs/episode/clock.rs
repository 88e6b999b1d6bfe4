//! The clock of a log: the unit of its stamps, and rows that are repeated or out of order.

use super::notes::LogNotes;

/// Longest row time of a machine's record, s: slower stamps must be in a finer unit.
const SLOWEST: f64 = 0.7;
/// Longest row time for units finer than the second, s.
///
/// It is shorter because stamps of a fast log in the next finer unit look like those of a slow log
/// in this one: 500 us against 500 ms.
const SLOWEST_FINE: f64 = 0.3;
/// Stamps beyond this count from 1970, s: the year 2001.
const EPOCH: f64 = 1e9;
/// Number of row times by which a row may be early to count as a late arrival, which is sorted.
///
/// A larger step back means that the clock was set.
const LATE_ARRIVAL: f64 = 10.0;
/// Most physics steps of a log: beyond it a single replay takes minutes, and the stamps are wrong.
const MOST_STEPS: f64 = 2e7;

/// Units of stamps from the coarsest on: name, and length in s.
const STAMPS: [(&str, f64); 4] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];

/// Median of the positive time steps between rows; `None` where there is none.
fn row_time(stamps: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = stamps.windows(2).map(|w| w[1] - w[0]).collect();
    steps.retain(|dt| *dt > 0.0);
    let middle = steps.len() / 2;
    (!steps.is_empty()).then(|| *steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// First stamp that is a number: a row of units, for example, has none. 0 if there is none.
fn first(stamps: &[f64]) -> f64 {
    let mut numbers = stamps.iter().copied().filter(|t| t.is_finite());
    numbers.next().unwrap_or(0.0)
}

/// Unit of stamps: by their date if they count from 1970, else by their rate.
///
/// The rate selects the coarsest unit in which rows are as frequent as a machine is sampled.
fn unit(stamps: &[f64]) -> (&'static str, f64) {
    let first = first(stamps);
    // In its own unit, a date of this century is one to ten times the year 2001.
    let dated = STAMPS
        .iter()
        .find(|(_, length)| (EPOCH..10.0 * EPOCH).contains(&(first * length)));
    // Small stamps are no date in any coarse unit. A count of ns since boot may look like a date in
    // us.
    let fits = |(name, length): &(&str, f64)| {
        let slowest = if *name == "s" { SLOWEST } else { SLOWEST_FINE };
        row_time(stamps).is_none_or(|dt| dt * length < slowest)
    };
    let dated = dated.filter(|d| fits(d));
    let by_rate = STAMPS.iter().find(|u| fits(u));
    *dated.or(by_rate).unwrap_or(&STAMPS[0])
}

/// Converts stamps to seconds; `given` is the factor that the study states.
///
/// Dates, and stamps in another unit than the second, are counted from the first.
pub(super) fn to_seconds(stamps: &mut [f64], given: Option<f64>, notes: &mut LogNotes) {
    let (name, length) = match given {
        Some(length) => ("s", length),
        None => unit(stamps),
    };
    if name != "s" {
        notes.time_unit = Some(name);
    }
    let first = first(stamps);
    let start = if length == 1.0 && first.abs() < EPOCH {
        0.0
    } else {
        first
    };
    stamps.iter_mut().for_each(|t| *t = (*t - start) * length);
}

/// The note on stamps in another unit than the second.
#[must_use]
pub fn stamps_read_as(unit: &str) -> String {
    format!(
        "stamps are read as {unit}, by their rate or date, and counted from the first: `[[column]] name = \"time\"` with `unit` states another \
         unit"
    )
}

/// Converts stamps of an unknown unit to seconds; returns the unit if it is not the second.
pub fn seconds(stamps: &mut [f64]) -> Option<&'static str> {
    let mut notes = LogNotes::default();
    to_seconds(stamps, None, &mut notes);
    notes.time_unit
}

/// Converts stamps of a known unit to seconds; dates are counted from the first.
pub fn stamps_in(unit: &str, stamps: &mut [f64]) {
    let length = STAMPS.iter().find(|(name, _)| *name == unit);
    let length = length.map_or(1.0, |(_, length)| *length);
    to_seconds(stamps, Some(length), &mut LogNotes::default());
}

/// Order of the rows in time: late arrivals are sorted, and the last of rows with one stamp is
/// kept.
///
/// Messages name rows by `numbers`.
pub(super) fn order(
    time: &[f64],
    numbers: &[usize],
    notes: &mut LogNotes,
) -> Result<Vec<usize>, String> {
    let usual = row_time(time).unwrap_or(0.0);
    let mut latest = f64::NEG_INFINITY;
    for (&row, &t) in numbers.iter().zip(time) {
        if t < latest - LATE_ARRIVAL * usual {
            return Err(format!(
                "row {row}: the time goes back from {latest} to {t} s: give each episode a file of its own"
            ));
        }
        notes.reordered += usize::from(t < latest);
        latest = latest.max(t);
    }
    let mut rows: Vec<usize> = (0..time.len()).collect();
    rows.sort_by(|&a, &b| time[a].total_cmp(&time[b]));
    let all = rows.len();
    // Of rows with the same stamp, keep the last.
    let mut kept: Vec<usize> = Vec::with_capacity(all);
    for row in rows {
        match kept.last_mut() {
            Some(last) if time[*last] == time[row] => *last = row,
            _ => kept.push(row),
        }
    }
    notes.doubled = all - kept.len();
    Ok(kept)
}

/// Refuses a log that no simulator replays within minutes; messages name rows by `numbers`.
pub(super) fn check_duration(time: &[f64], numbers: &[usize], timestep: f64) -> Result<(), String> {
    let (Some(first), Some(last)) = (time.first(), time.last()) else {
        return Ok(());
    };
    let seconds = last - first;
    if timestep > 0.0 && seconds / timestep > MOST_STEPS {
        let gap = time.windows(2).enumerate();
        let widest = gap.max_by(|(_, a), (_, b)| (a[1] - a[0]).total_cmp(&(b[1] - b[0])));
        let row = widest.map_or(0, |(i, _)| numbers[i + 1]);
        return Err(format!(
            "lasts {seconds:.0} s, {:.1e} time steps of the model: are its stamps in seconds? \
             The longest step in time leads to row {row}. `[[column]] name = \"time\"` with `unit` states another unit",
            seconds / timestep
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stamps of 50 rows at some rate, from a start, in a unit of some length.
    fn stamps(start: f64, rate: f64, length: f64) -> Vec<f64> {
        (0..50)
            .map(|k| ((start + f64::from(k) / rate) / length).round())
            .collect()
    }

    #[test]
    fn stamps_in_ms_us_and_ns_are_recognised_at_the_rates_of_machines() {
        for (name, length) in &STAMPS[1..] {
            for rate in [10.0, 50.0, 100.0, 1000.0] {
                for start in [0.0, 37.5, 1.7e9] {
                    // Doubles resolve today's ns stamps to 256 ns, less than 0.1 % of a row time at
                    // 1 kHz.
                    let told = unit(&stamps(start, rate, *length));
                    assert_eq!(told.0, *name, "{rate} Hz from {start} s");
                }
            }
        }
    }

    #[test]
    fn stamps_in_seconds_stay() {
        for rate in [2.0, 10.0, 1000.0] {
            for start in [0.0, 1000.0, 1.7e9] {
                let time: Vec<f64> = (0..50).map(|k| start + f64::from(k) / rate).collect();
                assert_eq!(unit(&time).0, "s", "{rate} Hz from {start} s");
            }
        }
    }

    #[test]
    fn late_arrivals_are_put_in_order_and_doubled_stamps_once() {
        let mut notes = LogNotes::default();
        let rows = order(
            &[0.0, 0.1, 0.3, 0.2, 0.4, 0.4],
            &[2, 3, 4, 5, 6, 7],
            &mut notes,
        )
        .unwrap();
        assert_eq!(rows, [0, 1, 3, 2, 5]);
        assert_eq!((notes.reordered, notes.doubled), (1, 1));
    }

    #[test]
    fn a_clock_that_starts_anew_is_refused() {
        let mut time: Vec<f64> = (0..40).map(|k| 0.01 * f64::from(k)).collect();
        time.extend(time.clone());
        let numbers: Vec<usize> = (2..82).collect();
        let error = order(&time, &numbers, &mut LogNotes::default()).unwrap_err();
        assert!(
            error.contains("row 42") && error.contains("of its own"),
            "{error}"
        );
    }

    #[test]
    fn a_log_of_years_is_refused_in_one_line() {
        let error = check_duration(&[0.0, 0.01, 1.7e9], &[2, 3, 4], 0.001).unwrap_err();
        assert!(
            error.contains("row 4") && error.lines().count() == 1,
            "{error}"
        );
        assert!(check_duration(&[0.0, 100.0], &[2, 3], 0.001).is_ok());
    }
}
