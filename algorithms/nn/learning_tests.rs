//! PPO on environments with a known best return.

use std::ops::ControlFlow;

use asid_core::{BatchEnvironment, Error, Result, Transition};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::evaluate;
use crate::ppo::{PpoProgress, learn, train};
use asid_learned::Layer;
use asid_learned::{Normaliser, Policy, PpoConfig};

fn carry_on(_: &PpoProgress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// A point on a line, `x' = x + speed * a`, with the reward `-|x' - goal|`.
///
/// The observation is the start, and the goal relative to it, with units and an offset that are
/// hard to learn without normalisation.
struct Line {
    x: Vec<f64>,
    goal: Vec<f64>,
    step: Vec<usize>,
    horizon: usize,
    speed: f64,
    terminates: bool,
    rng: ChaCha8Rng,
}

impl Line {
    fn new(n: usize, horizon: usize) -> Self {
        Self {
            x: vec![0.0; n],
            goal: vec![0.0; n],
            step: vec![0; n],
            horizon,
            speed: 0.5,
            terminates: false,
            rng: ChaCha8Rng::seed_from_u64(7),
        }
    }

    fn restart(&mut self, i: usize) {
        self.x[i] = 0.0;
        self.goal[i] = self.rng.random_range(-0.4..0.4);
        self.step[i] = 0;
    }

    fn observe(&self, observation: &mut [f64]) {
        for (i, row) in observation.chunks_exact_mut(2).enumerate() {
            row[0] = 1000.0 + 50.0 * (self.goal[i] - self.x[i]);
            row[1] = 3.0;
        }
    }
}

impl BatchEnvironment for Line {
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
        (0..self.x.len()).for_each(|i| self.restart(i));
        self.observe(observation);
        Ok(())
    }
    fn step(&mut self, actions: &[f64], transition: &mut Transition) -> Result<()> {
        for (i, action) in actions.iter().enumerate() {
            assert!((-1.0..=1.0).contains(action));
            self.x[i] += self.speed * action;
            self.step[i] += 1;
            transition.reward[i] = -(self.x[i] - self.goal[i]).abs();
        }
        self.observe(&mut transition.final_observation);
        for i in 0..self.x.len() {
            let ended = self.step[i] == self.horizon;
            transition.terminated[i] = ended && self.terminates;
            transition.truncated[i] = ended && !self.terminates;
            if ended {
                self.restart(i);
            }
        }
        self.observe(&mut transition.observation);
        Ok(())
    }
}

/// Reward 1 per step and nothing to observe: the value is known in closed form.
struct Constant {
    step: usize,
    horizon: usize,
    terminates: bool,
}

impl BatchEnvironment for Constant {
    fn batch_size(&self) -> usize {
        1
    }
    fn observation_len(&self) -> usize {
        1
    }
    fn action_len(&self) -> usize {
        1
    }
    fn reset(&mut self, observation: &mut [f64]) -> Result<()> {
        self.step = 0;
        observation.fill(1.0);
        Ok(())
    }
    fn step(&mut self, _: &[f64], transition: &mut Transition) -> Result<()> {
        self.step += 1;
        let ended = self.step.is_multiple_of(self.horizon);
        transition.reward.fill(1.0);
        transition.terminated.fill(ended && self.terminates);
        transition.truncated.fill(ended && !self.terminates);
        transition.observation.fill(1.0);
        transition.final_observation.fill(1.0);
        Ok(())
    }
}

/// One-step episodes: the best return is 0, and doing nothing gives -0.2. The tolerance is a
/// hundredth of the range of goals.
#[test]
fn a_one_step_environment_is_solved() {
    let config = PpoConfig {
        total_steps: 40_000,
        ..PpoConfig::default()
    };
    let mut environment = Line::new(16, 1);
    environment.terminates = true;
    let trained = train(&mut environment, &config, 0, &mut carry_on).unwrap();
    let evaluation = trained.evaluation.unwrap();
    assert!(evaluation.mean > -0.01, "{}", evaluation.mean);
    let last = trained.curve.last().unwrap();
    assert!(last.action_std < 0.5, "the policy gets surer: {last:?}");
}

/// Ten steps to a goal that is up to four steps away. From a distance `d` the best return is
/// `-sum_k max(0, d - 0.1 k)`, on average -0.175; standing still gives -2. 64 goals determine that
/// average to 0.025; the tolerance leaves as much again for imperfect learning.
#[test]
fn a_longer_episode_with_a_time_limit_is_solved() {
    let config = PpoConfig {
        total_steps: 60_000,
        gamma: 0.9,
        ..PpoConfig::default()
    };
    let mut environment = Line::new(32, 10);
    environment.speed = 0.1;
    let trained = train(&mut environment, &config, 1, &mut carry_on).unwrap();
    let evaluation = trained.evaluation.unwrap();
    assert!(evaluation.mean > -0.275, "{}", evaluation.mean);
    assert_eq!(evaluation.returns.len(), 64);
    let explained = trained.curve.last().unwrap().explained_variance;
    assert!(explained.unwrap() > 0.7, "the critic learns: {explained:?}");
}

