//! A learned posterior: a network that maps the history of an episode to a belief about each
//! unknown.
//!
//! The belief is a Gaussian in prior-scaled coordinates, or the log-odds of a binary unknown. The
//! Gaussian is truncated to the prior's box `[-b, b]`, like a posterior under a uniform prior:
//!
//! ```text
//! q(z) = N(z; m, s^2) / (Phi((b - m) / s) - Phi((-b - m) / s)),   -b <= z <= b
//! m    = b tanh(o_1),   log s = LOW + (HIGH - LOW) sigmoid(o_2 + OFFSET)
//! ```
//!
//! With a large `s` it equals the prior, so a network that has learned nothing claims nothing. The
//! mean of `log q - log prior` over episodes is a lower bound of the information of the episode
//! about the unknown (Barber and Agakov 2003).

use std::f64::consts::LN_10;

use asid_core::Parameter;

use crate::belief::Belief;
use crate::file::{Tensor, Tensors};
use crate::network::{Layer, Network};

/// Smallest and largest logarithm of the standard deviation, prior-scaled: 0.001 and 10.
pub const LOG_STD: [f64; 2] = [-3.0 * LN_10, LN_10];

/// Offset of the second output: an untrained network then has a standard deviation of 1.
pub const OFFSET: f64 = 1.098_612_288_668_109_8;

/// Scaled entries are clipped to plus and minus this many standard deviations.
const CLIP: f64 = 10.0;

/// An entry that varies by less than this, in its unit, is treated as constant.
const CONSTANT: f64 = 1e-9;

/// The network with the scaling of its inputs and the calibration of its outputs.
#[derive(Clone, Debug, PartialEq)]
pub struct Inference {
    /// Mean of each entry of a history; masks are not scaled.
    mean: Vec<f32>,
    /// Standard deviation of each entry.
    std: Vec<f32>,
    /// The network; it takes scaled entries and masks and gives two numbers per unknown.
    network: Network,
    /// Factor on the standard deviation of each unknown (temperature for a binary one).
    calibration: Vec<f32>,
    /// Which unknowns are binary.
    binary: Vec<bool>,
}

impl Inference {
    /// Mean and standard deviation of each of the first `entries` numbers of histories, `n x len`.
    #[must_use]
    pub fn scales(histories: &[f64], len: usize, entries: usize) -> (Vec<f32>, Vec<f32>) {
        let mut moments = (Vec::with_capacity(entries), Vec::with_capacity(entries));
        for i in 0..entries {
            let column = || histories[i..].iter().step_by(len).filter(|x| x.is_finite());
            let n = column().count().max(1) as f64;
            let mean = column().sum::<f64>() / n;
            let variance = column().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
            let std = variance.sqrt();
            moments.0.push(mean as f32);
            moments
                .1
                .push(if std > CONSTANT { std as f32 } else { 1.0 });
        }
        moments
    }

    /// Wraps a trained network.
    #[must_use]
    pub fn new(
        (mean, std): (Vec<f32>, Vec<f32>),
        network: Network,
        parameters: &[Parameter],
    ) -> Self {
        Self {
            mean,
            std,
            network,
            calibration: vec![1.0; parameters.len()],
            binary: parameters.iter().map(Parameter::is_binary).collect(),
        }
    }

    /// Writes the network's inputs for a history: scaled entries, 0 where missing, then the masks.
    pub fn input(&self, history: &[f64], out: &mut Vec<f32>) {
        out.clear();
        scale((&self.mean, &self.std), history, out);
    }

    /// Number of inputs of the network.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.network.inputs()
    }

    /// Belief about each unknown after a history.
    #[must_use]
    pub fn beliefs(&self, history: &[f64]) -> Vec<Belief> {
        let mut input = Vec::with_capacity(self.inputs());
        self.input(history, &mut input);
        let outputs = self.network.forward(&input);
        let all = outputs.chunks_exact(2).zip(&self.binary);
        all.zip(&self.calibration)
            .map(|((o, &binary), &factor)| {
                belief(f64::from(o[0]), f64::from(o[1]), binary).widened(f64::from(factor))
            })
            .collect()
    }

    /// Chooses the factor on each unknown's standard deviation that maximises the likelihood of
    /// held-out truths.
    ///
    /// `histories` is `n x len`; `truths` are prior-scaled, `n x unknowns`.
    pub fn calibrate(&mut self, histories: &[f64], len: usize, truths: &[f64]) {
        /// Factors that are tried: `exp(k / 20)`, from 0.14 to 7.4.
        const TRIES: std::ops::RangeInclusive<i32> = -40..=40;
        let d = self.binary.len();
        if histories.len() < len {
            return;
        }
        let all: Vec<Vec<Belief>> = histories
            .chunks_exact(len)
            .map(|h| self.beliefs(h))
            .collect();
        for i in 0..d {
            let told = |factor: f64| -> f64 {
                let rows = all.iter().zip(truths.chunks_exact(d));
                rows.map(|(b, z)| b[i].widened(factor).log_ratio(z[i]))
                    .sum()
            };
            let factors = TRIES.map(|k| (f64::from(k) / 20.0).exp());
            let best = factors.max_by(|a, b| told(*a).total_cmp(&told(*b)));
            self.calibration[i] *= best.unwrap_or(1.0) as f32;
        }
    }

    /// The network and its scales as tensors, with names that begin with `prefix`.
    pub fn to_tensors(&self, prefix: &str, tensors: &mut Tensors) {
        let named = [
            ("mean", self.mean.clone()),
            ("std", self.std.clone()),
            ("calibration", self.calibration.clone()),
            (
                "binary",
                self.binary
                    .iter()
                    .map(|&b| f32::from(u8::from(b)))
                    .collect(),
            ),
        ];
        for (name, values) in named {
            tensors.insert(format!("{prefix}.{name}"), Tensor::vector(values));
        }
        for (i, layer) in self.network.layers.iter().enumerate() {
            layer.to_tensors(&format!("{prefix}.{i}"), tensors);
        }
    }

    /// Reads the network stored under `prefix`; an error says what is wrong.
    ///
    /// # Errors
    /// Where tensors are missing or do not fit histories of this shape or these unknowns.
    pub fn from_tensors(
        prefix: &str,
        tensors: &Tensors,
        entries: usize,
        masks: usize,
        parameters: &[Parameter],
    ) -> Result<Self, String> {
        let get = |name: &str| -> Result<Vec<f32>, String> {
            let tensor = tensors.get(&format!("{prefix}.{name}"));
            tensor
                .map(|t| t.values.clone())
                .ok_or_else(|| format!("has no tensor `{prefix}.{name}`"))
        };
        let found = Self {
            mean: get("mean")?,
            std: get("std")?,
            network: Network {
                layers: Layer::all_from_tensors(prefix, tensors)?,
            },
            calibration: get("calibration")?,
            binary: get("binary")?.iter().map(|&b| b != 0.0).collect(),
        };
        let d = parameters.len();
        let fits = [found.mean.len(), found.std.len()] == [entries; 2]
            && found.network.inputs() == entries + masks
            && found.network.outputs() == 2 * d
            && [found.calibration.len(), found.binary.len()] == [d; 2]
            && found.std.iter().chain(&found.calibration).all(|&x| x > 0.0);
        if fits {
            Ok(found)
        } else {
            Err(format!(
                "its `{prefix}` is for other histories: it takes {} numbers of {} unknowns, this problem has {} of {d}",
                found.network.inputs(),
                found.network.outputs() / 2,
                entries + masks
            ))
        }
    }
}

