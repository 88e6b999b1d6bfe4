//! Trains the explorer `max`, whose settings and play are in [`asid_learned::max`].
//!
//! ```text
//! warm-up: episodes of random actions
//! repeat for each round
//!     the ensemble learns from all transitions so far              (ensemble.rs)
//!     a new policy is trained in imagination: PPO in the ensemble, each step paid by the
//!         divergence of its members
//!     the policy plays episodes in the world
//! ```

mod imagination;

use std::time::Instant;

use asid_core::environment::BatchEnvironment;
use asid_core::explore::CurvePoint;
use asid_core::registry::{self, Settings};
use asid_core::{Error, Problem, Result};
use asid_learned::learning::{LearnedExplorer, Trainer, Training};
use asid_learned::max::{Max, Motion, round_name};
use asid_learned::play::POLICY;
use asid_learned::tensorboard::Scalars;
use asid_learned::{Policy, Tensors};
use rand::{Rng as _, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::ensemble::{Ensemble, Widths};
use crate::ppo::{PpoProgress, train as ppo};
use crate::tracked::{Nothing, TrackedEnvironment};
use crate::training::wall_time;
use imagination::{Experience, Imagination};

inventory::submit! {
    Trainer { algorithm: Max::NAME, train }
}

/// What an observation is made of: `places` entries that move, the first `paid` of them those whose
/// disagreement is sought; as many changes of them since the last step where `changes`; for each of
/// `relations`, whose two numbers are the first entries of an object and of the hand, the hand as seen from the object;
/// and the share of the episode that is over.
#[derive(Clone, Debug)]
pub struct Shape {
    pub places: usize,
    pub paid: usize,
    pub changes: bool,
    pub relations: Vec<[usize; 2]>,
    pub horizon: usize,
}

impl Shape {
    /// Entries of a state: an observation without the clock.
    fn state(&self) -> usize {
        self.moving() + 3 * self.relations.len()
    }

    /// Those of them that are places and changes; relations follow.
    fn moving(&self) -> usize {
        self.places * if self.changes { 2 } else { 1 }
    }
}

/// One round as it went.
pub struct Round {
    pub policy: Policy,
    /// Mean divergence that an imagined episode of the trained policy collects, nats.
    pub utility: f64,
    /// Standard deviation of the same.
    pub utility_std: f64,
    /// Mean divergence that its episodes in the world collect, before the ensemble learns from them, nats.
    pub utility_real: f64,
    /// How well the ensemble foresees a control step of the same episodes; see [`Ensemble::error`].
    pub model_error: f64,
    /// Real control steps so far.
    pub steps: usize,
}

/// The rounds of MAX in a world whose observations have this shape; its rewards mean nothing.
/// `told` sees every round and may end the work.
///
/// # Errors
/// Those of the world and of the learner.
pub fn explore(
    world: &mut dyn BatchEnvironment,
    shape: Shape,
    settings: &Max,
    seed: u64,
    told: &mut dyn FnMut(usize, &Round) -> Result<()>,
) -> Result<Vec<Round>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let widths = Widths {
        state: shape.state(),
        action: world.action_len(),
        places: shape.places,
    };
    let mut ensemble = Ensemble::new(&settings.ensemble, widths, &mut rng)?;
    let mut experience = Experience::new(shape.clone());
    let mut random = ChaCha8Rng::seed_from_u64(rng.random());
    experience.play(world, settings.warm_up, &mut |_, actions| {
        actions.fill_with(|| random.random_range(-1.0..=1.0));
        Ok(())
    })?;
    let mut rounds = Vec::new();
    for number in 1..=settings.rounds {
        ensemble.fit(&experience.transitions, &settings.ensemble, &mut rng);
        let chance = ChaCha8Rng::seed_from_u64(rng.random());
        let (size, actions) = (settings.imagined, widths.action);
        let mut imagination = Imagination::new(&ensemble, &experience, size, actions, chance);
        let (mut utility, mut utility_std) = (f64::NAN, f64::NAN);
        let carry_on = &mut |p: &PpoProgress| {
            utility = p.mean_return.unwrap_or(utility);
            utility_std = p.return_std.unwrap_or(utility_std);
            std::ops::ControlFlow::Continue(())
        };
        let trained = ppo(&mut imagination, &settings.ppo, rng.random(), carry_on)?;
        let policy = trained.policy;
        let known = experience.transitions.clone();
        let mut noise = ChaCha8Rng::seed_from_u64(rng.random());
        experience.play(world, settings.environments, &mut |seen, actions| {
            policy.sample(seen, actions, &mut noise)
        })?;
        let new = experience.transitions.after(&known, widths);
        let round = Round {
            policy,
            utility,
            utility_std,
            utility_real: ensemble.utility(&new, shape.paid).unwrap_or(f64::NAN)
                * shape.horizon as f64,
            model_error: ensemble.error(&new).unwrap_or(f64::NAN),
            steps: experience.steps,
        };
        told(number, &round)?;
        rounds.push(round);
    }
    Ok(rounds)
}

