//! Estimates the standard deviation and correlation of a sensor's noise from third differences,
//! which vanish for parabolas.
//!
//! The differences are taken over 1 to 64 readings. When this number doubles, the squared
//! differences of correlated noise grow by a factor of at most two, until readings so far apart are
//! independent. Those of a model error grow faster: by 64 if it is smooth, and by 8 if a rough
//! force causes it, which a machine integrates twice. This growth separates noise and model error.
//! Where the model error outgrows the noise, differences contain no information about the noise.
//! Nor do differences across an impact, where readings are no parabola.

/// Ratio of a normal variable's standard deviation to the median of its magnitude.
pub const NORMAL: f64 = 1.482_602_218_505_602;

/// Noise of one sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Standard deviation, in the sensor's unit.
    pub deviation: f64,
    /// Correlation from one reading to the next; 0 for white noise.
    pub correlation: f64,
    /// Largest standard deviation that is nearly as likely.
    ///
    /// Noise that is slow compared with the readings may be much larger than its differences over
    /// few rows show.
    pub most: f64,
}

impl Noise {
    /// White noise.
    #[must_use]
    pub fn white(deviation: f64) -> Self {
        Self {
            deviation,
            correlation: 0.0,
            most: deviation,
        }
    }

    /// Number of successive readings that count as one for anything that hardly changes over them.
    ///
    /// It is the ratio of the noise's spectral density at frequency zero to that of white noise of
    /// the same standard deviation: `(1 + r) / (1 - r)` for first-order noise.
    #[must_use]
    pub fn alike(self) -> f64 {
        (1.0 + self.correlation) / (1.0 - self.correlation)
    }
}

/// Returns the median; `None` if there are no values.
#[must_use]
pub fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Variance of the third differences of white noise of standard deviation 1: 1 + 9 + 9 + 1.
const WHITE: f64 = 20.0;
/// Least growth, over a doubling of the rows, at which differences show the model error: twice the
/// largest growth of noise.
const SMOOTH: f64 = 4.0;
/// Growth of a model error over a doubling of the rows: from a rough force, and from a smooth one.
const RESTS: [f64; 2] = [8.0, 64.0];
/// Misfit above the best one up to which a smaller correlation is preferred.
///
/// A misfit is a sum of squared logarithms, each times its number of differences. Let `f` be the
/// density of a normal magnitude, and `m` its median. The logarithm of a squared median of `n`
/// magnitudes has the variance `4 / (4 n f(m)^2 m^2) = 5.4 / n`. The limit is half of that, times
/// `n`.
const TIE: f64 = 2.7;
/// Misfit above the best one up to which a correlation is nearly as likely: the square of two
/// standard deviations of that logarithm.
const NEARLY: f64 = 4.0 * 5.4;
/// Largest correlation from row to row that counts as noise: slower changes belong to the model.
const SLOWEST: f64 = 0.97;
/// Third difference over neighbouring rows, in standard deviations, that shows an impact: for
/// normal noise one in two million.
const IMPACT: f64 = 5.0;
/// Fewest third differences from which a correlation is estimated.
const FEWEST: usize = 200;
/// Largest number of rows that a third difference spans if readings are missing: over more a
/// residual is no parabola.
const SPAN: usize = 12;
/// The same for a sensor that reads once in several rows, in its own usual distance between
/// readings. A third difference spans three of these, so that one more may be missing.
const SPAN_OF_SLOW: usize = 4;
/// Readings over which third differences are taken: as many rows for a sensor that reads in each.
///
/// Over the last of them even noise of the largest correlation is independent, to 0.97^64 = 0.14.
/// Over fewer readings its differences only double from stride to stride, whatever its standard
/// deviation.
const STRIDES: [usize; 7] = [1, 2, 4, 8, 16, 32, 64];
/// Fewest strides from which a correlation is estimated: noise, its correlation and a model error
/// are three unknowns.
const FEWEST_STRIDES: usize = 3;

/// Largest number of rows that a third difference over neighbouring readings of a series spans.
fn span(series: &[(usize, f64, f64)]) -> usize {
    let mut rows: Vec<usize> = series.windows(2).map(|w| w[1].0 - w[0].0).collect();
    if rows.is_empty() {
        return SPAN;
    }
    let middle = rows.len() / 2;
    let usual = *rows.select_nth_unstable(middle).1;
    SPAN.max(SPAN_OF_SLOW * usual)
}

