//! MAX (Shyam et al. 2019, "Model-based active exploration").
//!
//! An ensemble of probabilistic networks learns the dynamics. A policy is trained inside the
//! ensemble to go where its members disagree. It uses no unknown parameters: it seeks novelty.
//!
//! Differences from the publication:
//!
//! - The policy is trained by PPO, not SAC.
//! - It is retrained after every round of episodes, not every 25 steps.
//! - Only disagreement about the tracked parts is rewarded. The end effector is read without noise,
//!   and disagreement about it would dominate.
//! - The sizes suit a small machine: 5 networks of 2 x 64 instead of 32 of 4 x 512.

use std::sync::Arc;

use asid_core::explore::Explored;
use asid_core::layout::Recording;
use asid_core::settings::require;
use asid_core::signal::unit_quaternion;
use asid_core::{Error, Problem, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::file::{ObservationEntry, Saved};
use crate::fisher_ppo::check_environments;
use crate::learning::{Cache, LearnedExplorer, learned_explorer};
use crate::play::{Observe, POLICY, Playing};
use crate::policy::Policy;
use crate::ppo_settings::PpoConfig;

/// Settings of the explorer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Max {
    /// File of a trained policy. Empty: the one that ships, else trained on the spot. `train`:
    /// train anew. `shipped`: only the one that ships.
    pub policy: String,
    /// Round whose policy is played, counted from 1; 0 for the last.
    pub play_round: usize,
    /// Episodes per round in the simulated world, as opposed to imagined ones.
    pub environments: usize,
    /// Rounds of fitting the ensemble, training a policy in it, and playing that policy.
    pub rounds: usize,
    /// Episodes of random actions before the first round (published: 256 steps).
    pub warm_up: usize,
    /// The ensemble.
    pub ensemble: EnsembleSettings,
    /// The learner of the policy; its steps are imagined, and are those of one round.
    pub ppo: PpoConfig,
    /// Simultaneous imagined episodes (published: 128 actors).
    pub imagined: usize,
    /// Policy that was trained on the spot; not a setting.
    #[serde(skip)]
    pub cache: Cache,
}

/// Settings of the ensemble.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EnsembleSettings {
    /// Number of networks (published: 32).
    pub models: usize,
    /// Units of the hidden layers, with swish activation (published: 512, 512, 512, 512).
    pub hidden: Vec<usize>,
    /// Passes over all transitions after each round (published: 50).
    pub epochs: usize,
    /// Transitions per step of Adam (published: 256).
    pub minibatch: usize,
    /// Step size of Adam (published: 1e-3).
    pub learning_rate: f64,
}

impl Default for EnsembleSettings {
    fn default() -> Self {
        Self {
            models: 5,
            hidden: vec![64, 64],
            epochs: 20,
            minibatch: 256,
            learning_rate: 1e-3,
        }
    }
}

impl Default for Max {
    fn default() -> Self {
        Self {
            policy: String::new(),
            play_round: 0,
            environments: 128,
            rounds: 12,
            warm_up: 256,
            ensemble: EnsembleSettings::default(),
            ppo: PpoConfig {
                total_steps: 40_000,
                n_steps: 2560,
                minibatch: 256,
                epochs: 5,
                learning_rate: 1e-3,
                anneal_learning_rate: true,
                initial_log_std: -0.5,
                evaluation_episodes: 0,
                ..PpoConfig::default()
            },
            imagined: 128,
            cache: Cache::default(),
        }
    }
}

learned_explorer!(
    Max,
    "model-based active exploration: goes where learned models disagree (Shyam et al. 2019)"
);

/// Name of a round's policy in a file; rounds are counted from 1.
#[must_use]
pub fn round_name(round: usize) -> String {
    format!("round.{round}")
}

impl LearnedExplorer for Max {
    const NAME: &'static str = "max";

    fn policy(&self) -> &str {
        &self.policy
    }

    fn set_policy(&mut self, policy: &str) {
        policy.clone_into(&mut self.policy);
        // The round to play does not affect the training.
        self.play_round = 0;
    }

