//! Proximal policy optimisation with a clipped objective (Schulman et al. 2017,
//! "Proximal policy optimization algorithms", algorithm 1), from top to bottom.
//!
//! ```text
//! repeat
//!     act for n_steps in the batch of environments      (rollout.rs)
//!     advantages by generalised advantage estimation    (gae.rs)
//!     for each epoch and minibatch
//!         ascend the clipped surrogate objective        (surrogate.rs)
//!         and descend the squared error of the critic
//! ```
//!
//! A time limit is not a failure: a truncated episode has the critic's value of the state it
//! reached. Rewards have a constant scale.

use std::ops::ControlFlow;

use asid_core::{BatchEnvironment, Error, Result};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use tch::nn::{Adam, Optimizer, OptimizerConfig};
use tch::{Kind, Tensor};

use crate::actor_critic::{ActorCritic, to_vec};
use crate::device::device;
use crate::evaluation::{Evaluation, evaluate, mean_and_std};
use crate::gae::{Outcome, advantages};
use crate::rollout::{Collector, Rollout};
use crate::surrogate::{Shift, clipped_surrogate_loss, shift};
use asid_learned::Normaliser;
use asid_learned::Policy;
use asid_learned::PpoConfig;

/// One point of the learning curve: the result of one update.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PpoProgress {
    /// Environment steps so far, over the whole batch.
    pub env_steps: usize,
    /// Environment steps to train for.
    pub total_steps: usize,
    /// Mean undiscounted, unscaled return of the episodes that ended in this rollout; `None` where
    /// no episode ended.
    pub mean_return: Option<f64>,
    /// Standard deviation of those returns.
    pub return_std: Option<f64>,
    /// Mean standard deviation of the entries of an action.
    pub action_std: f64,
    /// Mean clipped surrogate loss over the update's minibatches.
    pub policy_loss: f64,
    /// Mean squared error of the critic over the update's minibatches, in scaled rewards.
    pub value_loss: f64,
    /// Step size of the update.
    pub learning_rate: f64,
    /// KL(old, new) over this rollout's samples after the update.
    pub approx_kl: f64,
    /// Share of this rollout's samples outside the clipping interval after the update.
    pub clip_fraction: f64,
    /// Entropy of an action, in nats.
    pub entropy: f64,
    /// Share of the variance of the critic's targets that it explained before the update; `None`
    /// where the targets do not vary.
    pub explained_variance: Option<f64>,
}

/// Result of [`train`].
#[derive(Clone, Debug, PartialEq)]
pub struct Trained {
    /// The policy, with the normaliser of its observations.
    pub policy: Policy,
    /// One point per update.
    pub curve: Vec<PpoProgress>,
    /// Returns without action noise, after training; `None` where the settings ask for no episodes.
    pub evaluation: Option<Evaluation>,
}

/// Trains a policy on `environment`.
///
/// `on_progress` receives every point of the curve. [`ControlFlow::Break`] ends the training there;
/// the policy so far is then evaluated and returned. On the CPU, equal seeds (and equal
/// environments) give equal results: libtorch is set to one thread for the whole process.
///
/// # Errors
/// [`Error::Config`] for settings out of their domain, [`Error::Missing`] for a device that does
/// not exist, those of the environment, and [`Error::Failed`] where an observation, a reward or the
/// policy is no longer finite.
pub fn train(
    environment: &mut dyn BatchEnvironment,
    config: &PpoConfig,
    seed: u64,
    on_progress: &mut dyn FnMut(&PpoProgress) -> ControlFlow<()>,
) -> Result<Trained> {
    let learnt = learn(environment, config, seed, on_progress)?;
    let policy = learnt.networks.policy(&learnt.normaliser);
    let evaluation = match config.evaluation_episodes {
        0 => None,
        episodes => Some(evaluate(environment, &policy, episodes)?),
    };
    Ok(Trained {
        policy,
        curve: learnt.curve,
        evaluation,
    })
}

/// Networks and learning curve of a training, before they become a [`Trained`].
pub(crate) struct Learnt {
    pub networks: ActorCritic,
    pub normaliser: Normaliser,
    pub curve: Vec<PpoProgress>,
}