/// Magnitude of the third difference of a series (row, time, value) from some reading on.
///
/// It is scaled so that white noise of standard deviation 1 gives sqrt(20), whatever the times
/// between readings. `None` if it spans more than `span` rows for each reading of the stride.
fn third_difference(
    series: &[(usize, f64, f64)],
    from: usize,
    stride: usize,
    span: usize,
) -> Option<f64> {
    let four = [0, 1, 2, 3].map(|k| series[from + k * stride]);
    if four[3].0 - four[0].0 > span * stride {
        return None;
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
    difference.is_finite().then_some(difference)
}

/// Number of impacts before each reading of a series; across an impact, neighbouring readings are
/// no parabola.
fn impacts_before(series: &[(usize, f64, f64)], span: usize) -> Vec<usize> {
    let starts = 0..series.len().saturating_sub(3);
    let each: Vec<f64> = starts
        .map(|i| third_difference(series, i, 1, span).unwrap_or(0.0))
        .collect();
    let typical = NORMAL * median(&mut each.clone()).unwrap_or(0.0);
    let mut count = 0;
    let mut before = vec![0];
    for d in each {
        count += usize::from(d > IMPACT * typical);
        before.push(count);
    }
    before.resize(series.len() + 1, count);
    before
}

/// Variance of the third differences of noise of standard deviation 1 with a correlation, relative
/// to white noise.
fn squared(correlation: f64) -> f64 {
    let r = correlation;
    1.0 + 2.0 * (-15.0 * r + 6.0 * r * r - r * r * r) / WHITE
}

/// Third differences of some series of readings of one sensor, for each stride.
#[derive(Debug, Default)]
pub struct ThirdDifferences([Vec<f64>; STRIDES.len()]);

impl ThirdDifferences {
    /// Adds the differences of a series: row, time (s) and value of each reading that is present.
    pub fn add(&mut self, series: &[(usize, f64, f64)]) {
        let span = span(series);
        let impacts = impacts_before(series, span);
        for (&stride, found) in STRIDES.iter().zip(&mut self.0) {
            let starts = 0..series.len().saturating_sub(3 * stride);
            // Over a few rows the median is robust against impacts; over many, most differences
            // would span one.
            let is_smooth = |i: &usize| stride == 1 || impacts[*i] == impacts[i + 3 * stride];
            let smooth = starts.filter(is_smooth);
            found.extend(smooth.filter_map(|i| third_difference(series, i, stride, span)));
        }
    }

    /// Returns the noise that explains these differences, together with a model error.
    #[must_use]
    pub fn noise(mut self) -> Noise {
        let typical = |d: &mut Vec<f64>| (NORMAL * median(d).unwrap_or(0.0)).powi(2) / WHITE;
        let white = Noise::white(typical(&mut self.0[0]).sqrt());
        let found: Vec<Found> = (self.0.iter_mut().zip(STRIDES))
            .take_while(|(d, _)| d.len() >= FEWEST)
            .map(|(d, stride)| Found {
                // Overlapping differences carry information about slow noise only once.
                independent: d.len() as f64 / stride as f64,
                squared: typical(d),
            })
            .collect();
        // Only up to where the model error outgrows the noise.
        let grows = |w: &[Found]| w[1].squared > SMOOTH * w[0].squared;
        let outgrown = found.windows(2).position(grows);
        let told = outgrown.map_or(found.len(), |k| k + 2);
        let found = &found[..told];
        if told < FEWEST_STRIDES || found[0].squared <= 0.0 {
            return white;
        }
        let fits: Vec<(f64, Noise)> = (0..=100)
            .map(|k| SLOWEST * f64::from(k) / 100.0)
            .flat_map(|r| RESTS.map(|growth| fit(found, r, growth)))
            .flatten()
            .collect();
        let least = fits.iter().map(|f| f.0).fold(f64::INFINITY, f64::min);
        let within = |miss: f64| {
            fits.iter()
                .filter(move |f| f.0 <= least + miss)
                .map(|f| f.1)
        };
        let most = within(NEARLY).fold(0.0, |most, n| f64::max(most, n.deviation));
        // A model error that outgrows the noise looks like slow noise over the last rows, so the
        // smallest correlation is taken.
        let is_least = outgrown.is_some() || within(TIE).any(|n| n.correlation == 0.0);
        let taken = if is_least {
            within(TIE).next()
        } else {
            within(0.0).next()
        };
        taken.map_or(white, |noise| Noise { most, ..noise })
    }
}

/// Summary of the third differences over a number of rows.
struct Found {
    /// Their variance, relative to that of white noise of standard deviation 1.
    squared: f64,
    /// Lower bound of the number of independent ones.
    independent: f64,
}

/// Fits noise of a correlation, together with a model error of some growth, by relative least
/// squares.
///
/// Returns it with its misfit: the sum of squared logarithms, each times the number of independent
/// differences. `None` if no such noise fits.
fn fit(found: &[Found], correlation: f64, growth: f64) -> Option<(f64, Noise)> {
    let noise = |k: usize| squared(correlation.powi(STRIDES[k] as i32));
    let rest = |k: usize| growth.powi(k as i32);
    let [mut nn, mut nr, mut rr, mut n1, mut r1] = [0.0; 5];
    for (k, d) in found.iter().enumerate() {
        let (n, r) = (noise(k) / d.squared, rest(k) / d.squared);
        let w = d.independent;
        (nn, nr, rr) = (nn + w * n * n, nr + w * n * r, rr + w * r * r);
        (n1, r1) = (n1 + w * n, r1 + w * r);
    }
    let determinant = nn * rr - nr * nr;
    let both = [n1 * rr - r1 * nr, r1 * nn - n1 * nr].map(|x| x / determinant);
    let [v, s] = if both[1] >= 0.0 && determinant > 0.0 {
        both
    } else {
        [n1 / nn, 0.0]
    };
    let miss = |(k, d): (usize, &Found)| {
        let ratio = (v * noise(k) + s * rest(k)) / d.squared;
        d.independent * ratio.ln().powi(2)
    };
    let noise = Noise {
        deviation: v.max(0.0).sqrt(),
        correlation,
        most: v.max(0.0).sqrt(),
    };
    let missed: f64 = found.iter().enumerate().map(miss).sum();
    (v > 0.0 && missed.is_finite()).then_some((missed, noise))
}

#[cfg(test)]
mod tests;
