//! The noise of series with known noise, and with a known model error.

use super::*;

/// Noise of standard deviation 1 with a correlation from row to row, from sums of uniform
/// numbers.
fn coloured(correlation: f64, rows: usize) -> Vec<f64> {
    let mut state = 12345_u64;
    let mut uniform = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut last = 0.0;
    (0..rows)
        .map(|_| {
            let fresh: f64 = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
            last = correlation * last + (1.0 - correlation * correlation).sqrt() * fresh;
            last
        })
        .collect()
}

fn noise_of(values: impl Iterator<Item = f64>) -> Noise {
    let series: Vec<(usize, f64, f64)> = values
        .enumerate()
        .map(|(k, x)| (k, 0.01 * k as f64, x))
        .collect();
    let mut differences = ThirdDifferences::default();
    differences.add(&series);
    differences.noise()
}

#[test]
fn filtered_noise_has_its_own_deviation() {
    // The tolerance allows for the scatter of the estimate, whose correlation is estimated too;
    // it is larger for strong ones.
    for (correlation, tolerance) in [
        (0.0, 0.05),
        (0.3, 0.05),
        (0.5, 0.05),
        (0.8, 0.1),
        (0.9, 0.15),
        (0.95, 0.2),
    ] {
        let noise = noise_of(coloured(correlation, 20_000).into_iter());
        assert!(
            (noise.deviation - 1.0).abs() < tolerance,
            "{correlation}: {noise:?}"
        );
    }
}

#[test]
fn a_mean_of_correlated_noise_is_as_uncertain_as_one_of_fewer_white_readings() {
    let noise = Noise {
        correlation: 0.8,
        ..Noise::white(1.0)
    };
    let rows = 500;
    let readings = coloured(noise.correlation, 200 * rows);
    let means = readings
        .chunks_exact(rows)
        .map(|c| c.iter().sum::<f64>() / rows as f64);
    let variance = means.map(|m| m * m).sum::<f64>() / 200.0;
    // From 200 means a variance is known to a tenth.
    assert!(
        (variance * rows as f64 / noise.alike()).ln().abs() < 0.3,
        "{variance}"
    );
}

#[test]
fn slow_noise_beside_a_swing_may_be_larger_than_its_fast_part_tells() {
    // Third differences over few rows double with the rows, whatever the standard deviation;
    // over more the swing outgrows them.
    let swing = |k: usize| 300.0 * (0.02 * k as f64).sin();
    let noise = coloured(0.95, 4000).into_iter().enumerate();
    let found = noise_of(noise.map(|(k, x)| x + swing(k)));
    assert!(found.deviation < 0.9 && found.most > 1.0, "{found:?}");
}

#[test]
fn a_smooth_residual_is_no_noise() {
    // White noise of standard deviation 1 on a swing a hundred times as large.
    let swing = |k: usize| 100.0 * (0.01 * k as f64).sin();
    let noise = noise_of(
        coloured(0.0, 5000)
            .into_iter()
            .enumerate()
            .map(|(k, x)| x + swing(k)),
    );
    assert!((noise.deviation - 1.0).abs() < 0.08, "{noise:?}");
    assert!(noise.correlation < 0.1, "{noise:?}");
}

#[test]
fn what_a_missing_force_makes_is_no_slow_noise() {
    // A mass pushed by a white force against a spring and a damper, plus correlated noise of
    // standard deviation 1.
    let pushed = |rows: usize, size: f64| {
        let force = coloured(0.0, rows + 1);
        let (mut x, mut v) = (0.0, 0.0);
        let path: Vec<f64> = force[1..]
            .iter()
            .map(|f| {
                v += 0.01 * (f - 40.0 * x - 2.0 * v);
                x += 0.01 * v;
                x
            })
            .collect();
        let spread = path.iter().map(|x| x * x).sum::<f64>() / rows as f64;
        path.into_iter().map(move |x| size * x / spread.sqrt())
    };
    for (correlation, size) in [(0.0, 3.0), (0.4, 3.0), (0.4, 10.0), (0.7, 5.0)] {
        let noise = coloured(correlation, 4000).into_iter();
        let found = noise_of(noise.zip(pushed(4000, size)).map(|(a, b)| a + b));
        assert!(
            (found.deviation - 1.0).abs() < 0.2,
            "{correlation}, {size}: {found:?}"
        );
    }
}

#[test]
fn impacts_make_no_noise() {
    // A ball that bounces every 0.7 s, together with two coordinates without impacts.
    let bounces = |k: usize| {
        let t = (0.01 * k as f64) % 0.7;
        1000.0 * (3.4 * t - 4.9 * t * t)
    };
    let mut differences = ThirdDifferences::default();
    for axis in 0..3 {
        let noise = coloured(0.0, 300 + axis).into_iter().enumerate();
        let path = |k: usize| if axis == 0 { bounces(k) } else { 0.0 };
        let read: Vec<_> = noise
            .map(|(k, x)| (k, 0.01 * k as f64, x + path(k)))
            .collect();
        differences.add(&read);
    }
    let found = differences.noise();
    assert!((found.deviation - 1.0).abs() < 0.1, "{found:?}");
}

#[test]
fn a_fast_shaking_is_no_slow_noise() {
    for correlation in [0.0, 0.4] {
        let shaken = |k: usize| 5.0 * (0.26 * k as f64).sin();
        let noise = coloured(correlation, 2000).into_iter().enumerate();
        let found = noise_of(noise.map(|(k, x)| x + shaken(k)));
        assert!(
            (found.deviation - 1.0).abs() < 0.2,
            "{correlation}: {found:?}"
        );
    }
}

/// Symptom: a tracker at 30 Hz in a log at 200 Hz had a noise of a millionth of its range, and a
/// right model a gap of a thousand.
///
/// Cause: four of its readings span 20 rows. A third difference spanned 12 at most, so there was
/// none.
#[test]
fn a_sensor_slower_than_the_rows_has_its_own_noise() {
    let slow = |(k, x): (usize, f64)| (7 * k, 0.035 * k as f64, x);
    let readings = coloured(0.0, 4000).into_iter().enumerate();
    let series: Vec<(usize, f64, f64)> = readings.map(slow).collect();
    let mut differences = ThirdDifferences::default();
    differences.add(&series);
    let found = differences.noise();
    assert!((found.deviation - 1.0).abs() < 0.05, "{found:?}");
}

#[test]
fn two_missing_readings_of_three_leave_the_noise_as_it_is() {
    let series: Vec<(usize, f64, f64)> = coloured(0.0, 9000)
        .into_iter()
        .enumerate()
        .filter(|(k, _)| (k * 7919) % 3 == 0 || (k * 104_729) % 11 == 0)
        .map(|(k, x)| (k, 0.01 * k as f64, x))
        .collect();
    let starts = 0..series.len() - 3;
    let mut found: Vec<f64> = starts
        .filter_map(|i| third_difference(&series, i, 1, SPAN))
        .collect();
    let deviation = NORMAL * median(&mut found).unwrap() / WHITE.sqrt();
    assert!((deviation - 1.0).abs() < 0.06, "{deviation}");
}
