//! An ensemble of probabilistic dynamics networks, and the disagreement of its members.
//!
//! Each member predicts the change of the state's places as a Gaussian with diagonal covariance,
//! given state and action. It is fitted by maximum likelihood, with its own initial weights and its
//! own order of samples (Chua et al. 2018; Lakshminarayanan et al. 2017). Disagreement is the
//! Jensen-Rényi divergence of order 2, which has a closed form for Gaussians (Shyam et al. 2019,
//! section 3):
//!
//! ```text
//! JRD = H2(sum_i p_i / n) - sum_i H2(p_i) / n,   H2(p) = -log int p^2
//!     = -log( 1/n^2 sum_ij N(m_i; m_j, S_i + S_j) ) - 1/n sum_i 1/2 log det(4 pi S_i)
//! ```
//!
//! Noise that all members expect alike does not contribute.

use std::f64::consts::TAU;

use asid_core::{Error, Result};
use asid_learned::max::EnsembleSettings;
use rand::Rng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use tch::nn::{Adam, Optimizer, OptimizerConfig, Path, VarStore};
use tch::{Device, Kind, Tensor};

use crate::actor_critic::Dense;

/// Range of the log-variance that a member may predict, for changes scaled to a variance of 1.
///
/// The standard deviation then lies between a thousandth of that of the changes and e times it.
/// Chosen here; not taken from a source.
const LOG_VARIANCE: [f64; 2] = [-13.8, 2.0];

/// Largest norm of a gradient, over all parameters of a member.
const MAX_GRADIENT_NORM: f64 = 5.0;

/// Smallest standard deviation of an entry that is not treated as constant, in its unit.
const CONSTANT: f64 = 1e-6;

/// Transitions: state, action and change of the places (the entries that move).
#[derive(Clone, Debug, Default)]
pub struct Transitions {
    /// States, `n x state`.
    pub state: Vec<f32>,
    /// Actions, `n x action`.
    pub action: Vec<f32>,
    /// Changes, `n x places`.
    pub change: Vec<f32>,
}

impl Transitions {
    /// The transitions after those of `before`, which are the first of these.
    pub fn after(&self, before: &Self, widths: Widths) -> Self {
        let n = before.change.len() / widths.places;
        Self {
            state: self.state[n * widths.state..].to_vec(),
            action: self.action[n * widths.action..].to_vec(),
            change: self.change[n * widths.places..].to_vec(),
        }
    }
}

/// Row lengths of transitions.
#[derive(Clone, Copy, Debug)]
pub struct Widths {
    pub state: usize,
    pub action: usize,
    pub places: usize,
}

/// Mean and standard deviation of columns.
struct Scales {
    mean: Tensor,
    std: Tensor,
}

impl Scales {
    fn of(rows: &Tensor) -> Self {
        let std = rows.std_dim(Some([0].as_slice()), false, false);
        let constant = std.lt(CONSTANT);
        Self {
            mean: rows.mean_dim(Some([0].as_slice()), false, Kind::Float),
            std: std.where_self(&constant.logical_not(), &Tensor::from(1.0_f32)),
        }
    }

    fn scale(&self, rows: &Tensor) -> Tensor {
        (rows - &self.mean) / &self.std
    }
}

struct Member {
    layers: Vec<Dense>,
    optimiser: Optimizer,
    _store: VarStore,
}

/// The members' predictions of scaled changes, each `models x n x places`.
pub struct Prediction {
    pub mean: Tensor,
    pub variance: Tensor,
}

impl Prediction {
    /// The prediction of the first `places` alone.
    pub fn first(&self, places: usize) -> Self {
        let part = |all: &Tensor| all.narrow(2, 0, places as i64);
        Self {
            mean: part(&self.mean),
            variance: part(&self.variance),
        }
    }
}

/// The members, with the scales of their inputs and outputs.
pub struct Ensemble {
    members: Vec<Member>,
    widths: Widths,
    scales: Option<[Scales; 2]>,
}

