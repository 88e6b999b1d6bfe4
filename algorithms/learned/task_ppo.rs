//! A policy trained for the task itself, used as an explorer: it shows what a robot that practises
//! its task learns by the way.
//!
//! The reward of a control step is the progress of the object towards the task's goal
//! ([`asid_core::Task::goal_reward`]), so the return is the total progress of the episode.

use std::sync::Arc;

use asid_algorithms::explore::Observer;
use asid_core::explore::Explored;
use asid_core::{Problem, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::file::{ObservationEntry, Saved};
use crate::fisher_ppo::{FisherPpo, check_environments, entries};
use crate::learning::{Cache, LearnedExplorer, learned_explorer};
use crate::play::{Observe, Playing};
use crate::ppo_settings::PpoConfig;

/// Settings of the explorer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TaskPpo {
    /// File of a trained policy. Empty: the one that ships, else trained on the spot. `train`:
    /// train anew. `shipped`: only the one that ships.
    pub policy: String,
    /// Episodes that are simulated at once.
    pub environments: usize,
    /// The learner, with the settings of `fisher-ppo`, so that the two differ in the reward alone.
    /// Rewards are distances of tenths of a metre, hence the scale.
    pub ppo: PpoConfig,
    /// Policy that was trained on the spot; not a setting.
    #[serde(skip)]
    pub cache: Cache,
}

impl Default for TaskPpo {
    fn default() -> Self {
        Self {
            policy: String::new(),
            environments: 64,
            ppo: PpoConfig {
                reward_scale: 10.0,
                ..FisherPpo::default().ppo
            },
            cache: Cache::default(),
        }
    }
}

learned_explorer!(
    TaskPpo,
    "a policy trained for the task, where the task has a goal for its object"
);

impl LearnedExplorer for TaskPpo {
    const NAME: &'static str = "task-ppo";

    fn policy(&self) -> &str {
        &self.policy
    }

    fn set_policy(&mut self, policy: &str) {
        policy.clone_into(&mut self.policy);
    }

    fn check(&self) -> Result<()> {
        check_environments(self.environments)?;
        self.ppo.validate("explorer")
    }

    fn observation(&self, problem: &Problem<'_>) -> Result<Vec<ObservationEntry>> {
        Ok(entries(&Observer::of_readings(problem)?))
    }

    fn cache(&self) -> &Cache {
        &self.cache
    }

    fn play<'a>(&'a self, problem: &'a Problem<'a>, saved: Arc<Saved>) -> Result<Explored<'a>> {
        let observe = Box::new(Reading::new(problem)?);
        Playing::explored(saved, observe, "the task's goal".into())
    }
}

/// Observes the readings and the clock only.
pub struct Reading {
    observer: Observer,
    horizon: usize,
}

impl Reading {
    /// Observer for a problem's exploration episodes.
    ///
    /// # Errors
    /// When the scene lacks a channel of the protocol.
    pub fn new(problem: &Problem<'_>) -> Result<Self> {
        Ok(Self {
            observer: Observer::of_readings(problem)?,
            horizon: problem.task.exploration().horizon,
        })
    }
}

impl Observe for Reading {
    fn observe(&mut self, step: usize, reading: &[f64], observation: &mut [f64]) -> Result<()> {
        let share = step as f64 / self.horizon as f64;
        self.observer.observe(reading, share, &[], observation);
        Ok(())
    }
}
