use asid_core::Explorer as _;
use asid_core::environment::Transition;
use asid_learned::PpoConfig;

use super::*;
use crate::testing::with_problem;

/// A point in a corridor of length 20, moved by up to 0.5 per step; it starts at position 1.
struct Corridor {
    x: Vec<f64>,
    step: usize,
    horizon: usize,
    /// Whether each cell of length 1 was entered.
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

/// A random walk of 40 steps with standard deviation 0.29 gets 1.8 far. Four times as many of its
/// episodes see about seven of twenty cells. MAX goes where its models have no data and sees at
/// least twice as many in the same number of steps.
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

/// In imagined states, too, the relative position of the hand matches the positions of hand and
/// object.
#[test]
fn an_imagined_hand_is_seen_from_where_the_imagined_object_is() {
    with_problem("rod-balancing", |problem| {
        let shape = shape(problem).unwrap();
        let sights = vec![Motion::new(problem).unwrap()];
        let len = shape.state() + 1;
        let mut world =
            TrackedEnvironment::new(problem, sights, len, Nothing, "test episodes").unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut experience = Experience::new(shape.clone());
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let act = &mut |_: &[f64], actions: &mut [f64]| {
            actions.fill_with(|| random.random_range(-1.0..=1.0));
            Ok(())
        };
        experience.play(&mut world, 2, act).unwrap();
        let actions = world.action_len();
        let widths = Widths {
            state: shape.state(),
            action: actions,
            places: shape.places,
        };
        let settings = Max::default().ensemble;
        let mut ensemble = Ensemble::new(&settings, widths, &mut rng).unwrap();
        ensemble.fit(&experience.transitions, &settings, &mut rng);
        let mut imagination = Imagination::new(&ensemble, &experience, 3, actions, rng);
        let mut transition = Transition::new(3, len);
        imagination.reset(&mut transition.observation).unwrap();
        let [object, hand] = shape.relations[0];
        for _ in 0..4 {
            let up = vec![1.0; 3 * actions];
            imagination.step(&up, &mut transition).unwrap();
            for row in transition.observation.chunks_exact(len) {
                for i in 0..3 {
                    let seen = row[shape.moving() + i];
                    let expected = row[hand + i] - row[object + i];
                    assert!((seen - expected).abs() < 1e-6, "{seen} {expected}");
                }
            }
        }
    });
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