impl Ensemble {
    /// Members with initial weights drawn from `rng`.
    ///
    /// # Errors
    /// [`Error::Failed`] where libtorch refuses the optimiser.
    pub fn new(settings: &EnsembleSettings, widths: Widths, rng: &mut impl Rng) -> Result<Self> {
        tch::set_num_threads(1);
        let sizes = [
            &[widths.state + widths.action],
            &settings.hidden[..],
            &[2 * widths.places],
        ]
        .concat();
        let mut members = Vec::with_capacity(settings.models);
        for _ in 0..settings.models {
            let store = VarStore::new(Device::Cpu);
            let root: Path<'_> = store.root();
            let layers = sizes
                .windows(2)
                .enumerate()
                .map(|(i, size)| Dense::new(&(&root / i), size[0], size[1], 1.0, rng))
                .collect();
            let optimiser = Adam::default()
                .build(&store, settings.learning_rate)
                .map_err(|e| Error::Failed(format!("libtorch: {e}")))?;
            members.push(Member {
                layers,
                optimiser,
                _store: store,
            });
        }
        Ok(Self {
            members,
            widths,
            scales: None,
        })
    }

    /// Fits every member to all transitions.
    pub fn fit(&mut self, data: &Transitions, settings: &EnsembleSettings, rng: &mut ChaCha8Rng) {
        let rows =
            |values: &[f32], width: usize| Tensor::from_slice(values).view([-1, width as i64]);
        let state = rows(&data.state, self.widths.state);
        let action = rows(&data.action, self.widths.action);
        let input = Tensor::cat(&[state, action], 1);
        let change = rows(&data.change, self.widths.places);
        let scales = [Scales::of(&input), Scales::of(&change)];
        let (input, target) = (scales[0].scale(&input), scales[1].scale(&change));
        self.scales = Some(scales);
        let n = target.size()[0];
        for member in &mut self.members {
            let mut order: Vec<i64> = (0..n).collect();
            for _ in 0..settings.epochs {
                order.shuffle(rng);
                for part in order.chunks(settings.minibatch) {
                    let index = Tensor::from_slice(part);
                    let seen = input.index_select(0, &index);
                    let wanted = target.index_select(0, &index);
                    let (mean, variance) = member.forward(&seen);
                    let nll: Tensor =
                        (wanted - mean).square() / &variance * 0.5 + variance.log() * 0.5;
                    let loss = nll.mean(None::<Kind>);
                    member
                        .optimiser
                        .backward_step_clip_norm(&loss, MAX_GRADIENT_NORM);
                }
            }
        }
    }

    /// Predictions for states (`n x state`) and actions (`n x action`); `None` before a fit.
    pub fn predict(&self, state: &[f32], action: &[f32]) -> Option<Prediction> {
        let scales = self.scales.as_ref()?;
        let rows =
            |values: &[f32], width: usize| Tensor::from_slice(values).view([-1, width as i64]);
        let state = rows(state, self.widths.state);
        let input = Tensor::cat(&[state, rows(action, self.widths.action)], 1);
        let input = scales[0].scale(&input);
        let all: Vec<(Tensor, Tensor)> = tch::no_grad(|| {
            let members = self.members.iter();
            members.map(|m| m.forward(&input)).collect()
        });
        let stack = |pick: fn(&(Tensor, Tensor)) -> &Tensor| {
            let each: Vec<&Tensor> = all.iter().map(pick).collect();
            Tensor::stack(&each, 0)
        };
        Some(Prediction {
            mean: stack(|m| &m.0),
            variance: stack(|m| &m.1),
        })
    }

    /// Mean divergence of the first `paid` places over transitions, nats; `None` before a fit and
    /// without transitions.
    pub fn utility(&self, data: &Transitions, paid: usize) -> Option<f64> {
        let prediction = self.predict(&data.state, &data.action)?;
        let each = divergence(&prediction.first(paid));
        let found = each.mean(None::<Kind>).double_value(&[]);
        found.is_finite().then_some(found)
    }

