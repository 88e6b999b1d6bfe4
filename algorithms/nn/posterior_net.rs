//! Fits the network of a learned posterior ([`asid_learned::inference`]) by maximum likelihood.

use asid_core::{Error, Parameter, Result};
use asid_learned::inference::{Inference, LOG_STD, OFFSET, scale};
use asid_learned::{Dataset, Network as Plain};
use rand::Rng;
use tch::nn::{AdamW, Optimizer, OptimizerConfig, VarStore};
use tch::{Device, Kind, Tensor};

use crate::actor_critic::{Dense, Network};

/// Gain of the last layer: a small one, so that training starts at the prior.
const LAST_GAIN: f64 = 0.01;

/// Largest norm of a gradient, over all parameters together.
const MAX_GRADIENT_NORM: f64 = 1.0;

/// Episodes as tensors.
pub struct Rows {
    /// Scaled histories, `n x inputs`.
    pub input: Tensor,
    /// Prior-scaled truths, `n x unknowns`.
    pub truth: Tensor,
}

/// The network, its optimiser and the scales of its inputs.
pub struct PosteriorNet {
    network: Network,
    optimiser: Optimizer,
    /// Owns the parameters.
    store: VarStore,
    scales: (Vec<f32>, Vec<f32>),
    marks: usize,
    parameters: Vec<Parameter>,
}

impl PosteriorNet {
    /// Creates a network for histories like those of `data`.
    ///
    /// # Errors
    /// [`Error::Failed`] where libtorch refuses the optimiser.
    pub fn new(
        data: &Dataset,
        parameters: &[Parameter],
        hidden: &[usize],
        (learning_rate, weight_decay): (f64, f64),
        rng: &mut impl Rng,
    ) -> Result<Self> {
        tch::set_num_threads(1);
        let store = VarStore::new(Device::Cpu);
        let sizes = [&[data.len], hidden, &[2 * parameters.len()]].concat();
        let network = Network::new(&store.root(), &sizes, LAST_GAIN, rng);
        let adam = AdamW {
            wd: weight_decay,
            ..AdamW::default()
        };
        let optimiser = adam
            .build(&store, learning_rate)
            .map_err(|e| Error::Failed(format!("libtorch: {e}")))?;
        Ok(Self {
            network,
            optimiser,
            store,
            scales: Inference::scales(&data.histories, data.len, data.entries),
            marks: data.marks,
            parameters: parameters.to_vec(),
        })
    }

    /// Converts episodes to the network's inputs and targets.
    pub fn rows(&self, data: &Dataset) -> Rows {
        let mut input = Vec::with_capacity(data.histories.len());
        for history in data.histories.chunks_exact(data.len) {
            scale((&self.scales.0, &self.scales.1), history, &mut input);
        }
        let truth: Vec<f32> = data.truths.iter().map(|&z| z as f32).collect();
        let columns =
            |values: &[f32], columns: usize| Tensor::from_slice(values).view([-1, columns as i64]);
        Rows {
            input: columns(&input, data.len),
            truth: columns(&truth, self.parameters.len()),
        }
    }

    /// Copies all weights, for [`Self::set_weights`].
    pub fn weights(&self) -> Vec<Tensor> {
        let all = self.store.trainable_variables();
        all.iter().map(|t| t.detach().copy()).collect()
    }

    /// Restores weights from [`Self::weights`].
    pub fn set_weights(&mut self, weights: &[Tensor]) {
        tch::no_grad(|| {
            for (mut t, kept) in self.store.trainable_variables().into_iter().zip(weights) {
                t.copy_(kept);
            }
        });
    }

    /// Sets the step size.
    pub fn set_learning_rate(&mut self, rate: f64) {
        self.optimiser.set_lr(rate);
    }

