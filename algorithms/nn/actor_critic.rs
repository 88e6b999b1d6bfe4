//! The networks that PPO trains: a Gaussian actor and a critic, on libtorch.
//!
//! Actor and critic are separate tanh networks. The standard deviation of an action is one trained
//! number per entry, independent of the state. Weights are initialised orthogonally with the gains
//! that matter according to Andrychowicz et al. 2021 ("What matters in on-policy reinforcement
//! learning?"): a small last layer makes the first policy nearly the same everywhere.

use std::f64::consts::{E, PI};

use rand::Rng;
use tch::nn::{Path, VarStore};
use tch::{Device, Kind, Tensor};

use crate::orthogonal::orthogonal;
use asid_learned::Normaliser;
use asid_learned::PpoConfig;
use asid_learned::{Layer, Policy};

/// Actor, critic and the store that owns their parameters.
pub struct ActorCritic {
    pub store: VarStore,
    actor: Network,
    critic: Network,
    /// Logarithm of the actions' standard deviation, `action_len`.
    log_std: Tensor,
    observation_len: usize,
    action_len: usize,
}

/// Gain of the actor's last layer: the first actions are then near the middle of their range
/// (Andrychowicz et al. 2021).
const ACTOR_GAIN: f64 = 0.01;
/// Gain of the critic's last layer: the usual one for a linear output.
const CRITIC_GAIN: f64 = 1.0;

impl ActorCritic {
    /// New networks with weights drawn from `rng`.
    pub fn new(
        observation_len: usize,
        action_len: usize,
        config: &PpoConfig,
        device: Device,
        rng: &mut impl Rng,
    ) -> Self {
        let store = VarStore::new(device);
        let root = store.root();
        let sizes = |outputs: usize| [&[observation_len], &config.hidden[..], &[outputs]].concat();
        let actor = Network::new(&(&root / "actor"), &sizes(action_len), ACTOR_GAIN, rng);
        let critic = Network::new(&(&root / "critic"), &sizes(1), CRITIC_GAIN, rng);
        let start = vec![config.initial_log_std as f32; action_len];
        let log_std = root.var_copy("log_std", &Tensor::from_slice(&start));
        Self {
            store,
            actor,
            critic,
            log_std,
            observation_len,
            action_len,
        }
    }

    /// `entries` as a tensor with rows of `columns`, on the networks' device.
    pub fn tensor(&self, entries: &[f32], columns: usize) -> Tensor {
        let shape = [(entries.len() / columns) as i64, columns as i64];
        Tensor::from_slice(entries)
            .view(shape)
            .to_device(self.store.device())
    }

    /// Observations, `n x observation_len`, as a tensor.
    pub fn observations(&self, entries: &[f32]) -> Tensor {
        self.tensor(entries, self.observation_len)
    }

    /// Actions, `n x action_len`, as a tensor.
    pub fn actions(&self, entries: &[f32]) -> Tensor {
        self.tensor(entries, self.action_len)
    }

    /// Mean actions, `n x action_len`, of observations.
    pub fn mean(&self, observation: &Tensor) -> Tensor {
        self.actor.forward(observation)
    }

    /// Standard deviation of each entry of an action.
    pub fn action_std(&self) -> Vec<f64> {
        to_vec(&self.log_std.exp())
    }

    /// Values, `n`, of observations.
    pub fn value(&self, observation: &Tensor) -> Tensor {
        self.critic.forward(observation).squeeze_dim(1)
    }

    /// Log-density, `n`, of actions given observations.
    pub fn log_prob(&self, observation: &Tensor, action: &Tensor) -> Tensor {
        let off: Tensor = (action - self.mean(observation)) / self.log_std.exp();
        let each: Tensor = off.square() * -0.5 - &self.log_std - 0.5 * (2.0 * PI).ln();
        each.sum_dim_intlist(1, false, None::<Kind>)
    }

    /// Entropy of an action, in nats; scalar.
    pub fn entropy(&self) -> Tensor {
        (&self.log_std + 0.5 * (2.0 * PI * E).ln()).sum(None::<Kind>)
    }

    /// The actor as a plain-number policy.
    pub fn policy(&self, normaliser: &Normaliser) -> Policy {
        let layers = self.actor.layers.iter().map(Dense::plain).collect();
        let log_std = to_vec(&self.log_std);
        Policy::new(normaliser.clone(), layers, log_std)
    }
}