    /// Root mean square error of the mean prediction over that of the prediction of no change.
    ///
    /// Places are weighted by their scales. `None` before a fit and without transitions.
    pub fn error(&self, data: &Transitions) -> Option<f64> {
        let prediction = self.predict(&data.state, &data.action)?;
        let mean = prediction
            .mean
            .mean_dim(Some([0].as_slice()), false, None::<Kind>);
        let std = &self.scales.as_ref()?[1].std;
        let wanted = Tensor::from_slice(&data.change).view([-1, self.widths.places as i64]);
        let power = |off: Tensor| (off / std).square().mean(None::<Kind>).double_value(&[]);
        let error = (power(&wanted - self.unscale(&mean)) / power(wanted)).sqrt();
        error.is_finite().then_some(error)
    }

    /// Converts scaled changes to the state's units, `n x places`.
    pub fn unscale(&self, scaled: &Tensor) -> Tensor {
        match &self.scales {
            Some(scales) => scaled * &scales[1].std + &scales[1].mean,
            None => scaled.shallow_clone(),
        }
    }
}

impl Member {
    /// Mean and variance of scaled changes.
    fn forward(&self, input: &Tensor) -> (Tensor, Tensor) {
        let mut x = input.shallow_clone();
        for (i, layer) in self.layers.iter().enumerate() {
            if i > 0 {
                x = x.silu();
            }
            x = layer.forward(&x);
        }
        let places = x.size()[1] / 2;
        let [low, high] = LOG_VARIANCE;
        let log_variance: Tensor = x.narrow(1, places, places).sigmoid() * (high - low) + low;
        (x.narrow(1, 0, places), log_variance.exp())
    }
}