    /// Takes one step of Adam on some rows; returns the loss.
    ///
    /// With `keep` (`rows x marks`, 0 or 1) only the marks with a 1 are shown.
    pub fn step(&mut self, rows: &Rows, keep: Option<&Tensor>) -> f64 {
        let loss = match keep {
            None => self.loss(rows),
            Some(keep) => self.loss(&Rows {
                input: self.shown(&rows.input, keep),
                truth: rows.truth.shallow_clone(),
            }),
        };
        let norm = MAX_GRADIENT_NORM;
        self.optimiser.backward_step_clip_norm(&loss, norm);
        loss.double_value(&[])
    }

    /// Mean of `-(log q - log prior)` over rows and unknowns, nats.
    pub fn loss(&self, rows: &Rows) -> Tensor {
        let outputs = self.network.forward(&rows.input);
        let mut sum = Tensor::from(0.0_f32);
        for (i, parameter) in self.parameters.iter().enumerate() {
            let column = |k: usize| outputs.select(1, (2 * i + k) as i64);
            let z = rows.truth.select(1, i as i64);
            sum += log_ratio(&column(0), &column(1), &z, parameter.is_binary()).mean(None::<Kind>);
        }
        -sum / self.parameters.len() as f64
    }

    /// Inputs in which marks that are not kept have the values of missing marks.
    fn shown(&self, input: &Tensor, keep: &Tensor) -> Tensor {
        let (n, marks) = (input.size()[0], self.marks as i64);
        let entries = self.scales.0.len() as i64;
        let keep = keep.unsqueeze(2);
        let part = |from: i64, len: i64| {
            let block = input.narrow(1, from, len).reshape([n, marks, len / marks]);
            (block * &keep).reshape([n, len])
        };
        let masks = input.size()[1] - entries;
        Tensor::cat(&[part(0, entries), part(entries, masks)], 1)
    }

    /// The network as plain numbers.
    pub fn plain(&self) -> Inference {
        let layers = self.network.layers.iter().map(Dense::plain).collect();
        let network = Plain { layers };
        Inference::new(self.scales.clone(), network, &self.parameters)
    }
}

/// `log q(z) - log prior(z)`, `n`, from the outputs for one unknown; see
/// [`asid_learned::inference`] for the formula.
fn log_ratio(first: &Tensor, second: &Tensor, z: &Tensor, binary: bool) -> Tensor {
    if binary {
        return (z * first).log_sigmoid() + std::f64::consts::LN_2;
    }
    let b = Parameter::scaled_bound();
    let [low, high] = LOG_STD;
    let mean: Tensor = first.tanh() * b;
    let log_std: Tensor = (second + OFFSET).sigmoid() * (high - low) + low;
    let std = log_std.exp();
    let root = std::f64::consts::SQRT_2;
    let upper: Tensor = (-&mean + b) / (&std * root);
    let lower: Tensor = (-&mean - b) / (&std * root);
    let inside: Tensor = (upper.erf() - lower.erf()) * 0.5;
    let off: Tensor = (z - &mean) / &std;
    let constant = (2.0 * b).ln() - 0.5 * std::f64::consts::TAU.ln();
    off.square() * -0.5 - log_std - inside.log() + constant
}

#[cfg(test)]
mod tests {
    use asid_learned::inference::belief;

    use super::*;

    /// The training loss equals the density that the plain network evaluates.
    #[test]
    fn the_density_is_that_of_the_plain_network() {
        for (first, second, z) in [(0.3, 0.5, -0.2), (-1.2, -2.0, -1.4), (2.0, 3.0, 1.0)] {
            for binary in [false, true] {
                let z = if binary { f64::signum(z) } else { z };
                let [a, b, c] = [first, second, z].map(|x| Tensor::from_slice(&[x]));
                let found = log_ratio(&a, &b, &c, binary).double_value(&[0]);
                let expected = belief(first, second, binary).log_ratio(z);
                assert!((found - expected).abs() < 1e-9, "{found} {expected}");
            }
        }
    }
}
