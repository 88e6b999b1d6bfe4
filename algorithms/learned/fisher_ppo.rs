//! The Fisher objective with PPO: a closed-loop exploration policy.
//!
//! The reward of a step is the information about the unknowns that it adds,
//! [`Information::reward`](asid_algorithms::fisher::Information::reward).
//! [`FisherEnvironment`](asid_algorithms::explore::FisherEnvironment) computes it; the crate
//! `asid-nn` trains in that environment.
//!
//! The policy is trained once, over start poses and unknowns drawn anew for every episode (domain
//! randomisation). It then plays any episode without a search. The information gathered so far is
//! part of its observation. In the real world it comes from a simulation at the middle of the
//! prior, which starts at the object pose of the first reading and takes the same actions.

use std::sync::Arc;

use asid_algorithms::explore::Observer;
use asid_algorithms::fisher::Objective;
use asid_algorithms::fisher::{FisherBatch, FisherSettings};
use asid_core::explore::Explored;
use asid_core::settings::require;
use asid_core::{Problem, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::file::{ObservationEntry, Saved};
use crate::learning::{Cache, LearnedExplorer, learned_explorer};
use crate::play::{Observe, Playing};
use crate::ppo_settings::PpoConfig;

/// Settings of the explorer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FisherPpo {
    /// File of a trained policy. Empty: the one that ships, else trained on the spot. `train`:
    /// train anew. `shipped`: only the one that ships.
    pub policy: String,
    /// Episodes that are simulated at once.
    pub environments: usize,
    /// The learner. Discount 1 and a constant reward scale keep the return equal to the information
    /// gained.
    pub ppo: PpoConfig,
    /// The objective. The default `d-optimal` does not saturate, unlike `a-optimal`, and still
    /// distinguishes good episodes from better ones. The start pose counts as known, which needs
    /// fewer copies (3 instead of 9 on rod balancing).
    ///
    /// A policy that was trained before observes the information as in its training, whatever is
    /// set here.
    pub fisher: FisherSettings,
    /// Policy that was trained on the spot; not a setting.
    #[serde(skip)]
    pub cache: Cache,
}

impl Default for FisherPpo {
    fn default() -> Self {
        Self {
            policy: String::new(),
            environments: 64,
            // Each update takes one episode of each environment.
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
            cache: Cache::default(),
        }
    }
}

learned_explorer!(
    FisherPpo,
    "Fisher information, a policy trained by proximal policy optimisation"
);

/// Checks that there is at least one environment.
pub(crate) fn check_environments(environments: usize) -> Result<()> {
    require(
        "explorer",
        &[("environments", environments > 0, "at least 1")],
    )
}

/// The entries of an observer, as a file describes them.
#[must_use]
pub fn entries(observer: &Observer) -> Vec<ObservationEntry> {
    let entry = |e: &asid_algorithms::explore::observation::Entry| ObservationEntry {
        name: e.name.clone(),
        len: e.len,
    };
    observer.entries().iter().map(entry).collect()
}

impl FisherPpo {
    /// How the information that a file's policy observes is computed: as in its training.
    fn observed_by(&self, saved: &Saved) -> FisherSettings {
        let stored = saved.description.settings.get("fisher");
        stored
            .and_then(|settings| FisherSettings::deserialize(settings).ok())
            .unwrap_or_else(|| self.fisher.clone())
    }
}

impl LearnedExplorer for FisherPpo {
    const NAME: &'static str = "fisher-ppo";

    fn policy(&self) -> &str {
        &self.policy
    }

    fn set_policy(&mut self, policy: &str) {
        policy.clone_into(&mut self.policy);
    }

    fn check(&self) -> Result<()> {
        check_environments(self.environments)?;
        self.ppo.validate("explorer")?;
        self.fisher.check()
    }

    fn observation(&self, problem: &Problem<'_>) -> Result<Vec<ObservationEntry>> {
        Ok(entries(&Observer::new(problem)?))
    }

    fn cache(&self) -> &Cache {
        &self.cache
    }

    fn play<'a>(&'a self, problem: &'a Problem<'a>, saved: Arc<Saved>) -> Result<Explored<'a>> {
        let fisher = self.observed_by(&saved);
        let observe = Box::new(Shadowed::new(problem, &fisher)?);
        Playing::explored(saved, observe, fisher.describe())
    }
}

/// Observes readings together with the information gathered by a simulation that runs along.
pub struct Shadowed<'a> {
    problem: &'a Problem<'a>,
    observer: Observer,
    /// The episode simulated at the middle of the prior.
    shadow: FisherBatch<'a>,
    reading: Vec<f64>,
}