    fn check(&self) -> Result<()> {
        check_environments(self.environments)?;
        self.ppo.validate("explorer")?;
        let e = &self.ensemble;
        let rules = [
            ("rounds", self.rounds > 0, "at least 1"),
            ("warm_up", self.warm_up > 0, "at least 1"),
            ("imagined", self.imagined > 0, "at least 1"),
            (
                "play_round",
                self.play_round <= self.rounds,
                "at most `rounds`",
            ),
            ("ensemble.models", e.models > 1, "at least 2"),
            (
                "ensemble.hidden",
                !e.hidden.contains(&0),
                "widths of at least 1",
            ),
            ("ensemble.epochs", e.epochs > 0, "at least 1"),
            ("ensemble.minibatch", e.minibatch > 1, "at least 2"),
            (
                "ensemble.learning_rate",
                e.learning_rate > 0.0 && e.learning_rate.is_finite(),
                "above 0",
            ),
        ];
        require("explorer", &rules)
    }

    fn observation(&self, problem: &Problem<'_>) -> Result<Vec<ObservationEntry>> {
        Ok(Motion::new(problem)?.entries())
    }

    fn cache(&self) -> &Cache {
        &self.cache
    }

    fn play<'a>(&'a self, problem: &'a Problem<'a>, mut saved: Arc<Saved>) -> Result<Explored<'a>> {
        if self.play_round > 0 {
            saved = Arc::new(of_round(&saved, self.play_round)?);
        }
        let observe = Box::new(Motion::new(problem)?);
        Playing::explored(saved, observe, "disagreement of learned models".into())
    }
}

/// The file with the policy of an earlier round as its policy.
fn of_round(saved: &Saved, round: usize) -> Result<Saved> {
    let policy =
        Policy::from_tensors(&round_name(round), &saved.tensors).map_err(|why| Error::Config {
            key: "explorer.play_round".into(),
            message: format!("round {round}: the file {why}"),
        })?;
    let mut saved = saved.clone();
    policy.to_tensors(POLICY, &mut saved.tensors);
    Ok(saved)
}

/// State of the motion, on which the models are learned.
///
/// It consists of:
///
/// - positions and orientations (two columns of the rotation matrix) of the tracked parts, and the
///   position of the end effector,
/// - their differences from one control step ago, since a reading has no velocity,
/// - the end effector's position relative to each tracked position, in world directions,
/// - the elapsed share of the episode.
pub struct Motion {
    /// First entry in a reading's row and number of entries; four entries are an orientation.
    channels: Vec<(usize, usize)>,
    names: Vec<String>,
    /// Number of channels that are tracked parts; they come first.
    tracked: usize,
    horizon: usize,
    before: Vec<f64>,
}

impl Motion {
    /// Motion state of a problem's exploration episodes.
    ///
    /// # Errors
    /// When the scene lacks a channel of the protocol.
    pub fn new(problem: &Problem<'_>) -> Result<Self> {
        let protocol = problem.task.exploration();
        let names = protocol.channels();
        let recording: Recording = problem.model.layout().recording(&names)?;
        let tracked = protocol.signals.len();
        let effector = (tracked..names.len()).find(|&i| recording.range(i).len() == 3);
        let kept: Vec<usize> = (0..tracked).chain(effector).collect();
        let channel = |&i: &usize| {
            let range = recording.range(i);
            (range.start, range.len())
        };
        Ok(Self {
            channels: kept.iter().map(channel).collect(),
            names: kept.iter().map(|&i| names[i].clone()).collect(),
            tracked,
            horizon: protocol.horizon,
            before: Vec::new(),
        })
    }

    /// Number of entries of positions and orientations, without the differences.
    #[must_use]
    pub fn places(&self) -> usize {
        width(&self.channels)
    }

    /// Number of these entries that belong to tracked parts; they come first.
    #[must_use]
    pub fn tracked(&self) -> usize {
        width(&self.channels[..self.tracked])
    }

    /// For each tracked position and the end effector: the first entries of both.
    #[must_use]
    pub fn relations(&self) -> Vec<[usize; 2]> {
        if self.channels.len() == self.tracked {
            return Vec::new();
        }
        let objects = (0..self.tracked).filter(|&i| self.channels[i].1 == 3);
        objects
            .map(|i| [width(&self.channels[..i]), self.tracked()])
            .collect()
    }

    /// The entries of an observation, in order.
    #[must_use]
    pub fn entries(&self) -> Vec<ObservationEntry> {
        let places = self.places();
        let text = self.names.join(", ");
        let entry = |name: String, len| ObservationEntry { name, len };
        vec![
            entry(text.clone(), places),
            entry(format!("what a control step changed of {text}"), places),
            entry(
                "end effector as seen from tracked places".into(),
                3 * self.relations().len(),
            ),
            entry("share of the episode".into(), 1),
        ]
    }
}