/// Appends the network inputs for a history, with these scales of its entries.
pub fn scale((mean, std): (&[f32], &[f32]), history: &[f64], out: &mut Vec<f32>) {
    let (entries, masks) = history.split_at(mean.len());
    for ((x, mean), std) in entries.iter().zip(mean).zip(std) {
        let scaled = (x - f64::from(*mean)) / f64::from(*std);
        out.push(if scaled.is_finite() {
            scaled.clamp(-CLIP, CLIP) as f32
        } else {
            0.0
        });
    }
    out.extend(masks.iter().map(|&m| m as f32));
}

/// Converts two outputs of a network to the belief about an unknown.
#[must_use]
pub fn belief(first: f64, second: f64, binary: bool) -> Belief {
    if binary {
        return Belief::Binary { logit: first };
    }
    let [low, high] = LOG_STD;
    let share = 1.0 / (1.0 + (-(second + OFFSET)).exp());
    Belief::Gaussian {
        mean: Parameter::scaled_bound() * first.tanh(),
        std: (low + (high - low) * share).exp(),
    }
}

#[cfg(test)]
mod tests {
    use asid_core::Streams;

    use super::*;

    /// The density integrates to 1; the prior's is 1 / (2 b).
    #[test]
    fn a_belief_is_a_density_on_the_priors_box() {
        let b = Parameter::scaled_bound();
        for (mean, std) in [(0.0, 10.0), (1.7, 0.2), (-b, 0.05), (0.4, 1.0)] {
            let belief = Belief::Gaussian { mean, std };
            let n = 20_000;
            let (mut total, mut first) = (0.0, 0.0);
            for i in 0..n {
                let z = -b + 2.0 * b * (f64::from(i) + 0.5) / f64::from(n);
                // Density times the width of a cell is exp(log_ratio) / n.
                let share = belief.log_ratio(z).exp() / f64::from(n);
                total += share;
                first += share * z;
            }
            assert!((total - 1.0).abs() < 1e-5, "{belief:?}: {total}");
            assert!((first - belief.mean()).abs() < 1e-5, "{belief:?}: {first}");
        }
        let sure = Belief::Binary {
            logit: 3.0_f64.ln(),
        };
        assert!((sure.log_ratio(1.0) - 1.5_f64.ln()).abs() < 1e-12);
        assert!((sure.log_ratio(-1.0) - 0.5_f64.ln()).abs() < 1e-12);
        assert!((sure.mean() - 0.5).abs() < 1e-12);
    }

    /// 20000 draws: the standard error of the mean is 0.007 standard deviations.
    #[test]
    fn draws_have_the_mean() {
        let mut rng = Streams::new(1).stream("t");
        for belief in [
            Belief::Gaussian {
                mean: 1.5,
                std: 0.8,
            },
            Belief::Binary { logit: -0.7 },
        ] {
            let n = 20_000;
            let sum: f64 = (0..n).map(|_| belief.sample(&mut rng)).sum();
            assert!((sum / f64::from(n) - belief.mean()).abs() < 0.03);
        }
    }

    /// Two measurements of one quantity: precisions add, and so do log-odds.
    #[test]
    fn beliefs_of_two_episodes_are_multiplied() {
        let one = Belief::Gaussian {
            mean: 1.0,
            std: 0.5,
        };
        let other = Belief::Gaussian {
            mean: 0.0,
            std: 1.0,
        };
        let Belief::Gaussian { mean, std } = one.and(other) else {
            panic!("a Gaussian");
        };
        assert!((mean - 0.8).abs() < 1e-12 && (std - 0.2_f64.sqrt()).abs() < 1e-12);
        let both = Belief::Binary { logit: 1.0 }.and(Belief::Binary { logit: -3.0 });
        assert_eq!(both, Belief::Binary { logit: -2.0 });
    }
}
