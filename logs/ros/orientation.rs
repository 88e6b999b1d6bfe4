//! The signs of the quaternions of a topic.
//!
//! `q` and `-q` are one orientation, but none lies between them. Publishers that keep `w` positive
//! change the sign of all four once per turn, and entries that are interpolated one by one would
//! pass through 0.

use crate::series::Series;

/// Largest difference from 1 of a quaternion's squared length; rounding to three decimals stays
/// below it.
const ROUNDING: f64 = 0.01;

/// Gives each quaternion the sign closer to the one before.
///
/// A quaternion is four series of one record with the same stamps, named `.x`, `.y`, `.z` and `.w`.
pub(super) fn align_signs(series: &mut [Series]) {
    let records: Vec<[usize; 4]> = (0..series.len())
        .filter_map(|w| record(series, w))
        .collect();
    for record in records {
        let mut before: Option<[f64; 4]> = None;
        for k in 0..series[record[0]].values.len() {
            let mut q = record.map(|i| series[i].values[k]);
            if (dot(q, q) - 1.0).abs() > ROUNDING {
                continue;
            }
            if before.is_some_and(|b| dot(b, q) < 0.0) {
                q = q.map(|x| -x);
                for (i, x) in record.into_iter().zip(q) {
                    series[i].values[k] = x;
                }
            }
            before = Some(q);
        }
    }
}

fn dot(a: [f64; 4], b: [f64; 4]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The series of the quaternion whose `w` is a given one.
fn record(series: &[Series], w: usize) -> Option<[usize; 4]> {
    let path = series[w].name.strip_suffix(".w")?;
    let entry = |axis: &str| {
        let is_it = |s: &Series| {
            let own = s.name.strip_prefix(path);
            own.and_then(|rest| rest.strip_prefix('.')) == Some(axis) && s.time == series[w].time
        };
        series.iter().position(is_it)
    };
    Some([entry("x")?, entry("y")?, entry("z")?, w])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::readings;

    /// Rate of the spin, rad/s.
    const SPIN: f64 = 5.0;

    /// Symptom: single readings of a spinning body were turned by a whole sample and more, once per
    /// turn.
    ///
    /// Cause: a reading between `q` and a `-q` after it was interpolated entry by entry.
    #[test]
    fn an_orientation_between_two_samples_of_opposite_sign_lies_between_them() {
        // About z at 100 Hz, with `w` positive.
        let time: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        let column = |name: &str, of: fn(f64) -> f64| Series {
            name: format!("/imu.orientation.{name}"),
            stream: "/imu".into(),
            time: time.clone(),
            values: time
                .iter()
                .map(|t| (0.5 * SPIN * t).cos().signum() * of(0.5 * SPIN * t))
                .collect(),
        };
        let none = |_: f64| 0.0;
        let mut series = [
            column("x", none),
            column("y", none),
            column("z", f64::sin),
            column("w", f64::cos),
        ];
        align_signs(&mut series);
        let rows: Vec<f64> = (1..280).map(|k| f64::from(k) / 73.0).collect();
        let [z, w] = [2, 3].map(|i| readings(&series[i], &rows));
        for ((t, z), w) in rows.iter().zip(z).zip(w) {
            // The sign of a quaternion is free, and so is half a turn of half its angle.
            let off = (z.atan2(w) - 0.5 * SPIN * t).sin().abs();
            assert!(off < 1e-3, "at {t} s: {off} rad");
        }
    }
}
