//! Shares, means and medians with intervals, and the calibration of stated probabilities.

use asid_core::rng::Streams;
use asid_statistics::{bootstrap, mean, wilson};
use rand::Rng as _;
use serde::Serialize;

/// Simulated calibrated answers; 50 of them lie beyond the 95 % quantile.
const DRAWS: usize = 1000;
/// Seed of the simulation, so that the same results give the same bytes.
const SEED: u64 = 0x5c0_7e57;
/// Number of bins of a calibration curve, of equal width.
///
/// Ten, as in Guo et al. 2017, would hold only a case or two each in a set of 75.
pub const BINS: usize = 5;

/// A share of cases.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Share {
    /// Number of cases for which it holds.
    pub count: usize,
    /// Number of cases.
    pub of: usize,
    /// 95 % interval (Wilson 1927), which has a width even if it holds for none or all; null
    /// without a case.
    pub interval95: Option<[f64; 2]>,
}

impl Share {
    /// Share of the cases for which it holds.
    #[must_use]
    pub fn of(holds: impl IntoIterator<Item = bool>) -> Self {
        let (mut count, mut of) = (0, 0);
        for holds in holds {
            count += usize::from(holds);
            of += 1;
        }
        Self {
            count,
            of,
            interval95: (of > 0).then(|| wilson(count, of)),
        }
    }

    /// The share; `None` without a case.
    #[must_use]
    pub fn value(&self) -> Option<f64> {
        (self.of > 0).then(|| self.count as f64 / self.of as f64)
    }

    /// `7 of 9`.
    #[must_use]
    pub fn text(&self) -> String {
        format!("{} of {}", self.count, self.of)
    }
}

/// A mean or median over cases, with its interval.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Figure {
    /// Mean or median.
    pub value: f64,
    /// 95 % interval: percentiles of a bootstrap over cases (Efron 1979).
    pub interval95: [f64; 2],
    /// Number of cases.
    pub of: usize,
}

impl Figure {
    /// Mean; `None` without a case.
    #[must_use]
    pub fn mean(values: &[f64]) -> Option<Self> {
        Self::new(values, mean)
    }

    /// Median; `None` without a case.
    #[must_use]
    pub fn median(values: &[f64]) -> Option<Self> {
        Self::new(values, |v| asid_statistics::median(v.iter().copied()))
    }

    fn new(values: &[f64], of: impl Fn(&[f64]) -> f64) -> Option<Self> {
        (!values.is_empty()).then(|| Self {
            value: of(values),
            interval95: bootstrap(&[values.to_vec()], &of),
            of: values.len(),
        })
    }
}

/// Median; `None` without a value.
#[must_use]
pub fn median(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| asid_statistics::median(values.iter().copied()))
}

/// One bin of a calibration curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bin {
    /// Mean stated probability.
    pub stated: f64,
    /// Share of cases in which the event happened.
    pub true_share: Share,
}

/// Calibration: how far stated probabilities are from the frequencies of their events.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Calibration {
    /// Bins with at least one case, by stated probability.
    pub bins: Vec<Bin>,
    /// Expected calibration error: mean distance of stated probability and true share, over bins
    /// weighted by cases.
    pub error: f64,
    /// Mean error of a perfectly calibrated answer with the same stated probabilities, by
    /// simulation.
    ///
    /// It is the bias of the error at this number of cases.
    pub error_of_chance: f64,
    /// Error below which 95 % of such calibrated answers stay.
    pub error_of_chance95: f64,
}

impl Calibration {
    /// Calibration from pairs of a stated probability and whether its event happened.
    #[must_use]
    pub fn of(stated: &[(f64, bool)]) -> Self {
        let mut random = Streams::new(SEED).stream("calibration");
        let mut chance: Vec<f64> = (0..DRAWS)
            .map(|_| {
                let drawn: Vec<(f64, bool)> = stated
                    .iter()
                    .map(|&(p, _)| (p, random.random::<f64>() < p))
                    .collect();
                error(&drawn)
            })
            .collect();
        chance.sort_by(f64::total_cmp);
        Self {
            bins: bins(stated)
                .into_iter()
                .filter(|b| !b.is_empty())
                .map(|b| Bin {
                    stated: b.iter().map(|x| x.0).sum::<f64>() / b.len() as f64,
                    true_share: Share::of(b.iter().map(|x| x.1)),
                })
                .collect(),
            error: error(stated),
            error_of_chance: chance.iter().sum::<f64>() / DRAWS as f64,
            error_of_chance95: chance[DRAWS * 95 / 100],
        }
    }
}

fn bins(stated: &[(f64, bool)]) -> Vec<Vec<(f64, bool)>> {
    let mut bins = vec![Vec::new(); BINS];
    for &(p, came_true) in stated {
        let bin = (p * BINS as f64) as usize;
        bins[bin.min(BINS - 1)].push((p, came_true));
    }
    bins
}

fn error(stated: &[(f64, bool)]) -> f64 {
    let distance = |bin: &Vec<(f64, bool)>| {
        let sum: f64 = bin.iter().map(|&(p, t)| p - f64::from(u8::from(t))).sum();
        sum.abs()
    };
    bins(stated).iter().map(distance).sum::<f64>() / stated.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_has_the_width_of_its_standard_error_and_none_of_no_case() {
        let values: Vec<f64> = (0..400).map(|i| f64::from(i % 2)).collect();
        let mean = Figure::mean(&values).unwrap();
        let width = mean.interval95[1] - mean.interval95[0];
        let expected = 2.0 * 1.96 * 0.5 / 20.0;
        assert!(
            mean.value == 0.5 && (width / expected - 1.0).abs() < 0.15,
            "{width}"
        );
        assert!(Figure::median(&[]).is_none());
        assert!(Share::of([]).interval95.is_none());
    }

    #[test]
    fn calibrated_answers_show_the_error_of_chance_and_no_more() {
        let mut random = Streams::new(1).stream("answers");
        let calibrated: Vec<(f64, bool)> = (0..60)
            .map(|_| {
                let p: f64 = random.random();
                (p, random.random::<f64>() < p)
            })
            .collect();
        let c = Calibration::of(&calibrated);
        // A few cases show an error even if the answer is calibrated.
        assert!(c.error_of_chance > 0.03, "{c:?}");
        assert!(c.error < c.error_of_chance95, "{c:?}");
        // An answer that is sure and wrong in every second case has an error of a half.
        let boasting: Vec<(f64, bool)> = (0..60).map(|i| (1.0, i % 2 == 0)).collect();
        let c = Calibration::of(&boasting);
        assert!((c.error - 0.5).abs() < 1e-12 && c.error_of_chance < 1e-12);
    }
}
