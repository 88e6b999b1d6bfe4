//! Settings of PPO, with the defaults of Stable-Baselines3.
//!
//! The ASID paper publishes no hyper-parameters; these are the neutral choice (Raffin et al. 2021,
//! "Stable-Baselines3", JMLR 22(268); class `PPO`).

use asid_core::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of the learner.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PpoConfig {
    /// Environment steps to train for, over the whole batch. Training ends with the update that
    /// reaches this number.
    pub total_steps: usize,
    /// Environment steps between two updates, over the whole batch; rounded up
    /// to whole steps of the batch.
    pub n_steps: usize,
    /// Samples per minibatch.
    pub minibatch: usize,
    /// Passes over the samples of one rollout.
    pub epochs: usize,
    /// Step size of Adam.
    pub learning_rate: f64,
    /// Lowers the step size linearly to zero over `total_steps`.
    pub anneal_learning_rate: bool,
    /// Discount of rewards, in `[0, 1]`; 1 where the sum of rewards itself matters.
    pub gamma: f64,
    /// Lambda of generalised advantage estimation, in `[0, 1]`.
    pub lambda: f64,
    /// Epsilon of the clipped surrogate objective.
    pub clip: f64,
    /// Weight of the value loss (mean squared error).
    pub value_coefficient: f64,
    /// Weight of the entropy bonus.
    pub entropy_coefficient: f64,
    /// Largest norm of a gradient, over all parameters together.
    pub max_gradient_norm: f64,
    /// Scales the advantages of a minibatch to mean 0 and standard deviation 1.
    pub normalise_advantage: bool,
    /// Scales observations by their running mean and standard deviation.
    pub normalise_observation: bool,
    /// Constant factor on rewards. Returns are reported without it. There is no running scale, so
    /// that a sum of rewards keeps its meaning.
    pub reward_scale: f64,
    /// Ends an update once the policy has moved by 1.5 times this KL divergence.
    pub target_kl: Option<f64>,
    /// Units of the hidden layers (tanh) of the actor and of the critic.
    pub hidden: Vec<usize>,
    /// Logarithm of the initial standard deviation of actions.
    pub initial_log_std: f64,
    /// Episodes of the deterministic evaluation at the end; 0 for none.
    pub evaluation_episodes: usize,
    /// `cpu`, `cuda` or `cuda:<index>`. Only `cpu` guarantees equal results for equal seeds.
    pub device: String,
}

impl Default for PpoConfig {
    fn default() -> Self {
        Self {
            total_steps: 200_000,
            n_steps: 2048,
            minibatch: 64,
            epochs: 10,
            learning_rate: 3e-4,
            anneal_learning_rate: false,
            gamma: 0.99,
            lambda: 0.95,
            clip: 0.2,
            value_coefficient: 0.5,
            entropy_coefficient: 0.0,
            max_gradient_norm: 0.5,
            normalise_advantage: true,
            normalise_observation: true,
            reward_scale: 1.0,
            target_kl: None,
            hidden: vec![64, 64],
            initial_log_std: 0.0,
            evaluation_episodes: 64,
            device: "cpu".to_owned(),
        }
    }
}

impl PpoConfig {
    /// Checks every value; `section` is the configuration section of these settings, such as
    /// `explorer`.
    ///
    /// # Errors
    /// [`Error::Config`] names the first key that is out of its domain.
    pub fn validate(&self, section: &str) -> Result<()> {
        self.check().map_err(|(key, message)| Error::Config {
            key: format!("{section}.ppo.{key}"),
            message,
        })
    }

    /// The first key that is out of its domain, and what is wrong with it.
    fn check(&self) -> std::result::Result<(), (&'static str, String)> {
        let positive = [
            ("learning_rate", self.learning_rate),
            ("clip", self.clip),
            ("max_gradient_norm", self.max_gradient_norm),
            ("reward_scale", self.reward_scale),
            ("target_kl", self.target_kl.unwrap_or(1.0)),
        ];
        for (key, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err((key, format!("{value} should be above 0")));
            }
        }
        for (key, value) in [("gamma", self.gamma), ("lambda", self.lambda)] {
            if !(0.0..=1.0).contains(&value) {
                return Err((key, format!("{value} should be between 0 and 1")));
            }
        }
        let not_negative = [
            ("value_coefficient", self.value_coefficient),
            ("entropy_coefficient", self.entropy_coefficient),
        ];
        for (key, value) in not_negative {
            if !(value >= 0.0 && value.is_finite()) {
                return Err((key, format!("{value} should be 0 or above")));
            }
        }
        let counts = [
            ("total_steps", self.total_steps),
            ("n_steps", self.n_steps),
            ("epochs", self.epochs),
            ("hidden", self.hidden.iter().copied().min().unwrap_or(1)),
        ];
        for (key, value) in counts {
            if value == 0 {
                return Err((key, "0 should be at least 1".to_owned()));
            }
        }
        if self.minibatch < 2 {
            let message = format!("{} should be at least 2", self.minibatch);
            return Err(("minibatch", message));
        }
        if !(-20.0..=5.0).contains(&self.initial_log_std) {
            let message = format!("{} should be between -20 and 5", self.initial_log_std);
            return Err(("initial_log_std", message));
        }
        let index = self.device.strip_prefix("cuda:").map(str::parse::<usize>);
        if self.device != "cpu" && self.device != "cuda" && !matches!(index, Some(Ok(_))) {
            let message = format!("`{}` should be cpu, cuda or cuda:<index>", self.device);
            return Err(("device", message));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_partial_settings_keep_the_rest() {
        PpoConfig::default().validate("solver").unwrap();
        let config: PpoConfig = serde_json::from_str(r#"{"gamma":1.0}"#).unwrap();
        assert_eq!(config.gamma, 1.0);
        assert_eq!(config.minibatch, PpoConfig::default().minibatch);
        assert!(serde_json::from_str::<PpoConfig>(r#"{"gama":1.0}"#).is_err());
    }

    #[test]
    fn a_value_out_of_its_domain_is_named() {
        let message = |json: &str| {
            let config: PpoConfig = serde_json::from_str(json).unwrap();
            config.validate("explorer").unwrap_err().to_string()
        };
        assert!(message(r#"{"gamma":1.5}"#).starts_with("config explorer.ppo.gamma: 1.5"));
        assert!(message(r#"{"clip":0}"#).contains("explorer.ppo.clip"));
        assert!(message(r#"{"minibatch":1}"#).contains("explorer.ppo.minibatch"));
        assert!(message(r#"{"hidden":[64,0]}"#).contains("explorer.ppo.hidden"));
        assert!(message(r#"{"device":"tpu"}"#).contains("explorer.ppo.device"));
    }
}
