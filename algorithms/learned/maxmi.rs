//! MaxMI (Kumar et al. 2019, "Estimating mass distribution of articulated objects using
//! non-prehensile manipulation").
//!
//! A predictor estimates the unknowns from the history, and a policy is rewarded for lowering the
//! predictor's error. Both are trained in turns.
//!
//! The predictor is a learned posterior `q(z | history)` ([`crate::inference`]). The reward of a
//! control step is its gain in the log-likelihood of the truth,
//!
//! ```text
//! r_h = log q(z | history to h) - log q(z | history to h - 1),
//! ```
//!
//! so the return is the lower bound of the mutual information of unknown and episode (Barber and
//! Agakov 2003), up to the constant of the first reading. The policy observes its readings and the
//! predictor's belief. Each episode is simulated once, without the copies that Fisher information
//! needs.

use std::sync::Arc;

use asid_algorithms::explore::Observer;
use asid_core::explore::Explored;
use asid_core::settings::require;
use asid_core::{Error, Problem, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::belief::Belief;
use crate::file::{ObservationEntry, Saved};
use crate::fisher_ppo::{FisherPpo, check_environments, entries};
use crate::history::History;
use crate::inference::Inference;
use crate::learning::{Cache, LearnedExplorer, learned_explorer};
use crate::play::{Observe, Playing};
use crate::ppo_settings::PpoConfig;

/// Name of the predictor's tensors in a file.
pub const PREDICTOR: &str = "predictor";

/// Settings of the predictor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PredictorSettings {
    /// Units of the hidden layers (tanh).
    pub hidden: Vec<usize>,
    /// Step size of Adam.
    pub learning_rate: f64,
    /// Decoupled weight decay per step, relative to the step size (Loshchilov and Hutter 2019).
    /// Over the roughly 6000 steps of a training, 0.3 halves weights that no episode supports about
    /// twice.
    pub weight_decay: f64,
    /// Episodes per step of Adam, each cut at a random mark.
    pub minibatch: usize,
    /// Steps of Adam after each batch of episodes, starting from the present weights; steps that do
    /// not help on held-out episodes are undone.
    pub steps: usize,
    /// Maximum number of steps of Adam of a training from scratch. One takes place at the first
    /// batch and whenever the number of episodes has doubled, since the policy then moves objects
    /// further than the input scales allow for. It stops early once held-out episodes gain nothing.
    pub begin_steps: usize,
    /// Number of latest episodes that are kept to learn from. What an episode reveals does not
    /// depend on who acted in it, so all of a training are kept: 100 MB at 40 numbers per mark.
    pub memory: usize,
    /// Share of the episodes that are held out from the gradient steps. They stop the training and
    /// calibrate the predictor's claims, which reward the policy.
    pub held_out: f64,
    /// Number of latest held-out episodes that do so. Late ones resemble the coming episodes; 512
    /// determine the mean information to about 0.03 nats.
    pub judges: usize,
    /// Number of first episodes whose control steps are rewarded if a tracked part was seen to
    /// move. An untrained predictor rewards nothing and random actions seldom touch an object, so
    /// neither policy nor predictor would have anything to learn from.
    pub warm_up: usize,
}

impl Default for PredictorSettings {
    fn default() -> Self {
        Self {
            hidden: vec![128, 128],
            learning_rate: 1e-3,
            weight_decay: 0.3,
            minibatch: 256,
            steps: 40,
            begin_steps: 3000,
            memory: 16_384,
            held_out: 0.2,
            judges: 512,
            warm_up: 4096,
        }
    }
}

/// Settings of the explorer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MaxMi {
    /// File of a trained policy. Empty: the one that ships, else trained on the spot. `train`:
    /// train anew. `shipped`: only the one that ships.
    pub policy: String,
    /// Episodes that are simulated at once.
    pub environments: usize,
    /// The learner of the policy, with the settings of `fisher-ppo`, so that the two differ in the
    /// reward alone.
    pub ppo: PpoConfig,
    /// The predictor.
    pub predictor: PredictorSettings,
    /// Policy that was trained on the spot; not a setting.
    #[serde(skip)]
    pub cache: Cache,
}

impl Default for MaxMi {
    fn default() -> Self {
        Self {
            policy: String::new(),
            environments: 64,
            ppo: FisherPpo::default().ppo,
            predictor: PredictorSettings::default(),
            cache: Cache::default(),
        }
    }
}

learned_explorer!(
    MaxMi,
    "mutual information, a policy paid for what a learned predictor gets right (Kumar et al. 2019)"
);

impl LearnedExplorer for MaxMi {
    const NAME: &'static str = "maxmi";

