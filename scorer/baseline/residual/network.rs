//! A network with two hidden layers, trained by Adam (Kingma and Ba 2015).
//!
//! Training stops early by a log from which the network does not learn.

use std::sync::{Mutex, PoisonError};

use tch::nn::{self, Module, OptimizerConfig};
use tch::{Device, Kind, Tensor};

use super::Sequence;

/// Units of a hidden layer: about a thousand weights for about a thousand rows.
const HIDDEN: i64 = 32;
/// Step size of Adam: the authors' default is 1e-3; full batches allow three times that.
const RATE: f64 = 3e-3;
/// Maximum number of Adam steps; one is a pass over all rows.
const STEPS: usize = 1500;
/// Steps between two evaluations of the log that stops the training.
const LOOK: usize = 10;
/// Evaluations without an improvement after which the training ends.
const PATIENCE: usize = 15;

/// A trained network.
pub struct Network {
    layers: nn::Sequential,
    /// Its weights, kept alive.
    _weights: nn::VarStore,
    inputs: Scale,
    outputs: Scale,
}

/// Mean and standard deviation of each column.
struct Scale {
    mean: Tensor,
    deviation: Tensor,
}

impl Scale {
    /// The scale of the finite values of each column; a constant column is not scaled.
    fn of(rows: &Tensor) -> Self {
        let present = rows.isfinite().to_kind(Kind::Float);
        let count = present
            .sum_dim_intlist(0i64, false, Kind::Float)
            .clamp_min(1.0);
        let known = rows.nan_to_num(0.0, 0.0, 0.0);
        let mean = known.sum_dim_intlist(0i64, false, Kind::Float) / &count;
        let square = ((&known - &mean) * &present).square();
        let deviation = (square.sum_dim_intlist(0i64, false, Kind::Float) / count).sqrt();
        let still = deviation.lt(1e-9);
        Self {
            mean,
            deviation: deviation.masked_fill(&still, 1.0),
        }
    }

    fn to_unit(&self, rows: &Tensor) -> Tensor {
        (rows - &self.mean) / &self.deviation
    }
}

fn matrix(values: &[f64], width: usize) -> Tensor {
    let rows = values.len() / width.max(1);
    Tensor::from_slice(values)
        .to_kind(Kind::Float)
        .view([rows as i64, width as i64])
}

fn stacked(logs: &[Sequence], of: impl Fn(&Sequence) -> Tensor) -> Tensor {
    let all: Vec<Tensor> = logs.iter().map(of).collect();
    Tensor::cat(&all, 0)
}

fn inputs(log: &Sequence) -> Tensor {
    // A replay that diverged has no information from there on.
    matrix(&log.inputs, log.width).nan_to_num(0.0, 0.0, 0.0)
}

fn residuals(log: &Sequence) -> Tensor {
    let rows = log.inputs.len() / log.width.max(1);
    matrix(&log.residuals, log.residuals.len() / rows.max(1))
}

/// Lock for training: libtorch has one random number generator for all threads.
static SEEDED: Mutex<()> = Mutex::new(());

impl Network {
    /// Trains a network on some logs; the last of several logs stops the training.
    ///
    /// Before its first step the network predicts zero residuals. If no step helps on the last log,
    /// it keeps predicting zero. The same seed gives the same network.
    pub fn trained(logs: &[Sequence], seed: u64) -> Self {
        let _alone = SEEDED.lock().unwrap_or_else(PoisonError::into_inner);
        tch::manual_seed(i64::from_ne_bytes(seed.to_ne_bytes()));
        // One thread sums over rows in the same order on every machine.
        tch::set_num_threads(1);
        let (learn, stop) = match logs {
            [learn @ .., stop] if !learn.is_empty() => (learn, std::slice::from_ref(stop)),
            all => (all, all),
        };
        let [x, y] = [stacked(learn, inputs), stacked(learn, residuals)];
        let [held_x, held_y] = [stacked(stop, inputs), stacked(stop, residuals)];
        let weights = nn::VarStore::new(Device::Cpu);
        let root = weights.root();
        let (from, to) = (x.size()[1], y.size()[1]);
        let silent = nn::LinearConfig {
            ws_init: nn::Init::Const(0.0),
            bs_init: Some(nn::Init::Const(0.0)),
            bias: true,
        };
        let layers = nn::seq()
            .add(nn::linear(
                &root / "a",
                from,
                HIDDEN,
                nn::LinearConfig::default(),
            ))
            .add_fn(Tensor::tanh)
            .add(nn::linear(
                &root / "b",
                HIDDEN,
                HIDDEN,
                nn::LinearConfig::default(),
            ))
            .add_fn(Tensor::tanh)
            .add(nn::linear(&root / "c", HIDDEN, to, silent));
        let mut outputs = Scale::of(&y);
        outputs.mean = outputs.mean.zeros_like();
        let network = Self {
            inputs: Scale::of(&x),
            outputs,
            layers,
            _weights: weights,
        };
        network.descend([&x, &y], [&held_x, &held_y]);
        network
    }

