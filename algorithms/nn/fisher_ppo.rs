//! The Fisher objective with PPO: a policy that reacts to what it sees.
//!
//! It is trained once, over start poses and unknowns drawn anew for every episode
//! (domain randomisation), and then plays any episode without a search. In the real
//! world the information gathered so far, part of its observation, is that of a
//! simulation at the middle of the prior which starts where the first reading shows
//! the object and takes the same actions.

use std::ops::ControlFlow;

use asid_algorithms::explore::{FisherEnvironment, Observer};
use asid_core::explore::{CurvePoint, Explored, Explorer};
use asid_core::fisher::{FisherBatch, FisherSettings};
use asid_core::information::Objective;
use asid_core::registry;
use asid_core::{Error, Problem, Result};
use rand::Rng as _;
use serde::{Deserialize, Serialize};

use crate::config::PpoConfig;
use crate::policy::Policy;
use crate::ppo::{PpoProgress, train};

/// Settings of the explorer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FisherPpo {
    /// Episodes that are simulated at once.
    pub environments: usize,
    /// The learner. Discount 1 and a constant scale of rewards keep the return equal
    /// to the information gained.
    pub ppo: PpoConfig,
    /// What is rewarded: by default `d-optimal`, which unlike `a-optimal` still tells a
    /// good episode from a better one, with a start pose that is known, which needs fewer
    /// copies (3 instead of 9 on rod balancing).
    pub fisher: FisherSettings,
}

impl Default for FisherPpo {
    fn default() -> Self {
        Self {
            environments: 64,
            // One episode of each environment an update.
            ppo: PpoConfig {
                total_steps: 200_000,
                n_steps: 1280,
                minibatch: 128,
                learning_rate: 1e-3,
                anneal_learning_rate: true,
                gamma: 1.0,
                initial_log_std: -0.5,
                evaluation_episodes: 0,
                ..PpoConfig::default()
            },
            fisher: FisherSettings {
                objective: Objective::DOptimal,
                nuisance: false,
                ..FisherSettings::default()
            },
        }
    }
}

asid_core::register!(ExplorerEntry {
    name: "fisher-ppo",
    about: "Fisher information, a policy trained by proximal policy optimisation",
    defaults: registry::defaults::<FisherPpo>,
    make: |s| {
        let explorer: FisherPpo = registry::settings("explorer", s)?;
        explorer.check()?;
        Ok(Box::new(explorer))
    },
});

impl FisherPpo {
    fn check(&self) -> Result<()> {
        if self.environments == 0 {
            return Err(Error::Config {
                key: "explorer.environments".into(),
                message: "must be at least 1".into(),
            });
        }
        self.ppo.validate()?;
        self.fisher.check()
    }

    /// Trains a policy; its learning curve is counted in environment steps.
    ///
    /// # Errors
    /// When the engine fails or the learner diverges.
    pub fn train(&self, problem: &Problem<'_>) -> Result<(Policy, Vec<CurvePoint>)> {
        let mut environment = FisherEnvironment::new(problem, &self.fisher, self.environments)?;
        let seed = problem.streams.stream("fisher-ppo").random();
        let mut curve = Vec::new();
        let mut told = 0;
        let total = self.ppo.total_steps as u64;
        problem.progress.begin("explore: training", total);
        let trained = train(&mut environment, &self.ppo, seed, &mut |p: &PpoProgress| {
            problem.progress.advance((p.env_steps - told) as u64);
            told = p.env_steps;
            if let (Some(mean), Some(std)) = (p.mean_return, p.return_std) {
                problem
                    .progress
                    .note(&format!("return {mean:.2} ± {std:.2}"));
                curve.push(CurvePoint {
                    x: p.env_steps as f64,
                    mean,
                    std,
                });
            }
            ControlFlow::Continue(())
        });
        problem.progress.end();
        Ok((trained?.policy, curve))
    }
}

impl Explorer for FisherPpo {
    fn explore<'a>(
        &'a self,
        problem: &'a Problem<'a>,
        _start: Option<&[f64]>,
    ) -> Result<Explored<'a>> {
        let (policy, curve) = self.train(problem)?;
        Ok(Explored {
            policy: Box::new(TrainedPolicy::new(problem, &self.fisher, policy)?),
            curve,
            curve_label: "environment steps",
            objective: self.fisher.describe(),
        })
    }
}

/// A trained network in the real world.
pub struct TrainedPolicy<'a> {
    problem: &'a Problem<'a>,
    network: Policy,
    observer: Observer,
    /// The episode as it would be in the middle of the prior.
    shadow: FisherBatch<'a>,
    shadow_reading: Vec<f64>,
    observation: Vec<f64>,
}