impl<'a> Shadowed<'a> {
    /// Observer for a policy that was trained with these settings.
    ///
    /// # Errors
    /// As [`FisherBatch::new`].
    pub fn new(problem: &'a Problem<'a>, settings: &FisherSettings) -> Result<Self> {
        let shadow = FisherBatch::new(problem, settings, 1)?;
        Ok(Self {
            observer: Observer::new(problem)?,
            reading: vec![0.0; shadow.width()],
            problem,
            shadow,
        })
    }
}

impl Observe for Shadowed<'_> {
    fn observe(&mut self, step: usize, reading: &[f64], observation: &mut [f64]) -> Result<()> {
        let protocol = self.problem.task.exploration();
        if step == 0 {
            let middle: Vec<f64> = self.problem.parameters.iter().map(|p| p.center()).collect();
            let start = self.problem.task.locate(reading);
            self.shadow.begin(&middle, &start, &mut self.reading)?;
        }
        let share = step as f64 / protocol.horizon as f64;
        let std = self.shadow.information()[0].expected_std();
        self.observer.observe(reading, share, &std, observation);
        Ok(())
    }

    fn acted(&mut self, action: &[f64]) -> Result<()> {
        self.shadow.step(action, &mut self.reading, &mut [0.0])
    }
}

#[cfg(test)]
mod tests {
    use asid_core::registry::{ExplorerEntry, find};
    use asid_core::{RealWorld as _, Streams};
    use asid_worlds::SimulatedWorld;

    use asid_algorithms::fisher::Form;
    use asid_core::Explorer as _;

    use super::*;
    use crate::file::{Description, Saved, Tensors};
    use crate::play::POLICY;
    use crate::policy::Policy;
    use crate::testing::with_problem;

    /// A file that holds this policy for a problem.
    fn saved(problem: &Problem<'_>, network: &Policy) -> Saved {
        let mut tensors = Tensors::new();
        network.to_tensors(POLICY, &mut tensors);
        let observation = FisherPpo::default().observation(problem).unwrap();
        Saved {
            description: Description {
                observation,
                ..Description::new("fisher-ppo", problem, serde_json::Value::Null)
            },
            tensors,
        }
    }

    /// A policy in which the observation's last entry, the information gathered, moves the hand
    /// along x.
    fn by_information(problem: &Problem<'_>) -> Policy {
        let inputs = Observer::new(problem).unwrap().observation_len();
        let mut weight = vec![0.0; inputs * 2];
        weight[(inputs - 1) * 2] = 0.1;
        Policy::linear(inputs, weight, vec![0.0; 2])
    }

    /// The information gathered so far is an entry of the observation: a policy that uses only this
    /// entry acts by it.
    #[test]
    fn a_policy_acts_by_the_information_gathered() {
        with_problem("rod-balancing", |problem| {
            let settings = FisherSettings::default();
            let mut shadowed = Shadowed::new(problem, &settings).unwrap();
            let network = by_information(problem);
            let reading = {
                let mut batch = FisherBatch::new(problem, &settings, 1).unwrap();
                let mut first = vec![0.0; batch.width()];
                batch.begin(&[0.0], &[0.55, 0.0, 0.5], &mut first).unwrap();
                first
            };
            let mut observation = vec![0.0; network.observation_len()];
            let mut first = 0.0;
            for step in 0..20 {
                shadowed.observe(step, &reading, &mut observation).unwrap();
                let told = shadowed.shadow.information()[0].expected_std();
                let mut action = [0.0; 2];
                network.act(&observation, &mut action).unwrap();
                // Weight 0.1 on -log std.
                let expected = (-0.1 * told[0].ln()).clamp(-1.0, 1.0);
                assert!((action[0] - expected).abs() < 1e-6, "{action:?} {told:?}");
                if step == 0 {
                    first = action[0];
                }
                shadowed.acted(&[0.1 * action[0], 0.0]).unwrap();
            }
            assert!(first.abs() < 0.2, "the prior alone: {first}");
        });
    }

