//! Scales from data to drawing, and round numbers for ticks.

use crate::number;

/// Spacing of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spacing {
    /// Equal steps.
    #[default]
    Linear,
    /// Equal ratios; needs a positive domain, without which it falls back to linear.
    Log,
}

/// A monotone map from a domain (data) to a range (SVG units).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    domain: [f64; 2],
    range: [f64; 2],
    spacing: Spacing,
}

/// Ticks of an axis: positions, labels, and a common power of ten.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ticks {
    /// Positions in data units, increasing.
    pub values: Vec<f64>,
    /// Label of each, after division by `10^exponent`.
    pub labels: Vec<String>,
    /// The common power of ten, a multiple of three; 0 if none is needed.
    pub exponent: i32,
}

impl Scale {
    /// A scale over `domain`, which is corrected if it is empty, reversed or not finite.
    #[must_use]
    pub fn new(domain: [f64; 2], range: [f64; 2], spacing: Spacing) -> Self {
        let [mut low, mut high] = domain;
        if !low.is_finite() || !high.is_finite() {
            [low, high] = [0.0, 1.0];
        }
        if low > high {
            [low, high] = [high, low];
        }
        let spacing = if low > 0.0 { spacing } else { Spacing::Linear };
        // A domain narrower than the resolution of doubles has no ticks.
        if high - low <= 1e-12 * low.abs().max(high.abs()) || high == low {
            let pad = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
            [low, high] = [low - pad, high + pad];
        }
        Self {
            domain: [low, high],
            range,
            spacing,
        }
    }

    /// The domain in data units, increasing.
    #[must_use]
    pub fn domain(&self) -> [f64; 2] {
        self.domain
    }

    /// Position of `value` in the drawing; not finite if `value` cannot be represented.
    #[must_use]
    pub fn map(&self, value: f64) -> f64 {
        let [low, high] = self.domain;
        let share = match self.spacing {
            Spacing::Linear => (value - low) / (high - low),
            Spacing::Log if value <= 0.0 => f64::NAN,
            Spacing::Log => (value / low).ln() / (high / low).ln(),
        };
        self.range[0] + share * (self.range[1] - self.range[0])
    }

    /// Position of `value`, moved to the nearer end if it lies outside the domain.
    #[must_use]
    pub fn map_clamped(&self, value: f64) -> f64 {
        self.map(value.clamp(self.domain[0], self.domain[1]))
    }

    /// At most `most` ticks on round numbers inside the domain; it aims for at least two.
    #[must_use]
    pub fn ticks(&self, most: usize) -> Ticks {
        if self.spacing == Spacing::Log {
            let values = log_ticks(self.domain, most.max(2));
            if values.len() >= 2 {
                // Use one style for all: plain numbers if all are short.
                let plain = values.iter().all(|v| (0.999e-3..1.001e4).contains(v));
                let labels = values
                    .iter()
                    .map(|&v| {
                        if plain {
                            number::round(v, 1)
                        } else {
                            log_label(v)
                        }
                    })
                    .collect();
                return Ticks {
                    values,
                    labels,
                    exponent: 0,
                };
            }
        }
        linear_ticks(self.domain, most.max(2))
    }
}

/// Ticks at 1, 2 or 5 times a power of ten.
fn linear_ticks([low, high]: [f64; 2], most: usize) -> Ticks {
    let mut magnitude = ((high - low) / most as f64).log10().floor() as i32;
    // Find the finest step of the 1-2-5 series that gives at most `most` ticks.
    let (step, first, last) = 'found: loop {
        for factor in [1.0, 2.0, 5.0] {
            let step = factor * 10f64.powi(magnitude);
            let (first, last) = ((low / step - 1e-9).ceil(), (high / step + 1e-9).floor());
            if last - first + 1.0 <= most as f64 {
                break 'found (step, first, last);
            }
        }
        magnitude += 1;
    };
    let count = (last - first + 1.0).max(0.0) as usize;
    let values: Vec<f64> = (0..count).map(|i| (first + i as f64) * step).collect();

    // Long labels share a power of ten, in steps of a thousand like units.
    let largest = low.abs().max(high.abs());
    let digits_of_largest = largest.log10().floor() as i32;
    let exponent = if !(-3..5).contains(&digits_of_largest) || magnitude < -4 {
        digits_of_largest.div_euclid(3) * 3
    } else {
        0
    };
    let places = usize::try_from(exponent - magnitude).unwrap_or(0).min(12);
    let labels = values
        .iter()
        .map(|v| number::decimals(v / 10f64.powi(exponent), places))
        .collect();
    Ticks {
        values,
        labels,
        exponent,
    }
}