/// With rewards of 1 and gamma = 1/2 the value of a state is 1 / (1 - gamma) = 2 if time limits are
/// only limits. If every second step is terminal, the observation hides which. The value is then
/// the mean of 1 and 1 + gamma: 1.25.
#[test]
fn a_time_limit_is_worth_more_than_a_terminal_state() {
    let value = |terminates: bool| {
        let config = PpoConfig {
            total_steps: 20_000,
            n_steps: 256,
            gamma: 0.5,
            lambda: 1.0,
            learning_rate: 3e-3,
            normalise_observation: false,
            ..PpoConfig::default()
        };
        let mut environment = Constant {
            step: 0,
            horizon: 2,
            terminates,
        };
        let learnt = learn(&mut environment, &config, 0, &mut carry_on).unwrap();
        let observation = learnt.networks.observations(&[1.0]);
        learnt.networks.value(&observation).double_value(&[0])
    };
    // Tolerance: noise of stochastic gradients at this step size.
    let (terminated, truncated) = (value(true), value(false));
    assert!((terminated - 1.25).abs() < 0.05, "{terminated}");
    assert!((truncated - 2.0).abs() < 0.05, "{truncated}");
}

#[test]
fn one_seed_gives_one_result_and_another_gives_another() {
    let config = PpoConfig {
        total_steps: 4096,
        n_steps: 1024,
        evaluation_episodes: 8,
        ..PpoConfig::default()
    };
    let run = |seed| train(&mut Line::new(8, 5), &config, seed, &mut carry_on).unwrap();
    // Two concurrent trainings share no random generator.
    let (first, second) = std::thread::scope(|scope| {
        let other = scope.spawn(|| run(5));
        (run(5), other.join().unwrap())
    });
    assert_eq!(first, second);
    assert_ne!(first.curve, run(6).curve);
}

#[test]
fn progress_is_seen_and_can_end_the_training() {
    let config = PpoConfig {
        total_steps: 1_000_000,
        n_steps: 128,
        evaluation_episodes: 0,
        ..PpoConfig::default()
    };
    let mut seen = Vec::new();
    let trained = train(&mut Line::new(8, 5), &config, 0, &mut |progress| {
        seen.push(progress.clone());
        match progress.env_steps {
            steps if steps >= 384 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        }
    })
    .unwrap();
    assert_eq!(seen, trained.curve);
    let steps: Vec<usize> = seen.iter().map(|p| p.env_steps).collect();
    assert_eq!(steps, [128, 256, 384]);
    assert!(trained.evaluation.is_none());
    // 16 steps of 8 environments with episodes of 5 steps: three episodes end in each.
    assert!(seen[0].mean_return.is_some());
}

/// At least ten episodes in eight environments are two in each. A policy that stands still returns
/// minus the sum of the distances to its goal.
#[test]
fn an_evaluation_counts_as_many_episodes_of_each_environment() {
    let layers = vec![Layer {
        weight: vec![0.0; 2],
        bias: vec![0.0],
    }];
    let still = Policy::new(Normaliser::identity(2), layers, vec![0.0]);
    let mut environment = Line::new(8, 5);
    let evaluation = evaluate(&mut environment, &still, 10).unwrap();
    assert_eq!(evaluation.returns.len(), 16);
    assert_eq!(evaluation.env_steps, 8 * 10);
    // The goals are up to 0.4 away, for five steps.
    assert!(evaluation.returns.iter().all(|r| (-2.0..=0.0).contains(r)));
    assert!(evaluation.std > 0.0);

    let misfit = Policy::new(Normaliser::identity(3), vec![], vec![0.0]);
    let error = evaluate(&mut environment, &misfit, 10).unwrap_err();
    assert!(matches!(error, Error::Shape(_)), "{error}");
}

#[test]
fn rewards_that_are_not_finite_are_an_error() {
    struct Broken(Constant);
    impl BatchEnvironment for Broken {
        fn batch_size(&self) -> usize {
            self.0.batch_size()
        }
        fn observation_len(&self) -> usize {
            self.0.observation_len()
        }
        fn action_len(&self) -> usize {
            self.0.action_len()
        }
        fn reset(&mut self, observation: &mut [f64]) -> Result<()> {
            self.0.reset(observation)
        }
        fn step(&mut self, actions: &[f64], transition: &mut Transition) -> Result<()> {
            self.0.step(actions, transition)?;
            transition.reward[0] = f64::NAN;
            Ok(())
        }
    }
    let mut environment = Broken(Constant {
        step: 0,
        horizon: 2,
        terminates: false,
    });
    let error = train(&mut environment, &PpoConfig::default(), 0, &mut carry_on).unwrap_err();
    assert!(matches!(error, Error::Failed(_)), "{error}");
}