/// The outer loop: rollout, update, report.
pub(crate) fn learn(
    environment: &mut dyn BatchEnvironment,
    config: &PpoConfig,
    seed: u64,
    on_progress: &mut dyn FnMut(&PpoProgress) -> ControlFlow<()>,
) -> Result<Learnt> {
    config.validate("explorer")?;
    let device = device(config)?;
    tch::set_num_threads(1);
    let [mut weights, actions, mut order] = streams(seed);
    let (observations, outputs) = (environment.observation_len(), environment.action_len());
    let normalise = config.normalise_observation;
    let mut collector = Collector::new(environment, normalise, config.reward_scale, actions)?;
    let networks = ActorCritic::new(observations, outputs, config, device, &mut weights);
    let mut optimiser = Adam::default()
        .eps(1e-5)
        .build(&networks.store, config.learning_rate)
        .map_err(|e| Error::Failed(format!("libtorch: {e}")))?;
    let steps = config.n_steps.div_ceil(collector.batch_size());
    let mut curve = Vec::new();
    while collector.env_steps < config.total_steps {
        let mut learning_rate = config.learning_rate;
        if config.anneal_learning_rate {
            learning_rate *= 1.0 - collector.env_steps as f64 / config.total_steps as f64;
            optimiser.set_lr(learning_rate);
        }
        let rollout = collector.collect(&networks, steps)?;
        let samples = Samples::new(&rollout, &networks, collector.batch_size(), config);
        let (shift, losses) = update(&mut optimiser, &networks, &samples, config, &mut order);
        let progress = PpoProgress {
            policy_loss: losses.policy,
            value_loss: losses.value,
            learning_rate,
            ..progress(&collector, &rollout, &samples, &networks, shift, config)
        };
        if !(progress.approx_kl.is_finite() && progress.entropy.is_finite()) {
            return Err(Error::Failed(format!(
                "PPO diverged after {} environment steps: lower ppo.learning_rate or ppo.reward_scale",
                collector.env_steps
            )));
        }
        let flow = on_progress(&progress);
        curve.push(progress);
        if flow.is_break() {
            break;
        }
    }
    let normaliser = collector.normaliser;
    Ok(Learnt {
        networks,
        normaliser,
        curve,
    })
}

/// Independent generators from one seed: weights, action noise, order of samples.
fn streams(seed: u64) -> [ChaCha8Rng; 3] {
    [0, 1, 2].map(|stream| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        rng
    })
}

/// Samples of one rollout, as an update uses them, one row per sample.
struct Samples {
    observation: Tensor,
    action: Tensor,
    old_log_prob: Tensor,
    advantage: Tensor,
    /// Target of the critic: advantage plus its old value.
    target: Tensor,
    explained_variance: Option<f64>,
}

impl Samples {
    /// Computes values, advantages and old log-densities of a rollout, each in one pass.
    fn new(rollout: &Rollout, networks: &ActorCritic, n: usize, config: &PpoConfig) -> Self {
        tch::no_grad(|| {
            let observation = networks.observations(&rollout.observation);
            let action = networks.actions(&rollout.action);
            let reached = networks.observations(&rollout.next_observation);
            let value: Vec<f64> = to_vec(&networks.value(&observation));
            let outcome = Outcome {
                reward: &rollout.reward,
                value: &value,
                next_value: &to_vec::<f64>(&networks.value(&reached)),
                terminated: &rollout.terminated,
                truncated: &rollout.truncated,
            };
            let advantage = advantages(outcome, n, config.gamma, config.lambda);
            let target: Vec<f64> = advantage.iter().zip(&value).map(|(a, v)| a + v).collect();
            let column = |values: &[f64]| {
                let single: Vec<f32> = values.iter().map(|&v| v as f32).collect();
                networks.tensor(&single, 1).squeeze_dim(1)
            };
            let (error, spread) = (mean_and_std(&advantage).1, mean_and_std(&target).1);
            Self {
                old_log_prob: networks.log_prob(&observation, &action),
                advantage: column(&advantage),
                target: column(&target),
                observation,
                action,
                explained_variance: (spread > 0.0).then(|| 1.0 - (error / spread).powi(2)),
            }
        })
    }

    fn len(&self) -> i64 {
        self.advantage.size()[0]
    }

