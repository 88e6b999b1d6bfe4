//! Trains the explorer `maxmi`; its settings and play are in [`asid_learned::maxmi`].
//!
//! ```text
//! repeat
//!     episodes by the policy, each step paid by what the predictor gained    (PPO: rollout)
//!         (the first episodes: each step paid if something was seen to move)
//!     the predictor learns from all episodes, each cut at a random mark  (predictor)
//!     the policy learns                                                      (PPO: update)
//! ```

use std::collections::VecDeque;
use std::sync::Arc;

use asid_core::registry::{self, Settings};
use asid_core::{Parameter, Problem, Result};
use asid_learned::Layer;
use asid_learned::PpoConfig;
use asid_learned::history::History;
use asid_learned::inference::Inference;
use asid_learned::learning::{LearnedExplorer, Trainer, Training};
use asid_learned::maxmi::{MaxMi, PREDICTOR, Predicting};
use asid_learned::{Dataset, Network as Plain};
use asid_readings::SignalSet;
use rand::Rng as _;

use crate::predictor::Predictor;
use crate::tracked::{Pay, TrackedEnvironment};
use crate::training::learn_policy;

inventory::submit! {
    Trainer { algorithm: MaxMi::NAME, train }
}

/// Rewards the gain in the log-likelihood of the truth; before there is a predictor, it rewards
/// visible motion.
struct Gain<'a> {
    problem: &'a Problem<'a>,
    signals: SignalSet,
    /// The latest reading of each episode.
    latest: Vec<Vec<f64>>,
    /// Whitened difference of two readings.
    difference: Vec<f64>,
    predictor: Predictor<'a>,
    /// The predictor's calibrated claims; they determine the reward and are part of the
    /// observation.
    claims: Arc<Inference>,
    /// `log q - log prior` after the latest reading of each episode, nats.
    told: Vec<f64>,
    /// Scores of the latest whole episodes, each taken before the predictor learned from it:
    /// squared error of the predicted mean, that of the prior's mean, and nats, all summed over
    /// unknowns.
    judged: VecDeque<[f64; 3]>,
}

impl Gain<'_> {
    fn scaled(&self, theta: &[f64]) -> Vec<f64> {
        let all = theta.iter().zip(self.problem.parameters.iter().cycle());
        all.map(|(x, p)| p.to_scaled(*x)).collect()
    }

    fn told(&self, sight: &Predicting, theta: &[f64]) -> f64 {
        let beliefs = sight.beliefs().iter().zip(self.scaled(theta));
        beliefs.map(|(b, z)| b.log_ratio(z)).sum()
    }
}

impl Gain<'_> {
    /// Whether an episode's tracked readings have changed by more than their noise explains.
    fn moved(&mut self, e: usize, reading: &[f64]) -> bool {
        let width = self.signals.width();
        let [now, before] = [reading, &self.latest[e]].map(|r| &r[..width]);
        self.signals.difference(now, before, &mut self.difference);
        self.difference.iter().any(|d| d.abs() > SEEN)
    }
}

impl Pay<Predicting> for Gain<'_> {
    fn begin(&mut self, e: usize, sight: &Predicting, reading: &[f64], theta: &[f64]) {
        self.told[e] = self.told(sight, theta);
        self.latest[e].copy_from_slice(reading);
    }

    fn reward(&mut self, e: usize, sight: &Predicting, reading: &[f64], theta: &[f64]) -> f64 {
        if !self.predictor.is_warm() {
            let moved = self.moved(e, reading);
            self.latest[e].copy_from_slice(reading);
            return f64::from(u8::from(moved));
        }
        let before = self.told[e];
        self.told[e] = self.told(sight, theta);
        self.told[e] - before
    }

    fn ended(&mut self, sights: &mut [Predicting], theta: &[f64]) -> Result<()> {
        let truths = self.scaled(theta);
        let d = self.problem.parameters.len();
        for (sight, truth) in sights.iter().zip(truths.chunks_exact(d)) {
            let all = || sight.beliefs().iter().zip(truth);
            self.judged.push_back([
                all().map(|(b, z)| (b.mean() - z).powi(2)).sum(),
                truth.iter().map(|z| z * z).sum(),
                all().map(|(b, z)| b.log_ratio(*z)).sum(),
            ]);
            self.predictor.remember(sight.history(), truth);
        }
        while self.judged.len() > LATEST {
            self.judged.pop_front();
        }
        if !self.predictor.is_warm() {
            return Ok(());
        }
        let learned = self.predictor.learn()?;
        for sight in sights {
            sight.set_predictor(Arc::clone(&learned));
        }
        self.claims = learned;
        Ok(())
    }
}