impl<'a> TrainedPolicy<'a> {
    /// A network that was trained with these settings, or reloaded from an export.
    ///
    /// # Errors
    /// When the network is not one of this problem, or as [`FisherBatch::new`].
    pub fn new(
        problem: &'a Problem<'a>,
        settings: &FisherSettings,
        network: Policy,
    ) -> Result<Self> {
        let observer = Observer::new(problem)?;
        let shadow = FisherBatch::new(problem, settings, 1)?;
        let actions = problem.task.exploration().action.len();
        let (inputs, outputs) = (observer.observation_len(), actions);
        if network.observation_len() != inputs || network.action_len() != outputs {
            return Err(Error::Shape(format!(
                "the network takes {} entries and gives {}, the task `{}` has observations of {inputs} and actions of {outputs}",
                network.observation_len(),
                network.action_len(),
                problem.task.name(),
            )));
        }
        Ok(Self {
            shadow_reading: vec![0.0; shadow.width()],
            observation: vec![0.0; inputs],
            problem,
            network,
            observer,
            shadow,
        })
    }
}

impl asid_core::explore::Policy for TrainedPolicy<'_> {
    fn reset(&mut self) {}

    fn act(&mut self, step: usize, reading: &[f64], action: &mut [f64]) -> Result<()> {
        let protocol = self.problem.task.exploration();
        if step == 0 {
            let middle: Vec<f64> = self.problem.parameters.iter().map(|p| p.center()).collect();
            let start = self.problem.task.locate(reading);
            self.shadow
                .begin(&middle, &start, &mut self.shadow_reading)?;
        }
        let share = step as f64 / protocol.horizon as f64;
        let std = self.shadow.information()[0].expected_std();
        self.observer
            .observe(reading, share, &std, &mut self.observation);
        self.network.act(&self.observation, action)?;
        for (a, c) in action.iter_mut().zip(&protocol.action) {
            *a = c.at((*a + 1.0) / 2.0);
        }
        self.shadow
            .step(action, &mut self.shadow_reading, &mut [0.0])
    }

    /// `{"kind": "network", "observation": [{"name", "len"}], "action": [{"name", "unit",
    /// "range"}], "network": …}`. The network is what [`Policy`] reads and writes: a
    /// normaliser `(x - mean) / sqrt(variance)`, clipped at plus and minus 10, then layers
    /// `y = x W + b` (`weight` is inputs x outputs, row by row) with tanh between them.
    /// The output, clipped to -1 to 1, spans each action's range.
    fn export(&self) -> serde_json::Value {
        let observation: Vec<_> = self
            .observer
            .entries()
            .iter()
            .map(|e| serde_json::json!({"name": e.name, "len": e.len}))
            .collect();
        let action: Vec<_> = self
            .problem
            .task
            .exploration()
            .action
            .iter()
            .map(|c| serde_json::json!({"name": c.name, "unit": c.unit, "range": c.range}))
            .collect();
        serde_json::json!({
            "kind": "network",
            "observation": observation,
            "action": action,
            "network": self.network,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU64;

    // Linked for the entries that they register.
    use asid_rapier as _;
    use asid_tasks as _;

    use asid_core::explore::Policy as _;
    use asid_core::progress::Silent;
    use asid_core::registry::{BackendEntry, TaskEntry, find};
    use asid_core::{Capabilities, RealWorld as _, SimulatedWorld, Streams};

    use asid_core::registry::ExplorerEntry;

    use super::*;

    /// Runs `check` on rod balancing in the engine that needs no native library.
    fn with_problem(check: impl FnOnce(&Problem<'_>)) {
        let task = (find::<TaskEntry>("rod-balancing").unwrap().make)().unwrap();
        let backend = (find::<BackendEntry>("rapier").unwrap().make)().unwrap();
        let model = backend.load(task.scene()).unwrap();
        let parameters = task.parameters();
        let counter = AtomicU64::new(0);
        check(&Problem {
            task: &*task,
            model: &*model,
            capabilities: Capabilities::empty(),
            parameters: &parameters,
            signals: &task.exploration().signals,
            threads: 0,
            streams: Streams::new(3),
            progress: &Silent,
            physics_counter: &counter,
            env_counter: &counter,
        });
    }

    /// Two updates of two episodes.
    fn tiny() -> FisherPpo {
        let mut explorer = FisherPpo {
            environments: 2,
            ..FisherPpo::default()
        };
        explorer.ppo.n_steps = 40;
        explorer.ppo.total_steps = 80;
        explorer.ppo.minibatch = 16;
        explorer
    }

    #[test]
    fn the_same_seed_gives_the_same_policy_and_an_episode_can_be_played() {
        with_problem(|problem| {
            let explorer = tiny();
            let (network, curve) = explorer.train(problem).unwrap();
            assert_eq!(network, explorer.train(problem).unwrap().0);
            let steps: Vec<f64> = curve.iter().map(|p| p.x).collect();
            assert_eq!(steps, [40.0, 80.0]);
            assert!(curve.iter().all(|p| p.mean.is_finite() && p.std >= 0.0));

            let mut explored = explorer.explore(problem, None).unwrap();
            assert_eq!(explored.curve, curve);
            let signals = problem.signals;
            let mut world = SimulatedWorld::new(
                problem.task,
                problem.model,
                problem.parameters,
                &[0.05],
                signals,
                Streams::new(1),
            )
            .unwrap();
            let first = world.explore(&mut *explored.policy).unwrap();
            // A policy can be played again: the second episode is the first.
            let second = world.explore(&mut *explored.policy).unwrap();
            assert_eq!(first.actions, second.actions);
            assert_eq!(first.actions.len(), 20 * 2);
        });
    }

    /// The information gathered so far is an entry of the observation: with other
    /// readings equal, a policy that looks at nothing else acts by it.
    #[test]
    fn a_policy_acts_by_the_information_gathered() {
        with_problem(|problem| {
            let inputs = Observer::new(problem).unwrap().observation_len();
            let mut weight = vec![0.0; inputs * 2];
            weight[(inputs - 1) * 2] = 0.1;
            let network = Policy::linear(inputs, weight, vec![0.0; 2]);
            let settings = FisherSettings::default();
            let mut policy = TrainedPolicy::new(problem, &settings, network).unwrap();
            let reading = {
                let mut batch = FisherBatch::new(problem, &settings, 1).unwrap();
                let mut first = vec![0.0; batch.width()];
                batch.begin(&[0.0], &[0.55, 0.0, 0.5], &mut first).unwrap();
                first
            };
            let mut actions = Vec::new();
            for step in 0..20 {
                let mut action = [0.0; 2];
                let told = policy.shadow.information()[0].expected_std();
                policy.act(step, &reading, &mut action).unwrap();
                assert!(action.iter().all(|a| a.is_finite()));
                if step > 0 {
                    // Weight 0.1 on -log std; the action's range is plus and minus 0.1 m.
                    let expected = (-0.1 * told[0].ln()).clamp(-1.0, 1.0) * 0.1;
                    assert!((action[0] - expected).abs() < 1e-7, "{action:?} {told:?}");
                }
                actions.push(action);
            }
            assert!(actions[0][0].abs() < 0.02, "the prior alone: {actions:?}");
        });
    }

    #[test]
    fn an_export_can_be_reloaded_and_a_network_of_another_task_is_refused() {
        with_problem(|problem| {
            let explorer = tiny();
            let (network, _) = explorer.train(problem).unwrap();
            let policy = TrainedPolicy::new(problem, &explorer.fisher, network.clone()).unwrap();
            let export = policy.export();
            let reloaded = Policy::from_json(&export["network"]).unwrap();
            assert_eq!(reloaded, network);
            let entries = export["observation"].as_array().unwrap();
            let len: u64 = entries.iter().map(|e| e["len"].as_u64().unwrap()).sum();
            assert_eq!(len as usize, network.observation_len());
            assert_eq!(export["action"][0]["range"][1], 0.1);

            let other = Policy::linear(3, vec![0.0; 6], vec![0.0; 2]);
            let refused = TrainedPolicy::new(problem, &explorer.fisher, other);
            assert!(
                refused
                    .err()
                    .unwrap()
                    .to_string()
                    .contains("takes 3 entries")
            );
        });
    }

    #[test]
    fn wrong_settings_are_named() {
        let make = find::<ExplorerEntry>("fisher-ppo").unwrap().make;
        let message = |text: &str| make(&text.parse().unwrap()).err().unwrap().to_string();
        assert!(message("environments = 0").contains("explorer.environments"));
        assert!(message("[ppo]\nclip = 0.0").contains("ppo.clip"));
        assert!(message("[fisher]\ndelta = -1.0").contains("delta"));
        // What a user sets is put over the explorer's own defaults, not the learner's.
        let defaults = (find::<ExplorerEntry>("fisher-ppo").unwrap().defaults)();
        assert_eq!(defaults["ppo"]["gamma"].as_float(), Some(1.0));
    }
}