/// Number of state entries for these channels, without the differences.
fn width(channels: &[(usize, usize)]) -> usize {
    let len = |&(_, len): &(usize, usize)| if len == 4 { 6 } else { len };
    channels.iter().map(len).sum()
}

impl Observe for Motion {
    fn observe(&mut self, step: usize, reading: &[f64], observation: &mut [f64]) -> Result<()> {
        let places = self.places();
        let (now, rest) = observation.split_at_mut(places);
        let mut at = 0;
        for &(start, len) in &self.channels {
            let row = &reading[start..start + len];
            if len == 4 {
                let out = &mut now[at..at + 6];
                if row.iter().all(|x| x.is_finite()) {
                    let rotation = unit_quaternion(row).to_rotation_matrix();
                    out.copy_from_slice(&rotation.matrix().as_slice()[..6]);
                } else {
                    out.fill(f64::NAN);
                }
                at += 6;
            } else {
                now[at..at + len].copy_from_slice(row);
                at += len;
            }
        }
        if step == 0 || self.before.len() != places {
            self.before = vec![f64::NAN; places];
        }
        // Missing entries keep their previous value; those that were never read are 0. The first
        // reading is no change.
        let entries = now.iter_mut().zip(rest.iter_mut()).zip(&mut self.before);
        for ((x, change), before) in entries {
            if !x.is_finite() {
                *x = *before;
            }
            *change = if before.is_finite() {
                *x - *before
            } else {
                0.0
            };
            *before = *x;
            if !x.is_finite() {
                *x = 0.0;
            }
        }
        let mut at = places;
        for [object, hand] in self.relations() {
            for i in 0..3 {
                rest[at + i] = now[hand + i] - now[object + i];
            }
            at += 3;
        }
        rest[at] = step as f64 / self.horizon as f64;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::with_problem;

    #[test]
    fn a_state_has_places_and_their_changes() {
        with_problem("rod-balancing", |problem| {
            let mut motion = Motion::new(problem).unwrap();
            // Position 3, rotation 6, effector 3.
            assert_eq!(motion.places(), 12);
            assert_eq!(motion.tracked(), 9);
            let names = problem.task.exploration().channels();
            let width = problem.model.layout().recording(&names).unwrap().width();
            let mut reading = vec![0.0; width];
            reading[..7].copy_from_slice(&[0.5, 0.1, 0.0, 1.0, 0.0, 0.0, 0.0]);
            let mut out = vec![f64::NAN; 28];
            motion.observe(0, &reading, &mut out).unwrap();
            assert_eq!(out[12..24], [0.0; 12]);
            assert_eq!(out[24..], [-0.5, -0.1, 0.0, 0.0]);
            reading[0] = 0.6;
            reading[1] = f64::NAN;
            motion.observe(1, &reading, &mut out).unwrap();
            assert_eq!(out[..2], [0.6, 0.1]);
            assert!((out[12] - 0.1).abs() < 1e-12 && out[13] == 0.0);
            assert!((out[27] - 1.0 / 20.0).abs() < 1e-12);
        });
    }

    /// Symptom: a tracker that lost the rod showed it as turned to the axes of the world, and a
    /// position that was first read late as a jump from the origin. Cause: a missing orientation
    /// was replaced by none, and a missing first position was kept as 0.
    #[test]
    fn what_is_not_read_does_not_move() {
        with_problem("rod-balancing", |problem| {
            let mut motion = Motion::new(problem).unwrap();
            let names = problem.task.exploration().channels();
            let width = problem.model.layout().recording(&names).unwrap().width();
            let mut reading = vec![0.0; width];
            // Half a radian about the vertical; the first x of the position is missing.
            let (sin, cos) = 0.25_f64.sin_cos();
            reading[..7].copy_from_slice(&[f64::NAN, 0.1, 0.0, cos, 0.0, 0.0, sin]);
            let mut out = vec![f64::NAN; 28];
            motion.observe(0, &reading, &mut out).unwrap();
            assert_eq!(out[..2], [0.0, 0.1]);
            let turned = out[3..9].to_vec();
            assert!((turned[1] - 0.5_f64.sin()).abs() < 1e-12);
            reading[0] = 0.5;
            reading[3..7].fill(f64::NAN);
            motion.observe(1, &reading, &mut out).unwrap();
            assert_eq!(out[..2], [0.5, 0.1]);
            assert_eq!(out[3..9], turned);
            assert_eq!(out[12..24], [0.0; 12]);
        });
    }
}
