//! Prepares recorded series for drawing: gaps where readings are missing, few enough points, and an
//! axis that a diverging simulation does not distort.

/// Largest number of readings that are all drawn as dots.
pub(super) const MOST_DOTS: usize = 120;

/// Largest number of dots drawn of a series.
const DOTS: usize = 300;

/// Approximate number of points of a line.
const POINTS: usize = 440;

/// A gap is longer than the usual time between readings by this factor.
const GAP: f64 = 2.6;

/// Points `[t, value]` of the existing readings, separated by a NaN where readings are missing for
/// longer than usual.
///
/// A sensor that is slower than the log has empty rows between any two readings; these are no gaps.
pub(super) fn stretches(time: &[f64], values: &[f64]) -> Vec<[f64; 2]> {
    let there: Vec<[f64; 2]> = (time.iter().zip(values))
        .map(|(&t, &v)| [t, v])
        .filter(|p| p.iter().all(|x| x.is_finite()))
        .collect();
    let mut steps: Vec<f64> = there.windows(2).map(|w| w[1][0] - w[0][0]).collect();
    steps.sort_by(f64::total_cmp);
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(f64::INFINITY);
    let mut points: Vec<[f64; 2]> = Vec::with_capacity(there.len() + 8);
    for stretch in there.chunk_by(|a, b| b[0] - a[0] <= GAP * usual) {
        if let Some([last, _]) = points.last() {
            points.push([*last, f64::NAN]);
        }
        points.extend(thin(stretch, (POINTS * stretch.len()) / there.len()));
    }
    points
}

/// The lowest and the highest point of each part of a stretch, about `most` points in total.
fn thin(stretch: &[[f64; 2]], most: usize) -> Vec<[f64; 2]> {
    if stretch.len() <= most.max(4) {
        return stretch.to_vec();
    }
    let part = stretch.len().div_ceil((most / 2).max(2));
    let ends = |part: &[[f64; 2]]| -> Vec<[f64; 2]> {
        let by = |i: &usize, j: &usize| part[*i][1].total_cmp(&part[*j][1]);
        let low = (0..part.len()).min_by(by).unwrap_or(0);
        let high = (0..part.len()).max_by(by).unwrap_or(0);
        let mut kept = vec![part[low.min(high)]];
        if low != high {
            kept.push(part[low.max(high)]);
        }
        kept
    };
    stretch.chunks(part).flat_map(ends).collect()
}

/// Number of finite points.
pub(super) fn finite(points: &[[f64; 2]]) -> usize {
    points.iter().filter(|p| p[1].is_finite()).count()
}

/// Number of points with a gap on both sides, which a line does not show.
pub(super) fn lone(points: &[[f64; 2]]) -> usize {
    points
        .split(|p| !p[1].is_finite())
        .filter(|stretch| stretch.len() == 1)
        .count()
}

/// Evenly chosen points, few enough to draw as dots.
pub(super) fn dots(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let there = points.iter().filter(|p| p[1].is_finite());
    there
        .step_by(finite(points).div_ceil(DOTS).max(1))
        .copied()
        .collect()
}

/// Domain of an axis that contains all real readings, and simulated values within one spread of the
/// readings beyond them; `None` where there is nothing.
pub(super) fn reach<'a>(
    real: &[f64],
    simulated: impl Iterator<Item = &'a [f64]>,
    noise: f64,
) -> Option<[f64; 2]> {
    let extent = |values: &mut dyn Iterator<Item = f64>| {
        values
            .filter(|v| v.is_finite())
            .fold(None, |extent: Option<[f64; 2]>, v| {
                let [low, high] = extent.unwrap_or([v, v]);
                Some([low.min(v), high.max(v)])
            })
    };
    let all = extent(&mut simulated.flat_map(|s| s.iter().copied()));
    let [low, high] = match (extent(&mut real.iter().copied()), all) {
        (None, all) => all?,
        (Some(real), None) => real,
        (Some([low, high]), Some(all)) => {
            let far = (high - low).max(12.0 * noise);
            [
                all[0].max(low - far).min(low),
                all[1].min(high + far).max(high),
            ]
        }
    };
    let room = (0.06 * (high - low)).max(3.0 * noise);
    let room = if room > 0.0 {
        room
    } else {
        0.1 * low.abs().max(1e-3)
    };
    Some([low - room, high + room])
}

/// A domain that reaches at least `least` to both sides of zero, and that a few outliers do not
/// stretch.
pub(super) fn around_zero(values: impl Iterator<Item = f64>, least: f64) -> [f64; 2] {
    let mut sorted: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let last = sorted.len().saturating_sub(1) as f64;
        sorted.get((share * last).round() as usize).copied()
    };
    let usual = at(0.05)
        .unwrap_or(0.0)
        .abs()
        .max(at(0.95).unwrap_or(0.0).abs());
    let end = |extreme: f64| (1.08 * extreme).min(2.5 * usual).max(least);
    let ends = [-end(-at(0.0).unwrap_or(0.0)), end(at(1.0).unwrap_or(0.0))];
    if ends[0] < ends[1] { ends } else { [-1.0, 1.0] }
}

/// First and last of the times; `None` if there are none.
pub(super) fn span(time: &[f64]) -> Option<[f64; 2]> {
    let finite = || time.iter().copied().filter(|t| t.is_finite());
    Some([finite().reduce(f64::min)?, finite().reduce(f64::max)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAN: f64 = f64::NAN;

    #[test]
    fn a_slow_sensor_has_no_gaps_and_a_missing_stretch_is_one() {
        let time: Vec<f64> = (0..40).map(f64::from).collect();
        let slow: Vec<f64> = (0..40)
            .map(|i| {
                if i % 4 == 0 && !(16..30).contains(&i) {
                    1.0
                } else {
                    NAN
                }
            })
            .collect();
        let points = stretches(&time, &slow);
        assert_eq!(finite(&points), 6);
        assert_eq!(points.len(), 7, "{points:?}");
        assert_eq!(lone(&points), 0);
    }

    #[test]
    fn a_long_line_keeps_its_extremes() {
        let time: Vec<f64> = (0..20_000).map(f64::from).collect();
        let mut values = vec![0.0; 20_000];
        (values[7_003], values[15_001]) = (5.0, -3.0);
        let points = stretches(&time, &values);
        assert!(points.len() <= POINTS + 4, "{}", points.len());
        assert!(points.contains(&[7_003.0, 5.0]) && points.contains(&[15_001.0, -3.0]));
    }

    #[test]
    fn a_diverging_simulation_does_not_squash_the_readings() {
        let simulated = [0.5, 1e9, NAN];
        let [low, high] = reach(&[0.0, 1.0], [&simulated[..]].into_iter(), 0.01).unwrap();
        assert!(low < 0.0 && high > 1.0 && high < 2.5);
        assert_eq!(reach(&[NAN], std::iter::empty(), 0.0), None);
        let domain = around_zero([0.5, NAN, -0.5].into_iter(), 3.0);
        assert_eq!(domain, [-3.0, 3.0]);
    }
}
