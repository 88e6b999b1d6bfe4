//! Trains the explorer `fisher-ppo`; its settings and play are in [`asid_learned::fisher_ppo`].
//!
//! The reward of a step is [`Information::reward`](asid_algorithms::fisher::Information::reward).
//! [`FisherEnvironment`], the batch of episodes in which PPO learns, computes it.

use asid_algorithms::explore::FisherEnvironment;
use asid_core::registry::{self, Settings};
use asid_core::{Problem, Result};
use asid_learned::fisher_ppo::FisherPpo;
use asid_learned::learning::{LearnedExplorer, Trainer, Training};
use rand::Rng as _;

use crate::training::learn_policy;

inventory::submit! {
    Trainer { algorithm: FisherPpo::NAME, train }
}

fn train(problem: &Problem<'_>, settings: &Settings) -> Result<Training> {
    let explorer: FisherPpo = registry::settings("explorer", settings)?;
    let mut environment = FisherEnvironment::new(problem, &explorer.fisher, explorer.environments)?;
    let seed = problem.streams.stream("fisher-ppo").random();
    let learned = learn_policy(problem, &mut environment, &explorer.ppo, seed)?;
    Ok(learned.training(explorer.observation(problem)?))
}

#[cfg(test)]
#[allow(clippy::field_reassign_with_default)] // nested settings read best one by one
mod tests {
    use asid_core::Explorer as _;
    use asid_learned::learning::{events_of, obtain};
    use asid_learned::{Policy, Saved};

    use super::*;
    use crate::testing::with_problem;

    /// Two updates of two episodes.
    fn tiny() -> FisherPpo {
        let mut explorer = FisherPpo::default();
        explorer.policy = "train".into();
        explorer.environments = 2;
        explorer.ppo.n_steps = 40;
        explorer.ppo.total_steps = 80;
        explorer.ppo.minibatch = 16;
        explorer
    }

    #[test]
    fn the_same_seed_gives_the_same_policy_and_a_file_plays_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("policy.safetensors");
        with_problem("rod-balancing", |problem| {
            let explorer = tiny();
            let one = obtain(&explorer.clone(), problem).unwrap();
            let other = obtain(&explorer.clone(), problem).unwrap();
            assert_eq!(one.tensors, other.tensors);
            assert!(explorer.train(problem, &path).unwrap());
            let saved = Saved::load(&path).unwrap();
            assert_eq!(saved.tensors, one.tensors);
            assert!(events_of(&path).exists());
            assert_eq!(saved.description.training_steps, 80);
            assert_eq!(saved.description.engine, "rapier 0.36");

            let mut loading = FisherPpo::default();
            loading.policy = path.display().to_string();
            let loaded = loading.explore(problem, None).unwrap();
            let trained = explorer.explore(problem, None).unwrap();
            let steps: Vec<f64> = loaded.curve.iter().map(|p| p.x).collect();
            assert_eq!(steps, [40.0, 80.0]);
            let network = |export: serde_json::Value| Policy::from_json(&export["network"]);
            let networks = [loaded, trained].map(|e| network(e.policy.export()).unwrap());
            assert_eq!(networks[0], networks[1]);
        });
    }
}