/// A predictor that always gives the prior.
fn prior(history: &History, parameters: &[Parameter]) -> Inference {
    let layer = Layer {
        weight: vec![0.0; history.len() * 2 * parameters.len()],
        bias: vec![0.0; 2 * parameters.len()],
    };
    let scales = (vec![0.0; history.entries()], vec![1.0; history.entries()]);
    Inference::new(
        scales,
        Plain {
            layers: vec![layer],
        },
        parameters,
    )
}

/// The environment with an untrained predictor.
fn environment<'a>(
    problem: &'a Problem<'a>,
    explorer: &'a MaxMi,
    observation_len: usize,
) -> Result<TrackedEnvironment<'a, Predicting, Gain<'a>>> {
    let history = History::new(problem)?;
    let blank = Arc::new(prior(&history, problem.parameters));
    let n = explorer.environments;
    let sights = (0..n)
        .map(|_| Predicting::new(problem, Arc::clone(&blank)))
        .collect::<Result<Vec<_>>>()?;
    let seed = problem.streams.stream("maxmi predictor").random();
    let shape = Dataset {
        len: history.len(),
        entries: history.entries(),
        marks: history.marks(),
        ..Dataset::default()
    };
    let signals = SignalSet::new(problem.model.layout(), problem.signals)?;
    let row = problem
        .model
        .layout()
        .recording(&problem.task.exploration().channels())?
        .width();
    let pay = Gain {
        problem,
        latest: vec![vec![0.0; row]; n],
        difference: vec![0.0; signals.whitened_len()],
        signals,
        predictor: Predictor::new(&explorer.predictor, problem.parameters, &shape, seed),
        claims: blank,
        told: vec![0.0; n],
        judged: VecDeque::new(),
    };
    TrackedEnvironment::new(problem, sights, observation_len, pay, "maxmi episodes")
}

fn train(problem: &Problem<'_>, settings: &Settings) -> Result<Training> {
    let explorer: MaxMi = registry::settings("explorer", settings)?;
    let observation = explorer.observation(problem)?;
    let len = observation.iter().map(|e| e.len).sum();
    let mut environment = environment(problem, &explorer, len)?;
    let seed = problem.streams.stream("maxmi").random();
    let warm_up = explorer.predictor.warm_up * problem.task.exploration().horizon;
    let ppo = PpoConfig {
        total_steps: warm_up + explorer.ppo.total_steps,
        ..explorer.ppo.clone()
    };
    let learned = learn_policy(problem, &mut environment, &ppo, seed)?;
    let mut training = learned.training(observation);
    let judged = &environment.pay.judged;
    let sum = |k: usize| judged.iter().map(|j| j[k]).sum::<f64>();
    training.figures.extend([
        ("predictor_error_over_prior", (sum(0) / sum(1)).sqrt()),
        ("predictor_nats", sum(2) / judged.len() as f64),
    ]);
    let predictor = &environment.pay.claims;
    predictor.to_tensors(PREDICTOR, &mut training.tensors);
    Ok(training)
}

/// Smallest change of a reading, in noise standard deviations, that counts as motion. The noise of
/// a difference of two readings is larger by sqrt(2); it exceeds this once in 10^5 entries.
const SEEN: f64 = 6.5;

/// Number of latest episodes that the predictor's figures are computed from.
const LATEST: usize = 512;

