//! Merges streams with different stamps into one table.
//!
//! Rows are the stamps of the stream with the most series, within the time in which all streams of
//! about its rate have readings. A reading between two samples of another stream is interpolated
//! linearly, like a reading with a `delay` (docs/logs.md); this makes its noise slightly smaller.
//! Each sample of a slower stream goes to its nearest row, and the other rows are empty. A command
//! is the mean of what was sent over its row, which preserves its integral.

use crate::series::Series;

/// A stream with fewer samples in the time of the rows than this share of their number is slower:
/// its samples go to single rows.
const SLOWER: f64 = 0.7;
/// Multiple of the usual step between samples beyond which samples were lost.
pub const LOST: f64 = 2.5;

/// The stamps of the stream with the most series, in order; of two such, the faster.
#[must_use]
pub fn rows(readings: &[&Series]) -> Vec<f64> {
    let mut streams: Vec<(&str, usize, usize)> = Vec::new();
    for s in readings {
        match streams.iter_mut().find(|(name, ..)| *name == s.stream) {
            Some((_, series, samples)) => {
                *series += 1;
                *samples = (*samples).max(s.time.len());
            }
            None => streams.push((&s.stream, 1, s.time.len())),
        }
    }
    // On a tie, the first.
    streams.reverse();
    let main = streams
        .iter()
        .max_by_key(|(_, series, samples)| (*series, *samples));
    let main = main.map_or("", |(name, ..)| *name);
    let of_main = readings.iter().filter(|s| s.stream == main);
    let mut stamps: Vec<f64> = of_main.flat_map(|s| s.time.iter().copied()).collect();
    stamps.sort_by(f64::total_cmp);
    stamps.dedup();
    // The first and last row are complete: the initial state must be known.
    let all = stamps.clone();
    for s in readings.iter().filter(|s| !is_slower(s, &all)) {
        if let (Some(first), Some(last)) = (s.time.first(), s.time.last()) {
            stamps.retain(|t| (*first..=*last).contains(t));
        }
    }
    stamps
}

/// Whether a series has far fewer samples than there are rows, from the first row to the last.
fn is_slower(series: &Series, rows: &[f64]) -> bool {
    let (Some(&first), Some(&last)) = (rows.first(), rows.last()) else {
        return false;
    };
    let up_to_last = series.time.partition_point(|t| *t <= last);
    let before = series.time.partition_point(|t| *t < first);
    (up_to_last.saturating_sub(before) as f64) < SLOWER * rows.len() as f64
}

/// A series' readings at the rows; NaN where it has none.
#[must_use]
pub fn readings(series: &Series, rows: &[f64]) -> Vec<f64> {
    let mut column = vec![f64::NAN; rows.len()];
    let usual = usual_step(series);
    if is_slower(series, rows) {
        for time in &series.time {
            let Some(row) = nearest(rows, *time) else {
                continue;
            };
            // Before its first sample and after its last, a stream has no reading.
            if let Some(value) = on_line(series, rows[row], usual) {
                column[row] = value;
            }
        }
        return column;
    }
    for (cell, row) in column.iter_mut().zip(rows) {
        *cell = on_line(series, *row, usual).unwrap_or(f64::NAN);
    }
    column
}