/// Dense layers with tanh between them.
pub struct Network {
    pub layers: Vec<Dense>,
}

impl Network {
    /// Layers of these sizes, from the inputs on.
    pub fn new(path: &Path<'_>, sizes: &[usize], last_gain: f64, rng: &mut impl Rng) -> Self {
        let last = sizes.len() - 2;
        let layers = sizes.windows(2).enumerate().map(|(i, size)| {
            let gain = if i == last { last_gain } else { 2_f64.sqrt() };
            Dense::new(&(path / i), size[0], size[1], gain, rng)
        });
        Self {
            layers: layers.collect(),
        }
    }

    /// Outputs, `n x outputs`, of inputs, `n x inputs`.
    pub fn forward(&self, input: &Tensor) -> Tensor {
        let mut x = self.layers[0].forward(input);
        for layer in &self.layers[1..] {
            x = layer.forward(&x.tanh());
        }
        x
    }
}

/// One layer; `weight` is `outputs x inputs`.
pub struct Dense {
    weight: Tensor,
    bias: Tensor,
}

impl Dense {
    pub fn new(
        path: &Path<'_>,
        inputs: usize,
        outputs: usize,
        gain: f64,
        rng: &mut impl Rng,
    ) -> Self {
        let start = Tensor::from_slice(&orthogonal(outputs, inputs, gain, rng));
        let shape = [outputs as i64, inputs as i64];
        Self {
            weight: path.var_copy("weight", &start.view(shape)),
            bias: path.zeros("bias", &[outputs as i64]),
        }
    }

    pub fn forward(&self, input: &Tensor) -> Tensor {
        input.linear(&self.weight, Some(&self.bias))
    }

    /// The layer as plain numbers, with weights `inputs x outputs`.
    pub fn plain(&self) -> Layer {
        Layer {
            weight: to_vec(&self.weight.transpose(0, 1).contiguous()),
            bias: to_vec(&self.bias),
        }
    }
}

/// The entries of a tensor of any shape, on any device.
pub fn to_vec<T: tch::kind::Element + Default + Clone>(tensor: &Tensor) -> Vec<T> {
    let flat = tensor
        .detach()
        .to_device(Device::Cpu)
        .to_kind(T::KIND)
        .contiguous();
    let mut entries = vec![T::default(); flat.numel()];
    let count = entries.len();
    flat.copy_data(&mut entries, count);
    entries
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn networks(config: &PpoConfig) -> ActorCritic {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        ActorCritic::new(3, 2, config, Device::Cpu, &mut rng)
    }

    #[test]
    fn the_plain_policy_acts_as_the_network_does() {
        let networks = networks(&PpoConfig::default());
        let policy = networks.policy(&Normaliser::identity(3));
        let observation = [0.1, -2.0, 0.7, 1.5, 0.0, -0.3];
        let mut action = [0.0; 4];
        policy.act(&observation, &mut action).unwrap();
        let entries: Vec<f32> = observation.iter().map(|&x| x as f32).collect();
        let mean: Vec<f64> = to_vec(&networks.mean(&networks.observations(&entries)));
        // Tolerance of single precision: only the order of summation differs.
        for (a, m) in action.iter().zip(&mean) {
            assert!((a - m).abs() < 1e-6, "{action:?} {mean:?}");
        }
        assert!(mean.iter().any(|m| m.abs() > 1e-4));
    }

    /// A normal density of standard deviation 1/2 in two dimensions, by hand.
    #[test]
    fn density_and_entropy_are_those_of_a_gaussian() {
        let config = PpoConfig {
            initial_log_std: 0.5_f64.ln(),
            ..PpoConfig::default()
        };
        let networks = networks(&config);
        let observation = networks.observations(&[0.1, 0.2, 0.3]);
        let mean: Vec<f32> = to_vec(&networks.mean(&observation));
        let action = networks.actions(&[mean[0] + 0.5, mean[1] - 1.0]);
        let found = networks.log_prob(&observation, &action).double_value(&[0]);
        let expected = -0.5 * (1.0 + 4.0) - 2.0 * (0.5 * (2.0 * PI).sqrt()).ln();
        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
        let entropy = networks.entropy().double_value(&[]);
        let expected = (2.0 * PI * E * 0.25).ln();
        assert!((entropy - expected).abs() < 1e-5, "{entropy} {expected}");
    }
}