fn train(problem: &Problem<'_>, settings: &Settings) -> Result<Training> {
    let explorer: Max = registry::settings("explorer", settings)?;
    let observation = explorer.observation(problem)?;
    let len = observation.iter().map(|e| e.len).sum();
    let sights = (0..explorer.environments)
        .map(|_| Motion::new(problem))
        .collect::<Result<Vec<_>>>()?;
    let motion = Motion::new(problem)?;
    let shape = Shape {
        places: motion.places(),
        paid: motion.tracked(),
        changes: true,
        relations: motion.relations(),
        horizon: problem.task.exploration().horizon,
    };
    let mut world = TrackedEnvironment::new(problem, sights, len, Nothing, "max episodes")?;
    let seed = problem.streams.stream("max").random();
    let (mut tensors, mut curve, mut events) = (Tensors::new(), Vec::new(), Vec::new());
    let started = Instant::now();
    problem
        .progress
        .begin("explore: rounds", explorer.rounds as u64);
    let done = explore(&mut world, shape, &explorer, seed, &mut |number, round| {
        round.policy.to_tensors(&round_name(number), &mut tensors);
        curve.push(CurvePoint {
            x: round.steps as f64,
            mean: round.utility,
            std: round.utility_std,
        });
        let rate = round.steps as f64 / started.elapsed().as_secs_f64().max(1e-9);
        events.push(Scalars {
            step: round.steps as i64,
            wall_time: wall_time(),
            values: vec![
                ("charts/episodic_return", round.utility as f32),
                ("charts/SPS", rate as f32),
                ("charts/utility_real", round.utility_real as f32),
                ("losses/model_error", round.model_error as f32),
            ],
        });
        let note = format!(
            "utility {:.2} nats imagined, {:.2} in the world, error {:.2}",
            round.utility, round.utility_real, round.model_error
        );
        problem.progress.note(&note);
        problem.progress.advance(1);
        Ok(())
    });
    problem.progress.end();
    let rounds = done?;
    let last = rounds
        .last()
        .ok_or_else(|| Error::Failed("`max` played no round".into()))?;
    last.policy.to_tensors(POLICY, &mut tensors);
    Ok(Training {
        tensors,
        observation,
        steps: last.steps as u64,
        figures: vec![
            ("utility_nats", last.utility),
            ("utility_real_nats", last.utility_real),
            ("model_error_over_still", last.model_error),
        ],
        curve,
        events,
    })
}

#[cfg(test)]
mod tests {
    use asid_core::Explorer as _;
    use asid_core::environment::Transition;
    use asid_learned::PpoConfig;

    use super::*;
    use crate::testing::with_problem;

    /// A point in a corridor of length 20, moved by up to 0.5 a step; it begins at 1 of 20.
    struct Corridor {
        x: Vec<f64>,
        step: usize,
        horizon: usize,
        /// Cells of length 1 that were entered.
        visited: [bool; 20],
    }

