//! Trains the explorer `maxmi`, whose settings and play are in [`asid_learned::maxmi`].
//!
//! ```text
//! warm-up: episodes of random actions, the predictor learns from them
//! repeat
//!     episodes by the policy, each step paid by what the predictor gained    (PPO: rollout)
//!     the predictor learns from the latest episodes, each cut at a random mark
//!     the policy learns                                                      (PPO: update)
//! ```

use std::collections::VecDeque;
use std::sync::Arc;

use asid_core::environment::{BatchEnvironment, Transition};
use asid_core::registry::{self, Settings};
use asid_core::{Parameter, Problem, Result};
use asid_learned::Layer;
use asid_learned::history::History;
use asid_learned::inference::Inference;
use asid_learned::learning::{LearnedExplorer, Trainer, Training};
use asid_learned::maxmi::{MaxMi, PREDICTOR, Predicting, PredictorSettings};
use asid_learned::play::POLICY;
use asid_learned::{Dataset, Network as Plain, Tensors};
use rand::{Rng as _, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tch::Tensor;

use crate::estimator::keep;
use crate::posterior_net::{PosteriorNet, Rows};
use crate::tracked::{Pay, TrackedEnvironment};
use crate::training::learn_policy;

inventory::submit! {
    Trainer { algorithm: MaxMi::NAME, train }
}

/// The predictor with the episodes that it learns from.
struct Predictor<'a> {
    settings: &'a PredictorSettings,
    parameters: &'a [Parameter],
    memory: Dataset,
    net: Option<PosteriorNet>,
    rng: ChaCha8Rng,
}

impl Predictor<'_> {
    /// Takes an episode in, and lets the oldest go.
    fn remember(&mut self, history: &[f64], truth: &[f64]) {
        self.memory.histories.extend_from_slice(history);
        self.memory.truths.extend_from_slice(truth);
    }

    fn forget(&mut self) {
        let over = self.memory.episodes().saturating_sub(self.settings.memory);
        if over > 0 {
            self.memory = self.memory.split(over).1;
        }
    }

    /// Learns from the memory for some steps of Adam.
    fn learn(&mut self, steps: usize) -> Result<Arc<Inference>> {
        let settings = self.settings;
        self.forget();
        let rows = match &self.net {
            Some(net) => net.rows(&self.memory),
            None => {
                // The scales of the inputs are those of the first episodes for good: the policy
                // and the predictor are not to see them move.
                let rates = (settings.learning_rate, 0.0);
                let hidden = &settings.hidden;
                let net =
                    PosteriorNet::new(&self.memory, self.parameters, hidden, rates, &mut self.rng)?;
                let rows = net.rows(&self.memory);
                self.net = Some(net);
                rows
            }
        };
        let (n, marks) = (self.memory.episodes(), self.memory.marks);
        let Some(net) = &mut self.net else {
            return Err(asid_core::Error::Failed("no predictor".into()));
        };
        for _ in 0..steps {
            let size = settings.minibatch.min(n);
            let picked: Vec<i64> = (0..size)
                .map(|_| self.rng.random_range(0..n as i64))
                .collect();
            let index = Tensor::from_slice(&picked);
            let some = Rows {
                input: rows.input.index_select(0, &index),
                truth: rows.truth.index_select(0, &index),
            };
            // Each episode is shown up to a mark of its own.
            let mut last = 0;
            let keep = keep(size, marks, &mut self.rng, |rng, mark| {
                if mark == 0 {
                    last = rng.random_range(0..marks);
                }
                mark <= last
            });
            net.step(&some, Some(&keep));
        }
        Ok(Arc::new(net.plain()))
    }
}

/// Pays for what a control step made the truth more likely.
struct Gain<'a> {
    problem: &'a Problem<'a>,
    predictor: Predictor<'a>,
    /// `log q - log prior` after the latest reading of each episode, nats.
    told: Vec<f64>,
    /// Of the latest whole episodes, each judged before the predictor learned from it: squared
    /// error of the predicted mean, that of the prior's mean, and nats, all summed over unknowns.
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

impl Pay<Predicting> for Gain<'_> {
    fn begin(&mut self, e: usize, sight: &Predicting, _: &[f64], theta: &[f64]) {
        self.told[e] = self.told(sight, theta);
    }

    fn reward(&mut self, e: usize, sight: &Predicting, _: &[f64], theta: &[f64]) -> f64 {
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
        let learned = self.predictor.learn(self.predictor.settings.steps)?;
        for sight in sights {
            sight.set_predictor(Arc::clone(&learned));
        }
        Ok(())
    }
}

/// A predictor that gives the prior whatever it is shown.
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

/// The environment, its predictor trained on episodes of random actions.
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
    let pay = Gain {
        problem,
        predictor: Predictor {
            settings: &explorer.predictor,
            parameters: problem.parameters,
            memory: Dataset {
                len: history.len(),
                entries: history.entries(),
                marks: history.marks(),
                ..Dataset::default()
            },
            net: None,
            rng: ChaCha8Rng::seed_from_u64(seed),
        },
        told: vec![0.0; n],
        judged: VecDeque::new(),
    };
    let mut environment =
        TrackedEnvironment::new(problem, sights, observation_len, pay, "maxmi episodes")?;
    let mut rng = problem.streams.stream("maxmi warm-up");
    let mut transition = Transition::new(n, observation_len);
    environment.reset(&mut transition.observation)?;
    let horizon = problem.task.exploration().horizon;
    for _ in 0..explorer.predictor.warm_up.div_ceil(n) * horizon {
        let actions: Vec<f64> = (0..n * environment.action_len())
            .map(|_| rng.random_range(-1.0..=1.0))
            .collect();
        environment.step(&actions, &mut transition)?;
    }
    Ok(environment)
}