    /// Mean squared difference of the finite values, in units of the residuals' standard deviation.
    fn loss(&self, x: &Tensor, y: &Tensor) -> Tensor {
        let wanted = self.outputs.to_unit(y);
        let present = wanted.isfinite().to_kind(Kind::Float);
        let wanted = wanted.nan_to_num(0.0, 0.0, 0.0);
        let said = self.layers.forward(&self.inputs.to_unit(x));
        let squares = ((said - wanted) * &present).square();
        squares.sum(Kind::Float) / present.sum(Kind::Float).clamp_min(1.0)
    }

    /// Minimises the loss on the first rows and keeps the weights that are best on the second.
    fn descend(&self, [x, y]: [&Tensor; 2], [held_x, held_y]: [&Tensor; 2]) {
        let Ok(mut adam) = nn::Adam::default().build(&self._weights, RATE) else {
            return;
        };
        let look = || tch::no_grad(|| self.loss(held_x, held_y).double_value(&[]));
        let copy = || -> Vec<Tensor> {
            let all = self._weights.trainable_variables();
            all.iter().map(|v| v.detach().copy()).collect()
        };
        let (mut least, mut best, mut since) = (look(), copy(), 0);
        for step in 1..=STEPS {
            adam.backward_step(&self.loss(x, y));
            if step % LOOK != 0 {
                continue;
            }
            let now = look();
            since += 1;
            if now < least {
                (least, best, since) = (now, copy(), 0);
            }
            if since >= PATIENCE {
                break;
            }
        }
        tch::no_grad(|| {
            for (mut to, from) in self._weights.trainable_variables().into_iter().zip(&best) {
                to.copy_(from);
            }
        });
    }

    /// Predicted residuals of a log, `rows x outputs`, in units of the noise.
    pub fn residuals(&self, log: &Sequence) -> Vec<f64> {
        let said = tch::no_grad(|| {
            let unit = self.layers.forward(&self.inputs.to_unit(&inputs(log)));
            unit * &self.outputs.deviation
        });
        let flat = said.to_kind(Kind::Double).contiguous().view(-1);
        Vec::<f64>::try_from(flat).unwrap_or_else(|_| vec![0.0; log.residuals.len()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a log.
    const ROWS: usize = 300;

    /// A pseudo-random number, uniform in -1 to 1 (a linear congruential generator, Knuth's MMIX).
    fn draw(state: &mut u64) -> f64 {
        *state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// A log whose residual is `size` times a closed form of command and reading, plus noise of
    /// standard deviation one.
    fn log(number: u64, size: f64) -> Sequence {
        let mut state = number;
        let phase = 6.0 * draw(&mut state);
        let (mut inputs, mut residuals) = (Vec::new(), Vec::new());
        for row in 0..ROWS {
            let t = row as f64 * 0.02;
            let (u, q) = ((2.0 * t + phase).sin(), (2.0 * t + phase - 0.6).sin());
            inputs.extend([u, 30.0 + 5.0 * q]);
            // Uniform noise of standard deviation one.
            let noise = 3f64.sqrt() * draw(&mut state);
            residuals.push(size * (u * u - 0.5 * q) + noise);
        }
        Sequence {
            inputs,
            width: 2,
            residuals,
        }
    }

    /// Root mean square residual of a log that the network never saw, before and after subtraction
    /// of its prediction.
    fn gaps(size: f64, seed: u64) -> [f64; 2] {
        let logs: Vec<Sequence> = (1..6).map(|n| log(n, size)).collect();
        let network = Network::trained(&logs, seed);
        let test = log(77, size);
        let said = network.residuals(&test);
        let rms =
            |x: &mut dyn Iterator<Item = f64>| (x.map(|r| r * r).sum::<f64>() / ROWS as f64).sqrt();
        let left = test.residuals.iter().zip(&said).map(|(r, s)| r - s);
        [rms(&mut test.residuals.iter().copied()), rms(&mut { left })]
    }

    #[test]
    fn a_residual_that_inputs_determine_is_taken_off_on_a_log_never_seen() {
        let [before, after] = gaps(5.0, 3);
        let closed = 1.0 - (after * after - 1.0) / (before * before - 1.0);
        assert!(before > 3.0 && closed > 0.9, "{before} {after}");
    }

    #[test]
    fn of_white_noise_nothing_is_learned() {
        let [before, after] = gaps(0.0, 3);
        assert!((after / before - 1.0).abs() < 0.03, "{before} {after}");
    }

    #[test]
    fn a_seed_gives_one_network() {
        assert_eq!(gaps(2.0, 5), gaps(2.0, 5));
    }
}