    impl Corridor {
        fn new(n: usize) -> Self {
            Self {
                x: vec![1.0; n],
                step: 0,
                horizon: 40,
                visited: [false; 20],
            }
        }

        fn observe(&self, observation: &mut [f64]) {
            for (row, x) in observation.chunks_exact_mut(2).zip(&self.x) {
                row.copy_from_slice(&[*x, self.step as f64 / self.horizon as f64]);
            }
        }

        fn covered(&self) -> usize {
            self.visited.iter().filter(|v| **v).count()
        }
    }

    impl BatchEnvironment for Corridor {
        fn batch_size(&self) -> usize {
            self.x.len()
        }
        fn observation_len(&self) -> usize {
            2
        }
        fn action_len(&self) -> usize {
            1
        }
        fn reset(&mut self, observation: &mut [f64]) -> Result<()> {
            self.x.fill(1.0);
            self.step = 0;
            self.observe(observation);
            Ok(())
        }
        fn step(&mut self, actions: &[f64], transition: &mut Transition) -> Result<()> {
            for (x, a) in self.x.iter_mut().zip(actions) {
                *x = (*x + 0.5 * a.clamp(-1.0, 1.0)).clamp(0.0, 19.99);
                self.visited[*x as usize] = true;
            }
            self.step += 1;
            transition.reward.fill(0.0);
            self.observe(&mut transition.final_observation);
            let over = self.step == self.horizon;
            transition.terminated.fill(over);
            transition.truncated.fill(false);
            if over {
                let mut first = std::mem::take(&mut transition.observation);
                self.reset(&mut first)?;
                transition.observation = first;
            } else {
                self.observe(&mut transition.observation);
            }
            Ok(())
        }
    }

    /// A random walk of 40 steps of deviation 0.29 comes 1.8 far; four times that many episodes of
    /// it see some seven cells of twenty. MAX, with the same number of steps, goes where its models
    /// have not been: at least twice as many.
    #[test]
    fn it_covers_a_corridor_faster_than_random_actions() {
        let settings = Max {
            environments: 4,
            warm_up: 4,
            rounds: 4,
            imagined: 64,
            ppo: PpoConfig {
                total_steps: 20_480,
                n_steps: 2560,
                learning_rate: 3e-3,
                minibatch: 256,
                ..Max::default().ppo
            },
            ..Max::default()
        };
        let shape = Shape {
            places: 1,
            paid: 1,
            changes: false,
            relations: Vec::new(),
            horizon: 40,
        };
        let mut world = Corridor::new(4);
        let rounds = explore(&mut world, shape.clone(), &settings, 3, &mut |_, _| Ok(())).unwrap();
        assert_eq!(rounds.last().unwrap().steps, 5 * 4 * 40);
        let mut random = Corridor::new(4);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut experience = Experience::new(shape);
        experience
            .play(&mut random, 20, &mut |_, actions| {
                actions.fill_with(|| rng.random_range(-1.0..=1.0));
                Ok(())
            })
            .unwrap();
        assert_eq!(experience.steps, 5 * 4 * 40);
        let (max, random) = (world.covered(), random.covered());
        assert!(max >= 2 * random, "{max} cells against {random}");
    }

    #[test]
    fn it_is_trained_saved_and_any_round_is_played() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("max.safetensors");
        let mut settings = Max {
            policy: "train".into(),
            environments: 2,
            warm_up: 2,
            rounds: 2,
            imagined: 4,
            ..Max::default()
        };
        settings.ensemble.epochs = 1;
        settings.ppo.total_steps = 160;
        settings.ppo.n_steps = 80;
        settings.ppo.minibatch = 16;
        with_problem("rod-balancing", |problem| {
            assert!(settings.train(problem, &path).unwrap());
            let export = |play_round| {
                let explorer = Max {
                    policy: path.display().to_string(),
                    play_round,
                    ..Max::default()
                };
                let explored = explorer.explore(problem, None).unwrap();
                explored.policy.export()["network"].clone()
            };
            assert_eq!(export(0), export(2));
            assert!(export(1) != export(2));
        });
    }
}