    /// The same samples with `f` applied to each column.
    fn map(&self, f: impl Fn(&Tensor) -> Tensor) -> Self {
        Self {
            observation: f(&self.observation),
            action: f(&self.action),
            old_log_prob: f(&self.old_log_prob),
            advantage: f(&self.advantage),
            target: f(&self.target),
            explained_variance: self.explained_variance,
        }
    }
}

/// Mean losses of an update.
#[derive(Clone, Copy, Debug, Default)]
struct Losses {
    policy: f64,
    value: f64,
}

/// Runs the epochs of minibatches over the samples; returns the shift of the policy and the losses.
fn update(
    optimiser: &mut Optimizer,
    networks: &ActorCritic,
    samples: &Samples,
    config: &PpoConfig,
    rng: &mut ChaCha8Rng,
) -> (Shift, Losses) {
    let len = samples.len();
    let moved = || {
        tch::no_grad(|| {
            let log_prob = networks.log_prob(&samples.observation, &samples.action);
            shift(&log_prob, &samples.old_log_prob, config.clip)
        })
    };
    let mut order: Vec<i64> = (0..len).collect();
    let (mut sum, mut minibatches) = (Losses::default(), 0.0_f64);
    let mean = |sum: Losses, n: f64| Losses {
        policy: sum.policy / n,
        value: sum.value / n,
    };
    for _ in 0..config.epochs {
        order.shuffle(rng);
        let index = Tensor::from_slice(&order).to_device(networks.store.device());
        let shuffled = samples.map(|column| column.index_select(0, &index));
        for start in (0..len).step_by(config.minibatch) {
            let rows = (len - start).min(config.minibatch as i64);
            let part = shuffled.map(|column| column.narrow(0, start, rows));
            let (loss, parts) = loss(networks, &part, config);
            optimiser.backward_step_clip_norm(&loss, config.max_gradient_norm);
            sum.policy += parts.policy;
            sum.value += parts.value;
            minibatches += 1.0;
        }
        if let Some(target_kl) = config.target_kl {
            let shift = moved();
            if shift.approx_kl > 1.5 * target_kl {
                return (shift, mean(sum, minibatches));
            }
        }
    }
    (moved(), mean(sum, minibatches))
}

/// Equation 9 of the paper with its sign reversed, and its two losses.
fn loss(networks: &ActorCritic, part: &Samples, config: &PpoConfig) -> (Tensor, Losses) {
    let log_prob = networks.log_prob(&part.observation, &part.action);
    let advantage = if config.normalise_advantage && part.len() > 1 {
        let centered: Tensor = &part.advantage - part.advantage.mean(None::<Kind>);
        centered / (part.advantage.std(true) + 1e-8)
    } else {
        part.advantage.shallow_clone()
    };
    let policy_loss =
        clipped_surrogate_loss(&log_prob, &part.old_log_prob, &advantage, config.clip);
    let value_loss = (networks.value(&part.observation) - &part.target)
        .square()
        .mean(None::<Kind>);
    let losses = Losses {
        policy: policy_loss.double_value(&[]),
        value: value_loss.double_value(&[]),
    };
    let mut loss = policy_loss + config.value_coefficient * value_loss;
    if config.entropy_coefficient > 0.0 {
        loss -= config.entropy_coefficient * networks.entropy();
    }
    (loss, losses)
}

/// The learning-curve point after an update.
fn progress(
    collector: &Collector<'_>,
    rollout: &Rollout,
    samples: &Samples,
    networks: &ActorCritic,
    shift: Shift,
    config: &PpoConfig,
) -> PpoProgress {
    let returns = &rollout.episode_returns;
    let moments = (!returns.is_empty()).then(|| mean_and_std(returns));
    PpoProgress {
        env_steps: collector.env_steps,
        total_steps: config.total_steps,
        mean_return: moments.map(|(mean, _)| mean),
        return_std: moments.map(|(_, std)| std),
        action_std: mean_and_std(&networks.action_std()).0,
        policy_loss: f64::NAN,
        value_loss: f64::NAN,
        learning_rate: f64::NAN,
        approx_kl: shift.approx_kl,
        clip_fraction: shift.clip_fraction,
        entropy: tch::no_grad(|| networks.entropy().double_value(&[])),
        explained_variance: samples.explained_variance,
    }
}
