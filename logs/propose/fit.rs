//! Compares two series: a command with the position that follows it, a speed with displacements.

use crate::series::Series;

/// Number of times at which two series are compared.
const SAMPLES: usize = 400;
/// Number of windows over which displacements are compared with speeds.
///
/// A window has some tenths of a second in usual logs.
const WINDOWS: usize = 120;
/// Fewest common samples for a comparison.
const FEWEST: usize = 12;

/// The value of a series at a time, interpolated linearly; `None` outside its time.
#[must_use]
pub fn at(series: &Series, time: f64) -> Option<f64> {
    let after = series.time.partition_point(|t| *t < time);
    let b = series.time.get(after)?;
    if *b == time || after == 0 {
        return (*b == time).then(|| series.values[after]);
    }
    let a = series.time[after - 1];
    let along = (time - a) / (b - a);
    let (x, y) = (series.values[after - 1], series.values[after]);
    Some(x + along * (y - x))
}

/// Evenly spread times within the common time of two series.
fn shared(a: &Series, b: &Series, count: usize) -> Vec<f64> {
    let ends = |s: &Series| Some((*s.time.first()?, *s.time.last()?));
    let (Some((a0, a1)), Some((b0, b1))) = (ends(a), ends(b)) else {
        return Vec::new();
    };
    let (first, last) = (a0.max(b0), a1.min(b1));
    if last <= first {
        return Vec::new();
    }
    let step = (last - first) / (count - 1) as f64;
    (0..count).map(|k| first + k as f64 * step).collect()
}

/// Correlation of two series over their common time, -1 to 1; 0 where one of them is constant.
#[must_use]
pub fn correlation(a: &Series, b: &Series) -> f64 {
    let pairs = shared(a, b, SAMPLES);
    let pairs: Vec<(f64, f64)> = pairs
        .iter()
        .filter_map(|t| Some((at(a, *t)?, at(b, *t)?)))
        .collect();
    of_pairs(&pairs)
}

fn of_pairs(pairs: &[(f64, f64)]) -> f64 {
    if pairs.len() < FEWEST {
        return 0.0;
    }
    let n = pairs.len() as f64;
    let mean = |f: fn(&(f64, f64)) -> f64| pairs.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (a, b) in pairs {
        xx += (a - x) * (a - x);
        yy += (b - y) * (b - y);
        xy += (a - x) * (b - y);
    }
    if xx > 0.0 && yy > 0.0 {
        xy / (xx * yy).sqrt()
    } else {
        0.0
    }
}

/// Factor from a speed to the rate of a position, and the correlation of displacements, -1 to 1.
///
/// It compares the displacements of the position in short windows with the integral of the speed,
/// which noise hardly affects.
#[must_use]
pub fn speed_factor(speed: &Series, position: &Series) -> Option<(f64, f64)> {
    let ends = shared(speed, position, WINDOWS + 1);
    let displacements: Vec<(f64, f64)> = ends
        .windows(2)
        .filter_map(|w| {
            let displacement = at(position, w[1])? - at(position, w[0])?;
            Some((integral(speed, w[0], w[1])?, displacement))
        })
        .collect();
    let sure = of_pairs(&displacements);
    let (xx, xy) = displacements
        .iter()
        .fold((0.0, 0.0), |(xx, xy), (a, b)| (xx + a * a, xy + a * b));
    (xx > 0.0 && displacements.len() >= FEWEST).then(|| (xy / xx, sure))
}

/// Integral of a series between two times, by the trapezoidal rule at its own samples.
fn integral(series: &Series, from: f64, to: f64) -> Option<f64> {
    let (mut t, mut x, mut sum) = (from, at(series, from)?, 0.0);
    let inside =
        series.time.partition_point(|s| *s <= from)..series.time.partition_point(|s| *s < to);
    let ends = inside.map(|k| (series.time[k], series.values[k]));
    for (next, y) in ends.chain(std::iter::once((to, at(series, to)?))) {
        sum += 0.5 * (x + y) * (next - t);
        (t, x) = (next, y);
    }
    Some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(rate: f64, phase: f64, f: impl Fn(f64) -> f64) -> Series {
        let time: Vec<f64> = (0..(4.0 * rate) as usize)
            .map(|k| phase + k as f64 / rate)
            .collect();
        Series {
            values: time.iter().map(|t| f(*t)).collect(),
            time,
            ..Series::default()
        }
    }

    #[test]
    fn a_speed_in_degrees_and_the_other_way_is_seen_by_the_displacement_that_it_makes() {
        let position = sampled(100.0, 0.0, |t| (3.0 * t).sin());
        let speed = sampled(73.0, 0.002, |t| -(3.0 * (3.0 * t).cos()).to_degrees());
        let (factor, sure) = speed_factor(&speed, &position).unwrap();
        assert!(
            (factor / -(1.0_f64.to_radians()) - 1.0).abs() < 0.01,
            "{factor}"
        );
        assert!(sure < -0.99);
    }

    #[test]
    fn a_command_is_like_what_follows_it() {
        let command = sampled(50.0, 0.0, |t| (2.0 * t).sin());
        let follows = sampled(200.0, 0.001, |t| 0.9 * (2.0 * t - 0.1).sin());
        let other = sampled(200.0, 0.001, |t| (5.0 * t).cos());
        assert!(correlation(&command, &follows) > 0.95);
        assert!(correlation(&command, &other).abs() < 0.5);
        assert_eq!(correlation(&command, &sampled(10.0, 0.0, |_| 1.0)), 0.0);
    }
}