fn train(problem: &Problem<'_>, settings: &Settings) -> Result<Training> {
    let explorer: MaxMi = registry::settings("explorer", settings)?;
    let observation = explorer.observation(problem)?;
    let len = observation.iter().map(|e| e.len).sum();
    let mut environment = environment(problem, &explorer, len)?;
    let seed = problem.streams.stream("maxmi").random();
    let learned = learn_policy(problem, &mut environment, &explorer.ppo, seed)?;
    let mut tensors = Tensors::new();
    learned.policy.to_tensors(POLICY, &mut tensors);
    let judged = &environment.pay.judged;
    let sum = |k: usize| judged.iter().map(|j| j[k]).sum::<f64>();
    let figures = vec![
        ("return", learned.last_return),
        ("predictor_error_over_prior", (sum(0) / sum(1)).sqrt()),
        ("predictor_nats", sum(2) / judged.len() as f64),
    ];
    if let Some(net) = &environment.pay.predictor.net {
        net.plain().to_tensors(PREDICTOR, &mut tensors);
    }
    Ok(Training {
        tensors,
        observation,
        steps: learned.curve.last().map_or(0, |p| p.x as u64)
            + (explorer.predictor.warm_up * problem.task.exploration().horizon) as u64,
        figures,
        curve: learned.curve,
        events: learned.events,
    })
}

/// Latest episodes that the predictor's figures are of.
const LATEST: usize = 512;

#[cfg(test)]
#[allow(clippy::field_reassign_with_default)] // nested settings read best one by one
mod tests {
    use asid_core::Explorer as _;
    use asid_core::{RealWorld as _, SimulatedWorld, Streams};
    use asid_learned::Saved;
    use asid_learned::estimator::score;
    use asid_learned::learning::{Cache, obtain};

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

    /// A file holds policy and predictor, the same seed gives the same, and it can be played.
    #[test]
    fn it_is_trained_saved_and_played() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("maxmi.safetensors");
        with_problem("rod-balancing", |problem| {
            let explorer = tiny();
            assert!(explorer.train(problem, &path).unwrap());
            let again = obtain(&explorer, &Cache::default(), problem).unwrap();
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

    /// The rewards of an episode add up to what the predictor gained over it.
    #[test]
    fn the_return_is_the_information_gained() {
        with_problem("rod-balancing", |problem| {
            let explorer = tiny();
            let len = explorer.observation(problem).unwrap();
            let len = len.iter().map(|e| e.len).sum();
            let mut environment = environment(problem, &explorer, len).unwrap();
            let mut transition = Transition::new(4, len);
            environment.reset(&mut transition.observation).unwrap();
            let first = environment.pay.told.clone();
            let mut total = [0.0; 4];
            for _ in 0..19 {
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

    /// Readings of the unknown with noise that shrinks from mark to mark: the predictor's error on
    /// new episodes is below half of that of the prior's mean at the end, and the more it has seen
    /// the less it is.
    #[test]
    fn the_predictor_beats_the_priors_mean_by_a_factor() {
        let prior = Parameter {
            name: "p".into(),
            targets: vec!["geom/a/friction/0".parse().unwrap()],
            range: [0.0, 1.0],
            scale: asid_core::parameter::Scale::Linear,
            unit: String::new(),
        };
        let parameters = [prior];
        let settings = PredictorSettings {
            hidden: vec![32],
            ..PredictorSettings::default()
        };
        let (marks, mut rng) = (5, Streams::new(5).stream("toy"));
        let mut episode = || {
            let z = parameters[0].to_scaled(parameters[0].sample(&mut rng));
            let mut history: Vec<f64> = (0..marks)
                .map(|k| z + (2.0 - 0.4 * k as f64) * rng.random_range(-1.0..1.0))
                .collect();
            history.resize(2 * marks, 1.0);
            (history, z)
        };
        let mut predictor = Predictor {
            settings: &settings,
            parameters: &parameters,
            memory: Dataset {
                len: 2 * marks,
                entries: marks,
                marks,
                ..Dataset::default()
            },
            net: None,
            rng: ChaCha8Rng::seed_from_u64(1),
        };
        let mut inference = None;
        for _ in 0..20 {
            for _ in 0..64 {
                let (history, z) = episode();
                predictor.remember(&history, &[z]);
            }
            inference = Some(predictor.learn(60).unwrap());
        }
        let inference = inference.unwrap();
        let mut errors = Vec::new();
        let fresh: Vec<_> = (0..500).map(|_| episode()).collect();
        for shown in [1, 3, 5] {
            let mut data = Dataset {
                len: 2 * marks,
                entries: marks,
                marks,
                ..Dataset::default()
            };
            for (history, z) in &fresh {
                let mut history = history.clone();
                history[shown..marks].fill(f64::NAN);
                history[marks + shown..].fill(0.0);
                data.histories.extend(history);
                data.truths.push(*z);
            }
            errors.push(score(&inference, &data, 0, 1).error_over_prior);
        }
        assert!(
            errors[2] < 0.5 && errors.is_sorted_by(|a, b| a > b),
            "{errors:?}"
        );
    }
}