#[cfg(test)]
#[allow(clippy::field_reassign_with_default)] // nested settings read best one by one
mod tests {
    use asid_core::Explorer as _;
    use asid_core::environment::{BatchEnvironment as _, Transition};
    use asid_core::{RealWorld as _, Streams};
    use asid_learned::Saved;
    use asid_learned::learning::obtain;
    use asid_worlds::SimulatedWorld;

    use super::*;
    use crate::testing::with_problem;

    fn tiny() -> MaxMi {
        let mut explorer = MaxMi::default();
        explorer.policy = "train".into();
        explorer.environments = 4;
        explorer.predictor.warm_up = 8;
        explorer.predictor.steps = 5;
        explorer.predictor.hidden = vec![16];
        explorer.ppo.n_steps = 80;
        explorer.ppo.total_steps = 160;
        explorer.ppo.minibatch = 16;
        explorer
    }

    /// The file holds policy and predictor and can be played; equal seeds give equal files.
    #[test]
    fn it_is_trained_saved_and_played() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("maxmi.safetensors");
        with_problem("rod-balancing", |problem| {
            let explorer = tiny();
            assert!(explorer.train(problem, &path).unwrap());
            let again = obtain(&explorer.clone(), problem).unwrap();
            assert_eq!(Saved::load(&path).unwrap().tensors, again.tensors);
            let mut playing = MaxMi::default();
            playing.policy = path.display().to_string();
            let mut explored = playing.explore(problem, None).unwrap();
            let (task, model) = (problem.task, problem.model);
            let mut world = SimulatedWorld::new(
                task,
                model,
                problem.parameters,
                &[0.05],
                problem.signals,
                Streams::new(1),
            )
            .unwrap();
            let first = world.explore(&mut *explored.policy).unwrap();
            let second = world.explore(&mut *explored.policy).unwrap();
            assert_eq!(first.actions, second.actions);
        });
    }

    /// Before there is a predictor, a hand that does not move earns nothing. After that, the
    /// rewards of an episode add up to its information gain.
    #[test]
    fn the_return_is_the_information_gained() {
        with_problem("rod-balancing", |problem| {
            let explorer = tiny();
            let len = explorer.observation(problem).unwrap();
            let len = len.iter().map(|e| e.len).sum();
            let mut environment = environment(problem, &explorer, len).unwrap();
            let mut transition = Transition::new(4, len);
            environment.reset(&mut transition.observation).unwrap();
            let horizon = problem.task.exploration().horizon;
            // Eight episodes without a predictor, four at a time.
            for _ in 0..2 * horizon {
                environment.step(&[0.0; 8], &mut transition).unwrap();
                assert_eq!(transition.reward, [0.0; 4]);
            }
            assert!(environment.pay.predictor.is_warm());
            let first = environment.pay.told.clone();
            let mut total = [0.0; 4];
            for _ in 0..horizon - 1 {
                environment.step(&[0.8; 8], &mut transition).unwrap();
                for (t, r) in total.iter_mut().zip(&transition.reward) {
                    *t += r;
                }
            }
            for e in 0..4 {
                let gained = environment.pay.told[e] - first[e];
                assert!((total[e] - gained).abs() < 1e-9, "{total:?}");
            }
        });
    }

    /// A change of six noise standard deviations is no motion; one of seven is.
    #[test]
    fn motion_is_what_noise_does_not_explain() {
        with_problem("rod-balancing", |problem| {
            let explorer = tiny();
            let len = explorer.observation(problem).unwrap();
            let len = len.iter().map(|e| e.len).sum();
            let mut environment = environment(problem, &explorer, len).unwrap();
            let mut transition = Transition::new(4, len);
            environment.reset(&mut transition.observation).unwrap();
            let pay = &mut environment.pay;
            let noise = problem.signals[0].noise;
            for (noises, moved) in [(6.0, false), (7.0, true)] {
                let mut reading = pay.latest[0].clone();
                reading[0] += noises * noise;
                assert_eq!(pay.moved(0, &reading), moved);
            }
        });
    }
}