    /// A saved policy needs only its file: no neural-network library is linked here.
    #[test]
    fn a_saved_policy_is_played_from_its_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("policy.safetensors");
        with_problem("rod-balancing", |problem| {
            let network = by_information(problem);
            saved(problem, &network).save(&path).unwrap();
            let explorer = FisherPpo {
                policy: path.display().to_string(),
                ..FisherPpo::default()
            };
            let mut explored = explorer.explore(problem, None).unwrap();
            let export = explored.policy.export();
            assert_eq!(Policy::from_json(&export["network"]).unwrap(), network);
            let entries = export["observation"].as_array().unwrap();
            let len: u64 = entries.iter().map(|e| e["len"].as_u64().unwrap()).sum();
            assert_eq!(len as usize, network.observation_len());
            assert_eq!(export["action"][0]["range"][1], 0.1);
            let streams = Streams::new(1);
            let (task, model) = (problem.task, problem.model);
            let truth = [0.05];
            let mut world = SimulatedWorld::new(
                task,
                model,
                problem.parameters,
                &truth,
                problem.signals,
                streams,
            )
            .unwrap();
            let first = world.explore(&mut *explored.policy).unwrap();
            // A policy can be replayed: the second episode equals the first.
            let second = world.explore(&mut *explored.policy).unwrap();
            assert_eq!(first.actions, second.actions);
            assert_eq!(first.actions.len(), 20 * 2);
        });
    }

    /// Symptom: a policy that was trained with `--set explorer.fisher.form=one-step` observed the
    /// information of the trajectory form when it was played from its file, and the result named
    /// the latter as its objective. Cause: the settings of the player were used, not the file's.
    #[test]
    fn a_policy_observes_the_information_as_in_its_training() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("policy.safetensors");
        with_problem("rod-balancing", |problem| {
            let trained = FisherPpo {
                fisher: FisherSettings {
                    objective: Objective::AOptimal,
                    form: Form::OneStep,
                    ..FisherPpo::default().fisher
                },
                ..FisherPpo::default()
            };
            let mut file = saved(problem, &by_information(problem));
            file.description.settings = serde_json::to_value(&trained).unwrap();
            file.save(&path).unwrap();
            let playing = FisherPpo {
                policy: path.display().to_string(),
                ..FisherPpo::default()
            };
            assert_eq!(playing.observed_by(&file), trained.fisher);
            let explored = playing.explore(problem, None).unwrap();
            assert_eq!(explored.objective, trained.fisher.describe());
        });
    }

    #[test]
    fn a_policy_of_another_task_or_explorer_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("policy.safetensors");
        let explorer = FisherPpo {
            policy: path.display().to_string(),
            ..FisherPpo::default()
        };
        let message = |task: &str| {
            let mut message = String::new();
            with_problem(task, |problem| {
                message = explorer.explore(problem, None).err().unwrap().to_string();
            });
            message
        };
        assert!(message("rod-balancing").contains("policy.safetensors"));
        with_problem("rod-balancing", |problem| {
            let mut file = saved(problem, &by_information(problem));
            file.save(&path).unwrap();
            assert!(
                message("shuffleboard")
                    .contains("was trained for the task `rod-balancing`, not `shuffleboard`")
            );
            file.description.observation.pop();
            file.save(&path).unwrap();
            assert!(message("rod-balancing").contains("takes other observations"));
            file.description.algorithm = "max".into();
            file.save(&path).unwrap();
            assert!(message("rod-balancing").contains("was trained by `max`"));
        });
    }

    #[test]
    fn without_policy_and_training_one_line_says_what_to_do() {
        with_problem("rod-balancing", |problem| {
            let explorer = FisherPpo {
                policy: "train".into(),
                ..FisherPpo::default()
            };
            let message = explorer.explore(problem, None).err().unwrap().to_string();
            for part in [
                "fisher-ppo",
                "rod-balancing",
                "--policy FILE",
                "cargo xtask setup",
                "--features torch",
                "--train FILE",
                "training is asked for",
            ] {
                assert!(message.contains(part), "{message}");
            }
            assert!(!message.contains('\n'));
        });
    }

    #[test]
    fn wrong_settings_are_named() {
        let make = find::<ExplorerEntry>("fisher-ppo").unwrap().make;
        let message = |text: &str| make(&text.parse().unwrap()).err().unwrap().to_string();
        assert!(message("environments = 0").contains("explorer.environments"));
        assert!(message("[ppo]\nclip = 0.0").contains("ppo.clip"));
        assert!(message("[fisher]\ndelta = -1.0").contains("delta"));
        // A user's settings override the explorer's own defaults, not the learner's.
        let defaults = (find::<ExplorerEntry>("fisher-ppo").unwrap().defaults)();
        assert_eq!(defaults["ppo"]["gamma"].as_float(), Some(1.0));
    }
}