/// Median time between samples; infinite for a single one.
fn usual_step(series: &Series) -> f64 {
    let mut steps: Vec<f64> = series.time.windows(2).map(|w| w[1] - w[0]).collect();
    let middle = steps.len() / 2;
    if steps.is_empty() {
        return f64::INFINITY;
    }
    *steps.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The value at a time: that of a sample, or interpolated between two near samples.
fn on_line(series: &Series, time: f64, usual: f64) -> Option<f64> {
    let after = series.time.partition_point(|t| *t < time);
    let b = *series.time.get(after)?;
    if b == time {
        return series.values.get(after).copied();
    }
    let before = after.checked_sub(1)?;
    let a = series.time[before];
    let (x, y) = (series.values[before], series.values[after]);
    (b - a <= LOST * usual).then(|| x + (time - a) / (b - a) * (y - x))
}

/// The row nearest to a time.
fn nearest(rows: &[f64], time: f64) -> Option<usize> {
    let after = rows.partition_point(|t| *t < time);
    let sides = [after.checked_sub(1), Some(after)];
    let there = sides.into_iter().flatten().filter(|&k| k < rows.len());
    there.min_by(|&a, &b| (rows[a] - time).abs().total_cmp(&(rows[b] - time).abs()))
}

/// A command over each row: the mean of what was sent from its stamp to the next.
///
/// NaN without any command, and in a last row that precedes the first command.
#[must_use]
pub fn commands(series: &Series, rows: &[f64]) -> Vec<f64> {
    let last = rows.len().saturating_sub(1);
    let mean = |k: usize| -> f64 {
        let from = rows[k];
        // The last row is as long as the one before it.
        let to = match rows.get(k + 1) {
            Some(next) => *next,
            None => 2.0 * from - rows[k.saturating_sub(1)],
        };
        let held = series.time.partition_point(|t| *t <= from);
        let inside = held..series.time.partition_point(|t| *t < to);
        // The first command also holds before it was sent, as docs/logs.md defines.
        let mut value = match held.checked_sub(1) {
            Some(place) => series.values[place],
            None => match series.values.first() {
                Some(first) if k < last => *first,
                _ => return f64::NAN,
            },
        };
        if inside.is_empty() || to <= from {
            return value;
        }
        let (mut sum, mut since) = (0.0, from);
        for place in inside {
            sum += value * (series.time[place] - since);
            (value, since) = (series.values[place], series.time[place]);
        }
        (sum + value * (to - since)) / (to - from)
    };
    (0..rows.len()).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(stream: &str, points: &[(f64, f64)]) -> Series {
        Series {
            name: format!("{stream}.x"),
            stream: stream.into(),
            time: points.iter().map(|p| p.0).collect(),
            values: points.iter().map(|p| p.1).collect(),
        }
    }

    fn line(stream: &str, step: f64, late: f64, count: usize) -> Series {
        let point = |k: usize| (k as f64 * step + late, 3.0 * (k as f64 * step + late));
        series(stream, &(0..count).map(point).collect::<Vec<_>>())
    }

    #[test]
    fn rows_are_the_stamps_of_the_stream_with_the_most_readings() {
        let (a, b, c) = (
            line("/a", 0.1, 0.0, 5),
            line("/a", 0.1, 0.0, 5),
            line("/b", 0.01, 0.003, 40),
        );
        assert_eq!(rows(&[&c, &a, &b]), a.time[1..4], "c runs from 3 to 393 ms");
        assert_eq!(rows(&[&a, &c]), c.time);
        assert!(rows(&[]).is_empty());
        // Streams of the same rate limit the time of the log; slower ones do not.
        let (later, slow) = (line("/b", 0.1, 0.05, 4), line("/b", 0.4, 0.07, 1));
        assert_eq!(rows(&[&a, &a, &later]), a.time[1..4]);
        assert_eq!(rows(&[&a, &a, &slow]), a.time);
    }

    /// A linear motion reads the same at any stamps.
    #[test]
    fn other_streams_are_read_on_the_line_between_their_samples() {
        let rows: Vec<f64> = (0..20).map(|k| 0.1 * f64::from(k)).collect();
        for (step, late) in [(0.1, 0.03), (0.013, 0.0), (0.1, 0.0)] {
            let column = readings(&line("/b", step, late, 400), &rows);
            for (row, x) in rows.iter().zip(&column).skip(1) {
                assert!((x - 3.0 * row).abs() < 1e-9, "{row} {x}");
            }
            assert_eq!(column[0].is_nan(), late > 0.0);
        }
    }

    #[test]
    fn a_slower_stream_leaves_rows_empty_and_a_gap_stays_a_gap() {
        let rows: Vec<f64> = (0..21).map(|k| 0.1 * f64::from(k)).collect();
        let slow = readings(&line("/b", 0.5, 0.02, 5), &rows);
        assert_eq!(slow.iter().filter(|x| x.is_finite()).count(), 4);
        assert!((slow[5] - 1.5).abs() < 1e-9);
        let mut gap = line("/b", 0.1, 0.05, 20);
        gap.time.drain(5..10);
        gap.values.drain(5..10);
        let column = readings(&gap, &rows);
        assert!(column[7].is_nan() && column[3].is_finite() && column[12].is_finite());
    }

    /// Symptom: a slow stream had a reading in each row.
    ///
    /// Cause: it counted as fast, since it was recorded for so long that it had as many samples as
    /// there are rows.
    #[test]
    fn a_slower_stream_that_is_recorded_for_longer_stays_slower() {
        let rows: Vec<f64> = (0..21).map(|k| 5.0 + 0.1 * f64::from(k)).collect();
        let column = readings(&line("/b", 0.5, 0.02, 40), &rows);
        let read = column.iter().filter(|x| x.is_finite()).count();
        assert_eq!(read, 5, "one reading in half a second: {column:?}");
    }

    #[test]
    fn a_command_keeps_its_integral_and_one_at_the_rows_is_itself() {
        let rows = [0.0, 0.1, 0.2, 0.3];
        let exact = series("/u", &[(0.0, 0.1), (0.1, 0.7), (0.2, -0.3), (0.3, 0.9)]);
        assert_eq!(commands(&exact, &rows), exact.values);
        let late = series("/u", &[(-1.0, 1.0), (0.125, 3.0)]);
        let column = commands(&late, &rows);
        assert_eq!(column[0], 1.0);
        assert!((column[1] - 2.5).abs() < 1e-12);
        assert_eq!(column[3], 3.0);
    }
}
