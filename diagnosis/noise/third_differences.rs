//! Deviation and correlation of noise from third differences over one, two and four rows, which vanish for parabolas.

use super::{NORMAL, Noise, median};

/// Squared deviation of the third differences of white noise of deviation 1: 1 + 9 + 9 + 1.
const WHITE: f64 = 20.0;
/// Growth of squared third differences from one row to two up to which noise is white. Over a thousand rows it scatters by
/// a tenth about 1.
const GROWS: f64 = 1.2;
/// The same from which on what is rough is no noise but the residual itself. Correlated noise grows by at most two, a smooth
/// residual by 64.
const SMOOTH: f64 = 4.0;
/// Largest correlation from row to row that is called noise: slower changes are the model's.
const SLOWEST: f64 = 0.97;
/// Third differences that a correlation is told from, at least.
const FEWEST: usize = 200;
/// Rows that a third difference spans at most, where readings are missing: over more of them a residual is no parabola.
const SPAN: usize = 12;
/// Rows over which third differences are taken.
pub(super) const STRIDES: [usize; 3] = [1, 2, 4];

/// Magnitudes of the third differences of a series (row, time, value) over some readings, scaled so that those of white noise of
/// deviation 1 have the deviation sqrt(20), whatever the times between.
pub(super) fn third_differences(series: &[(usize, f64, f64)], stride: usize, found: &mut Vec<f64>) {
    for i in 0..series.len().saturating_sub(3 * stride) {
        let four = [0, 1, 2, 3].map(|k| series[i + k * stride]);
        if four[3].0 - four[0].0 > SPAN * stride {
            continue;
        }
        // Weights of the divided difference, which vanishes for parabolas.
        let weight = |k: usize| -> f64 {
            let others = (0..4).filter(|&l| l != k);
            others.map(|l| 1.0 / (four[k].1 - four[l].1)).product()
        };
        let weights = [0, 1, 2, 3].map(weight);
        let norm = weights.iter().map(|w| w * w).sum::<f64>().sqrt();
        let sum: f64 = weights.iter().zip(&four).map(|(w, p)| w * p.2).sum();
        let difference = (WHITE.sqrt() * sum / norm).abs();
        if difference.is_finite() {
            found.push(difference);
        }
    }
}

/// Squared deviation of the third differences of noise of deviation 1 with a correlation between its readings.
fn squared(correlation: f64) -> f64 {
    let r = correlation;
    WHITE + 2.0 * (-15.0 * r + 6.0 * r * r - r * r * r)
}

/// Noise whose third differences over one, two and four rows are these: correlated noise and a smooth rest.
pub(super) fn from_differences(differences: &mut [Vec<f64>; STRIDES.len()]) -> Noise {
    let counts = differences.iter().map(Vec::len).min().unwrap_or(0);
    let [one, two, four] = [0, 1, 2].map(|i| {
        let typical = median(&mut differences[i]).unwrap_or(0.0);
        (NORMAL * typical).powi(2)
    });
    let white = Noise {
        deviation: (one / WHITE).sqrt(),
        correlation: 0.0,
    };
    if counts < FEWEST || one <= 0.0 || two < GROWS * one || two > SMOOTH * one {
        return white;
    }
    // For a correlation, noise and rest follow from the first two; the third says which correlation it is.
    let mut best = (f64::INFINITY, white);
    for k in 1..=100 {
        let r = SLOWEST * f64::from(k) / 100.0;
        let (a, b, c) = (squared(r), squared(r * r), squared(r.powi(4)));
        // one = v a + s, two = v b + 64 s, for third differences of a smooth rest grow by 8.
        let v = (64.0 * one - two) / (64.0 * a - b);
        let s = (one - v * a).max(0.0);
        let miss = ((v * c + 4096.0 * s) / four).ln().abs() + ((v * b + 64.0 * s) / two).ln().abs();
        if v > 0.0 && miss < best.0 {
            best = (
                miss,
                Noise {
                    deviation: v.sqrt(),
                    correlation: r,
                },
            );
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise of deviation 1 with a correlation from row to row, from sums of uniform numbers.
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
        let mut differences: [Vec<f64>; 3] = Default::default();
        for (stride, found) in STRIDES.iter().zip(&mut differences) {
            third_differences(&series, *stride, found);
        }
        from_differences(&mut differences)
    }

    #[test]
    fn filtered_noise_has_its_own_deviation() {
        // With a tenth for the scatter of an estimate whose correlation is estimated beside it, more where it is strong.
        for (correlation, tolerance) in [
            (0.0, 0.05),
            (0.3, 0.1),
            (0.5, 0.1),
            (0.8, 0.15),
            (0.9, 0.25),
        ] {
            let noise = noise_of(coloured(correlation, 20_000).into_iter());
            assert!(
                (noise.deviation - 1.0).abs() < tolerance,
                "{correlation}: {noise:?}"
            );
        }
    }

    #[test]
    fn a_smooth_residual_is_no_noise() {
        // White noise of deviation 1 on a swing a hundred times as large.
        let swing = |k: usize| 100.0 * (0.01 * k as f64).sin();
        let noise = noise_of(
            coloured(0.0, 5000)
                .into_iter()
                .enumerate()
                .map(|(k, x)| x + swing(k)),
        );
        assert!((noise.deviation - 1.0).abs() < 0.08, "{noise:?}");
        assert_eq!(noise.correlation, 0.0);
    }

    #[test]
    fn two_missing_readings_of_three_leave_the_noise_as_it_is() {
        let series: Vec<(usize, f64, f64)> = coloured(0.0, 9000)
            .into_iter()
            .enumerate()
            .filter(|(k, _)| (k * 7919) % 3 == 0 || (k * 104_729) % 11 == 0)
            .map(|(k, x)| (k, 0.01 * k as f64, x))
            .collect();
        let mut found = Vec::new();
        third_differences(&series, 1, &mut found);
        let deviation = NORMAL * median(&mut found).unwrap() / WHITE.sqrt();
        assert!((deviation - 1.0).abs() < 0.06, "{deviation}");
    }
}