/// Jensen-Rényi divergence of the members' predictions, `n`, in nats; see the module documentation.
pub fn divergence(prediction: &Prediction) -> Tensor {
    let Prediction { mean, variance } = prediction;
    let models = mean.size()[0] as f64;
    let dimensions = mean.size()[2] as f64;
    // Pairs of members: models x models x n.
    let off = mean.unsqueeze(0) - mean.unsqueeze(1);
    let wide = variance.unsqueeze(0) + variance.unsqueeze(1);
    let each: Tensor = off.square() / &wide + wide.log();
    let log_pair: Tensor =
        (each.sum_dim_intlist(3, false, None::<Kind>) + dimensions * TAU.ln()) * -0.5;
    let mixture = -(log_pair.logsumexp([0, 1].as_slice(), false) - 2.0 * models.ln());
    let alone: Tensor = (variance.log().sum_dim_intlist(2, false, None::<Kind>)
        + dimensions * (2.0 * TAU).ln())
        * 0.5;
    mixture - alone.mean_dim(Some([0].as_slice()), false, None::<Kind>)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    fn prediction(means: &[f64], variances: &[f64]) -> Prediction {
        let shape = [means.len() as i64, 1, 1];
        Prediction {
            mean: Tensor::from_slice(means).view(shape),
            variance: Tensor::from_slice(variances).view(shape),
        }
    }

    /// By hand, for two unit Gaussians `d` apart: the square of their mixture integrates to `(1 +
    /// exp(-d^2 / 4)) / 2 / sqrt(4 pi)`, each square alone to `1 / sqrt(4 pi)`. The divergence is
    /// therefore `ln 2 - ln(1 + exp(-d^2 / 4))`: 0 at the same mean, ln 2 far apart.
    #[test]
    fn the_divergence_of_two_gaussians_is_known() {
        for d in [0.0, 1.0, 2.5, 40.0] {
            let found = divergence(&prediction(&[0.0, d], &[1.0, 1.0])).double_value(&[0]);
            let expected = 2.0_f64.ln() - (-d * d / 4.0).exp().ln_1p();
            assert!((found - expected).abs() < 1e-12, "{d}: {found} {expected}");
        }
        // Variances 1 and 4, equal means. Pairs: N(0; 0, 2), N(0; 0, 8), twice N(0; 0, 5).
        let found = divergence(&prediction(&[0.0, 0.0], &[1.0, 4.0])).double_value(&[0]);
        let at_zero = |variance: f64| 1.0 / (TAU * variance).sqrt();
        let mixture = (at_zero(2.0) + at_zero(8.0) + 2.0 * at_zero(5.0)) / 4.0;
        let alone = -0.5 * (at_zero(2.0).ln() + at_zero(8.0).ln());
        assert!((found - (-mixture.ln() - alone)).abs() < 1e-12, "{found}");
    }

    /// Five members, in double and in single precision, against the explicit sums over pairs.
    #[test]
    fn the_divergence_of_five_members_is_that_of_the_sums() {
        let means: [f64; 5] = [6.030041, 5.741407, 4.648544, 4.870511, 7.051518];
        let variances: [f64; 5] = [0.352452, 0.361988, 0.360031, 0.360591, 0.21593];
        let (mut mixture, mut alone) = (0.0, 0.0);
        for (m, v) in means.iter().zip(&variances) {
            for (n, w) in means.iter().zip(&variances) {
                let sum: f64 = v + w;
                mixture += (-0.5_f64 * (m - n).powi(2) / sum).exp() / (TAU * sum).sqrt() / 25.0;
            }
            alone += 0.5 * (2.0 * TAU * v).ln() / 5.0;
        }
        let expected = -mixture.ln() - alone;
        let double = prediction(&means, &variances);
        let single = Prediction {
            mean: double.mean.to_kind(Kind::Float),
            variance: double.variance.to_kind(Kind::Float),
        };
        for (given, tolerance) in [(double, 1e-9), (single, 1e-5)] {
            let found = divergence(&given).double_value(&[0]);
            assert!((found - expected).abs() < tolerance, "{found} {expected}");
        }
    }

    /// Two members that agree on the first place and are far apart on the second, for example the
    /// hand's.
    #[test]
    fn a_place_that_is_not_paid_for_adds_nothing() {
        let rows = |values: &[f64]| Tensor::from_slice(values).view([2, 1, 2]);
        let both = Prediction {
            mean: rows(&[1.0, 0.0, 1.0, 40.0]),
            variance: rows(&[1.0; 4]),
        };
        let of = |p: &Prediction| divergence(p).double_value(&[0]);
        assert!((of(&both) - 2.0_f64.ln()).abs() < 1e-12);
        assert!(of(&both.first(1)).abs() < 1e-12);
    }

    /// Where all members have seen data they agree, whatever the noise; where none has, they
    /// disagree.
    #[test]
    fn members_disagree_where_nothing_was_seen() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let widths = Widths {
            state: 1,
            action: 1,
            places: 1,
        };
        let settings = EnsembleSettings {
            hidden: vec![32],
            epochs: 300,
            ..EnsembleSettings::default()
        };
        let mut data = Transitions::default();
        for _ in 0..1000 {
            let (x, a) = (
                rng.random_range(-1.0..0.0_f32),
                rng.random_range(-1.0..1.0_f32),
            );
            data.state.push(x);
            data.action.push(a);
            data.change
                .push((3.0 * x).sin() + a + 0.1 * rng.random_range(-1.0..1.0_f32));
        }
        let mut ensemble = Ensemble::new(&settings, widths, &mut rng).unwrap();
        assert!(ensemble.predict(&[0.0], &[0.0]).is_none());
        ensemble.fit(&data, &settings, &mut rng);
        let at = |x: f32| {
            let prediction = ensemble.predict(&[x], &[0.2]).unwrap();
            divergence(&prediction).double_value(&[0])
        };
        assert!(
            at(-0.5) < 0.3 * at(2.0),
            "divergence {} {}",
            at(-0.5),
            at(2.0)
        );
        let mean = ensemble.predict(&[-0.5], &[0.2]).unwrap().mean;
        let one = mean.mean_dim(Some([0].as_slice()), false, None::<Kind>);
        let change = ensemble.unscale(&one).double_value(&[0, 0]);
        let expected = (-1.5_f64).sin() + 0.2;
        assert!(
            (change - expected).abs() < 0.15,
            "change {change} {expected}"
        );
    }
}