    fn policy(&self) -> &str {
        &self.policy
    }

    fn set_policy(&mut self, policy: &str) {
        policy.clone_into(&mut self.policy);
    }

    fn check(&self) -> Result<()> {
        check_environments(self.environments)?;
        self.ppo.validate("explorer")?;
        let p = &self.predictor;
        let rules = [
            ("hidden", !p.hidden.contains(&0), "widths of at least 1"),
            (
                "learning_rate",
                p.learning_rate > 0.0 && p.learning_rate.is_finite(),
                "above 0",
            ),
            ("minibatch", p.minibatch > 1, "at least 2"),
            (
                "weight_decay",
                p.weight_decay >= 0.0 && p.weight_decay.is_finite(),
                "0 or above",
            ),
            ("steps", p.steps > 0, "at least 1"),
            ("begin_steps", p.begin_steps > 0, "at least 1"),
            ("memory", p.memory > 1, "at least 2"),
            (
                "held_out",
                (0.01..=0.5).contains(&p.held_out),
                "0.01 to 0.5",
            ),
            ("judges", p.judges > 0, "at least 1"),
            ("warm_up", p.warm_up > 1, "at least 2"),
        ];
        require("explorer.predictor", &rules)
    }

    fn observation(&self, problem: &Problem<'_>) -> Result<Vec<ObservationEntry>> {
        let mut all = entries(&Observer::of_readings(problem)?);
        for p in problem.parameters {
            let what = if p.is_binary() {
                "log-odds"
            } else {
                "mean and log std"
            };
            all.push(ObservationEntry {
                name: format!("predicted {what} of {}, prior-scaled", p.name),
                len: 2,
            });
        }
        Ok(all)
    }

    fn cache(&self) -> &Cache {
        &self.cache
    }

    fn play<'a>(&'a self, problem: &'a Problem<'a>, saved: Arc<Saved>) -> Result<Explored<'a>> {
        let history = History::new(problem)?;
        let predictor = Inference::from_tensors(
            PREDICTOR,
            &saved.tensors,
            history.entries(),
            history.masks(),
            problem.parameters,
        )
        .map_err(|why| Error::Config {
            key: "explorer.policy".into(),
            message: format!("the file cannot be used here: {why}"),
        })?;
        let observe = Box::new(Predicting::new(problem, Arc::new(predictor))?);
        Playing::explored(
            saved,
            observe,
            "mutual information (learned predictor)".into(),
        )
    }
}

/// Observes readings together with the predictor's present belief.
pub struct Predicting {
    observer: Observer,
    history: History,
    horizon: usize,
    numbers: Vec<f64>,
    predictor: Arc<Inference>,
    beliefs: Vec<Belief>,
}

impl Predicting {
    /// Observer with a predictor for this problem.
    ///
    /// # Errors
    /// When the scene lacks a channel of the protocol.
    pub fn new(problem: &Problem<'_>, predictor: Arc<Inference>) -> Result<Self> {
        let history = History::new(problem)?;
        Ok(Self {
            observer: Observer::of_readings(problem)?,
            horizon: problem.task.exploration().horizon,
            numbers: history.blank(),
            history,
            predictor,
            beliefs: Vec::new(),
        })
    }

    /// Replaces the predictor by one that has learned more.
    pub fn set_predictor(&mut self, predictor: Arc<Inference>) {
        self.predictor = predictor;
    }

    /// Belief after the latest reading.
    #[must_use]
    pub fn beliefs(&self) -> &[Belief] {
        &self.beliefs
    }

    /// The episode so far; see [`History`].
    #[must_use]
    pub fn history(&self) -> &[f64] {
        &self.numbers
    }
}

impl Observe for Predicting {
    fn observe(&mut self, step: usize, reading: &[f64], observation: &mut [f64]) -> Result<()> {
        if step == 0 {
            self.history.forget(&mut self.numbers, 0);
        }
        self.history.write(&mut self.numbers, step, reading);
        self.beliefs = self.predictor.beliefs(&self.numbers);
        let seen = self.observer.observation_len();
        let share = step as f64 / self.horizon as f64;
        self.observer
            .observe(reading, share, &[], &mut observation[..seen]);
        let told = observation[seen..].chunks_exact_mut(2);
        for (out, belief) in told.zip(&self.beliefs) {
            match *belief {
                Belief::Gaussian { mean, std } => out.copy_from_slice(&[mean, std.ln()]),
                Belief::Binary { logit } => out.copy_from_slice(&[logit, 0.0]),
            }
        }
        Ok(())
    }
}
