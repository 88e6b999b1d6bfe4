//! Collects samples: the policy acts in a batch of environments.

use asid_core::{BatchEnvironment, Error, Result, Transition};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::actor_critic::{ActorCritic, to_vec};
use asid_learned::Normaliser;

/// Samples of one rollout, each array `steps x n` (times the entries of a row).
#[derive(Default)]
pub struct Rollout {
    /// Normalised observations that were acted on.
    pub observation: Vec<f32>,
    /// Normalised observations that were reached, before any reset.
    pub next_observation: Vec<f32>,
    /// Sampled actions before clipping; the log-densities refer to these.
    pub action: Vec<f32>,
    /// Scaled rewards.
    pub reward: Vec<f64>,
    pub terminated: Vec<bool>,
    pub truncated: Vec<bool>,
    /// Undiscounted, unscaled returns of the episodes that ended here.
    pub episode_returns: Vec<f64>,
}

/// Steps the environments and keeps their state between rollouts.
pub struct Collector<'a> {
    environment: &'a mut dyn BatchEnvironment,
    transition: Transition,
    /// Sum of the rewards of each running episode, `n`.
    running_return: Vec<f64>,
    rng: ChaCha8Rng,
    pub normaliser: Normaliser,
    normalise: bool,
    reward_scale: f64,
    /// Environment steps so far, over the whole batch.
    pub env_steps: usize,
}

impl<'a> Collector<'a> {
    /// Resets the environments.
    pub fn new(
        environment: &'a mut dyn BatchEnvironment,
        normalise: bool,
        reward_scale: f64,
        rng: ChaCha8Rng,
    ) -> Result<Self> {
        let (n, len) = (environment.batch_size(), environment.observation_len());
        if n == 0 || len == 0 || environment.action_len() == 0 {
            let message = "PPO needs at least one environment, observation entry and action entry";
            return Err(Error::Shape(message.to_owned()));
        }
        let mut transition = Transition::new(n, len);
        environment.reset(&mut transition.observation)?;
        let mut normaliser = Normaliser::identity(len);
        if normalise {
            normaliser.update(&transition.observation);
        }
        Ok(Self {
            environment,
            transition,
            running_return: vec![0.0; n],
            rng,
            normaliser,
            normalise,
            reward_scale,
            env_steps: 0,
        })
    }

    /// Number of environments in the batch.
    pub fn batch_size(&self) -> usize {
        self.environment.batch_size()
    }

    /// Runs the policy for `steps` steps of the whole batch.
    pub fn collect(&mut self, networks: &ActorCritic, steps: usize) -> Result<Rollout> {
        let n = self.batch_size();
        let std = networks.action_std();
        let mut rollout = Rollout::default();
        let mut normalised = vec![0.0; self.transition.observation.len()];
        for _ in 0..steps {
            // Sample an action: mean of the actor plus noise from our own generator.
            let observation = &self.transition.observation;
            self.normaliser.normalise(observation, &mut normalised);
            let input = networks.observations(&normalised);
            let mut action: Vec<f64> = to_vec(&tch::no_grad(|| networks.mean(&input)));
            for (a, std) in action.iter_mut().zip(std.iter().cycle()) {
                let noise: f64 = StandardNormal.sample(&mut self.rng);
                *a += std * noise;
            }
            rollout.observation.extend_from_slice(&normalised);
            rollout.action.extend(action.iter().map(|&a| a as f32));

            // Clip the action to the environment's range, and step.
            action.iter_mut().for_each(|a| *a = a.clamp(-1.0, 1.0));
            self.environment.step(&action, &mut self.transition)?;
            self.env_steps += n;
            self.check()?;

            // Keep the samples.
            if self.normalise {
                self.normaliser.update(&self.transition.observation);
            }
            let reached = &self.transition.final_observation;
            self.normaliser.normalise(reached, &mut normalised);
            rollout.next_observation.extend_from_slice(&normalised);
            let scaled = self.transition.reward.iter().map(|r| r * self.reward_scale);
            rollout.reward.extend(scaled);
            rollout.terminated.extend(&self.transition.terminated);
            rollout.truncated.extend(&self.transition.truncated);
            for i in 0..n {
                self.running_return[i] += self.transition.reward[i];
                if self.transition.terminated[i] || self.transition.truncated[i] {
                    let ended = std::mem::take(&mut self.running_return[i]);
                    rollout.episode_returns.push(ended);
                }
            }
        }
        Ok(rollout)
    }

    /// Checks that the environment kept the shapes and returned finite numbers.
    fn check(&self) -> Result<()> {
        let (n, len) = (self.batch_size(), self.environment.observation_len());
        let t = &self.transition;
        let rows = [t.reward.len(), t.terminated.len(), t.truncated.len()];
        let entries = [t.observation.len(), t.final_observation.len()];
        if rows.iter().any(|&r| r != n) || entries.iter().any(|&e| e != n * len) {
            let message = format!("environment changed the size of a transition of {n} rows");
            return Err(Error::Shape(message));
        }
        for i in 0..n {
            let row = i * len..(i + 1) * len;
            // The state that a terminated episode reached is never evaluated, so it may hold
            // anything.
            let reached = if t.terminated[i] {
                &[]
            } else {
                &t.final_observation[row.clone()]
            };
            let mut numbers = t.observation[row].iter().chain(reached);
            if !t.reward[i].is_finite() || numbers.any(|x| !x.is_finite()) {
                return Err(Error::Failed(format!(
                    "environment {i} of {n} gave an observation or reward that is not finite at step {}",
                    self.env_steps / n
                )));
            }
        }
        Ok(())
    }
}