/// Ticks on decades, with 2 and 5 times these if there are few decades.
fn log_ticks([low, high]: [f64; 2], most: usize) -> Vec<f64> {
    let inside = |v: &f64| *v >= low * (1.0 - 1e-9) && *v <= high * (1.0 + 1e-9);
    let decades = (low.log10().floor() as i32)..=(high.log10().ceil() as i32);
    for factors in [&[1.0, 2.0, 5.0][..], &[1.0, 3.0], &[1.0]] {
        let values: Vec<f64> = decades
            .clone()
            .flat_map(|d| factors.iter().map(move |f| f * 10f64.powi(d)))
            .filter(inside)
            .collect();
        if values.len() <= most {
            return values;
        }
    }
    let all: Vec<f64> = decades.map(|d| 10f64.powi(d)).filter(inside).collect();
    let stride = all.len().div_ceil(most).max(1);
    all.into_iter().step_by(stride).collect()
}

fn log_label(value: f64) -> String {
    let exponent = (value.log10() + 1e-9).floor() as i32;
    let mantissa = (value / 10f64.powi(exponent)).round();
    let power = format!("10{}", number::superscript(exponent));
    if mantissa == 1.0 {
        power
    } else {
        format!("{mantissa:.0}×{power}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_inside_evenly_spaced_and_few() {
        for domain in [
            [0.0, 1.0],
            [-0.1, 0.1],
            [3.2e-9, 7.7e-9],
            [-1e7, 2.5e8],
            [99.9, 100.3],
            [0.0, 20.0],
        ] {
            for most in 2..9 {
                let ticks = Scale::new(domain, [0.0, 1.0], Spacing::Linear).ticks(most);
                assert!(ticks.values.len() <= most, "{domain:?} {most}: {ticks:?}");
                assert_eq!(ticks.values.len(), ticks.labels.len());
                let slack = 1e-9 * (domain[1] - domain[0]);
                assert!(
                    ticks
                        .values
                        .iter()
                        .all(|&v| v >= domain[0] - slack && v <= domain[1] + slack)
                );
                for pair in ticks.values.windows(3) {
                    assert!(((pair[2] - pair[1]) - (pair[1] - pair[0])).abs() < slack);
                }
                // Neighbouring labels show different numbers.
                assert!(
                    ticks.labels.windows(2).all(|pair| pair[0] != pair[1]),
                    "{ticks:?}"
                );
                // From three on, the 1-2-5 series always finds at least two.
                assert!(
                    most < 4 || ticks.values.len() >= 2,
                    "{domain:?} {most}: {ticks:?}"
                );
            }
        }
    }

    #[test]
    fn labels_read_as_their_values() {
        let ticks = Scale::new([-0.1, 0.1], [0.0, 1.0], Spacing::Linear).ticks(5);
        assert_eq!(ticks.labels, ["−0.10", "−0.05", "0.00", "0.05", "0.10"]);
        let small = Scale::new([0.0, 4e-6], [0.0, 1.0], Spacing::Linear).ticks(5);
        assert_eq!(
            (small.exponent, small.labels.last().unwrap().as_str()),
            (-6, "4")
        );
    }

    #[test]
    fn a_log_scale_spaces_ratios_equally() {
        let scale = Scale::new([1e-4, 1e-2], [0.0, 100.0], Spacing::Log);
        assert!((scale.map(1e-3) - 50.0).abs() < 1e-9);
        assert!(scale.map(0.0).is_nan());
        let ticks = scale.ticks(4);
        assert_eq!(ticks.values.len(), 3);
        assert_eq!(ticks.labels[0], "10⁻⁴");
    }

    #[test]
    fn a_domain_without_extent_or_sense_still_maps() {
        for domain in [
            [0.0, 0.0],
            [3.0, 3.0],
            [f64::NAN, 1.0],
            [2.0, 1.0],
            [f64::NEG_INFINITY, f64::INFINITY],
        ] {
            let scale = Scale::new(domain, [0.0, 10.0], Spacing::Log);
            assert!(scale.domain()[0] < scale.domain()[1]);
            assert!(scale.map(scale.domain()[1]).is_finite());
            assert!(!scale.ticks(5).values.is_empty());
        }
    }
}
