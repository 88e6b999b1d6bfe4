//! Identification by a learned estimator: a network that maps an episode to a posterior (Kumar et
//! al. 2019; "ASID + estimator" of the paper).
//!
//! The network is trained on many episodes of one explorer with known truths. Evaluating it needs
//! no simulation. It is not reliable on episodes unlike those of its training.
//!
//! For each unknown the network gives a Gaussian in prior-scaled coordinates, truncated to the
//! prior's box ([`crate::inference`]). Its standard deviations are calibrated on held-out episodes.

mod trackers;
mod training;

use std::path::Path;
use std::sync::Arc;

use asid_algorithms::identify::Likelihood;
use asid_core::identify::{Identified, Identifier};
use asid_core::registry::{self, ExplorerEntry, Settings, find};
use asid_core::settings::require;
use asid_core::{Episode, Error, Explorer, Parameter, Posterior, Problem, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::belief::Belief;
use crate::file::{ObservationEntry, Saved, write_atomically};
use crate::history::History;
use crate::inference::Inference;
use crate::learning::{Cache, SHIPPED, TRAIN, events_of, from_program, is_file};
use crate::tensorboard::encode;
use trackers::other_readings;
pub use training::{EstimatorTrainer, Fitted, Score, can_train, score};

/// Name of the identifier.
pub const NAME: &str = "estimator";

/// Name of the network's tensors in a file.
const NETWORK: &str = "estimator";

/// Settings of the identifier.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Estimator {
    /// File of a trained network. Empty: the one that ships for the task and the explorer, else
    /// trained on the spot. `train`: train anew. `shipped`: only the one that ships.
    pub network: String,
    /// The explorer whose episodes the estimator learns from; it is not valid for episodes of
    /// another explorer.
    pub explorer: String,
    /// Episodes to learn from, including the held-out ones.
    pub episodes: usize,
    /// Share of the episodes for calibration, and the same share for scoring: 0.1 is 10 % for each.
    pub held_out: f64,
    /// Units of the hidden layers (tanh).
    pub hidden: Vec<usize>,
    /// Passes over the episodes; the epoch that is best on the calibration episodes is kept.
    pub epochs: usize,
    /// Episodes per step of Adam.
    pub minibatch: usize,
    /// Step size of Adam.
    pub learning_rate: f64,
    /// Decoupled weight decay per step, relative to the step size (Loshchilov and Hutter 2019).
    pub weight_decay: f64,
    /// Share of the readings that are dropped at random in training, so that the network can handle
    /// a tracker that loses the object.
    pub missing: f64,
    /// Number of posterior samples.
    pub samples: usize,
    /// Network that was trained on the spot; not a setting.
    #[serde(skip)]
    pub cache: Cache,
}

impl Default for Estimator {
    fn default() -> Self {
        Self {
            network: String::new(),
            explorer: "fisher-ppo".into(),
            episodes: 6000,
            held_out: 0.1,
            hidden: vec![128, 128],
            epochs: 60,
            minibatch: 128,
            learning_rate: 1e-3,
            weight_decay: 1e-2,
            missing: 0.02,
            samples: 1000,
            cache: Cache::default(),
        }
    }
}

asid_core::register!(IdentifierEntry {
    name: NAME,
    about: "a network that learned from episodes of the explorer, without a simulation",
    defaults: registry::defaults::<Estimator>,
    meanings: registry::meanings::<Estimator>,
    make: |s| {
        let estimator: Estimator = registry::settings("identifier", s)?;
        estimator.check()?;
        Ok(Box::new(estimator))
    },
});

/// Name under which the estimator for an explorer's episodes ships.
#[must_use]
pub fn shipped_name(explorer: &str) -> String {
    format!("{NAME}-{explorer}")
}

impl Estimator {
    fn check(&self) -> Result<()> {
        let rules = [
            ("episodes", self.episodes >= 100, "at least 100"),
            (
                "held_out",
                (0.01..=0.4).contains(&self.held_out),
                "0.01 to 0.4",
            ),
            ("hidden", !self.hidden.contains(&0), "widths of at least 1"),
            ("epochs", self.epochs > 0, "at least 1"),
            ("minibatch", self.minibatch > 1, "at least 2"),
            (
                "learning_rate",
                self.learning_rate > 0.0 && self.learning_rate.is_finite(),
                "above 0",
            ),
            (
                "weight_decay",
                self.weight_decay >= 0.0 && self.weight_decay.is_finite(),
                "0 or above",
            ),
            (
                "missing",
                (0.0..1.0).contains(&self.missing),
                "0 to below 1",
            ),
            ("samples", self.samples > 1, "at least 2"),
        ];
        require("identifier", &rules)
    }

    /// The inputs of the network, as a file describes them.
    fn observation(&self, problem: &Problem<'_>) -> Result<Vec<ObservationEntry>> {
        let history = History::new(problem)?;
        Ok(vec![
            ObservationEntry {
                name: format!("entries of {} marks", history.marks()),
                len: history.entries(),
            },
            ObservationEntry {
                name: "masks".into(),
                len: history.masks(),
            },
        ])
    }

    /// Why a file cannot be used, if it cannot.
    fn misfit(&self, problem: &Problem<'_>, saved: &Saved) -> Result<Option<String>> {
        let observation = self.observation(problem)?;
        let d = &saved.description;
        if let Some(why) = d.misfit(NAME, problem, &observation) {
            return Ok(Some(why));
        }
        if d.explorer != self.explorer {
            return Ok(Some(format!(
                "learned from episodes of `{}`, not of `{}` (setting `explorer`)",
                d.explorer, self.explorer
            )));
        }
        let prior =
            |all: &[Parameter]| -> Vec<_> { all.iter().map(|p| (p.range, p.scale)).collect() };
        if prior(&d.parameters) != prior(problem.parameters) {
            return Ok(Some("learned under another prior".into()));
        }
        Ok(None)
    }

    /// The network: from a file, from the program, or trained now.
    fn obtain(&self, problem: &Problem<'_>) -> Result<Arc<Saved>> {
        if is_file(&self.network) {
            let saved = Saved::load(Path::new(&self.network))?;
            return match self.misfit(problem, &saved)? {
                None => Ok(Arc::new(saved)),
                Some(why) => Err(Error::Config {
                    key: "identifier.network".into(),
                    message: format!("{} {why}", self.network),
                }),
            };
        }
        let mut why = "training is asked for".to_owned();
        if self.network != TRAIN {
            let name = shipped_name(&self.explorer);
            why = "none ships for this task and explorer".into();
            if let Some(saved) = from_program(problem.task.name(), &name)? {
                let misfit = self.misfit(problem, &saved)?;
                match misfit.or_else(|| other_readings(problem)) {
                    None => return Ok(Arc::new(saved)),
                    Some(misfit) => why = format!("the one that ships {misfit}"),
                }
            }
        }
        if let Some(saved) = self.cache.get()
            && self.misfit(problem, &saved)?.is_none()
        {
            return Ok(saved);
        }
        if self.network == SHIPPED || !can_train() {
            return Err(self.missing(problem, &why));
        }
        let settings = problem.task.settings("explorer", &self.explorer);
        let entry = find::<ExplorerEntry>(&self.explorer)?;
        let explorer = (entry.make)(&merged((entry.defaults)(), settings))?;
        let saved = Arc::new(self.learn(problem, &*explorer)?.0);
        self.cache.keep(&saved);
        Ok(saved)
    }

    fn missing(&self, problem: &Problem<'_>, why: &str) -> Error {
        let (task, explorer) = (problem.task.name(), &self.explorer);
        Error::Missing {
            what: format!("a trained estimator for `{task}` explored by `{explorer}`"),
            message: format!(
                "{why}; name a file with --set identifier.network=FILE, or train one with a build that can \
                 (`cargo xtask setup`, `--features torch`): \
                 `asid identify {task} --identifier estimator --explorer {explorer} --train FILE`"
            ),
        }
    }
}

/// Merges settings over defaults, one level deep.
fn merged(mut defaults: Settings, over: Settings) -> Settings {
    defaults.extend(over);
    defaults
}

impl Identifier for Estimator {
    fn identify(&self, problem: &Problem<'_>, episodes: &[Episode]) -> Result<Identified> {
        let saved = self.obtain(problem)?;
        let history = History::new(problem)?;
        let inference = Inference::from_tensors(
            NETWORK,
            &saved.tensors,
            history.entries(),
            history.masks(),
            problem.parameters,
        )
        .map_err(|why| Error::Failed(format!("the estimator {why}")))?;
        let beliefs = episodes
            .iter()
            .map(|e| inference.beliefs(&history.of_episode(problem, e)))
            .reduce(|a, b| a.into_iter().zip(b).map(|(a, b)| a.and(b)).collect())
            .ok_or_else(|| Error::Failed("there is no episode to identify from".into()))?;
        let mut rng = problem.streams.stream("estimator posterior");
        let samples: Vec<Vec<f64>> = (0..self.samples)
            .map(|_| {
                let all = beliefs.iter().zip(problem.parameters);
                all.map(|(b, p)| p.from_scaled(b.sample(&mut rng)))
                    .collect()
            })
            .collect();
        let (starts, residual) = replayed(problem, episodes, &beliefs)?;
        Ok(Identified {
            posterior: Posterior::from_samples(
                problem.parameters,
                samples,
                &vec![1.0; self.samples],
            ),
            starts,
            iterations: Vec::new(),
            residual,
            misfit: None,
            roughness: 0.0,
        })
    }

    fn train(&self, problem: &Problem<'_>, explorer: &dyn Explorer, file: &Path) -> Result<bool> {
        let (saved, events) = self.learn(problem, explorer)?;
        saved.save(file)?;
        write_atomically(&events_of(file), &encode(&events))?;
        Ok(true)
    }
}

/// Start pose of each episode as its first complete reading shows it, and the residual of a replay.
///
/// The residual is the root mean square of the whitened residual at the means: the estimator itself
/// has none.
fn replayed(
    problem: &Problem<'_>,
    episodes: &[Episode],
    beliefs: &[Belief],
) -> Result<(Vec<Vec<f64>>, f64)> {
    let mut likelihood = Likelihood::new(problem, episodes, 1)?;
    let held: Vec<Option<f64>> = beliefs
        .iter()
        .map(|b| match b {
            Belief::Binary { logit } => Some(f64::from(u8::from(*logit > 0.0))),
            Belief::Gaussian { .. } => None,
        })
        .collect();
    likelihood.hold(&held);
    let mut point: Vec<f64> = beliefs
        .iter()
        .filter(|b| matches!(b, Belief::Gaussian { .. }))
        .map(|b| b.mean())
        .collect();
    point.resize(likelihood.dimension(), 0.0);
    let starts = (0..episodes.len())
        .map(|k| likelihood.start(&point, k))
        .collect();
    let residual = likelihood.residuals(&[point])?.pop().flatten();
    let present = likelihood.present().max(1) as f64;
    let square: f64 = residual.map_or(f64::NAN, |r| r.iter().map(|x| x * x).sum());
    Ok((starts, (square / present).sqrt()))
}

#[cfg(test)]
mod tests {
    use asid_core::registry::IdentifierEntry;

    use super::*;
    use crate::file::{Description, Tensors};
    use crate::network::{Layer, Network};
    use crate::testing::with_problem;

    /// A network for rod balancing with constant `outputs`.
    fn constant(problem: &Problem<'_>, outputs: [f32; 2]) -> Saved {
        let estimator = Estimator::default();
        let history = History::new(problem).unwrap();
        let layer = Layer {
            weight: vec![0.0; 2 * history.len()],
            bias: outputs.to_vec(),
        };
        let scales = (vec![0.0; history.entries()], vec![1.0; history.entries()]);
        let network = Network {
            layers: vec![layer],
        };
        let inference = Inference::new(scales, network, problem.parameters);
        let mut tensors = Tensors::new();
        inference.to_tensors(NETWORK, &mut tensors);
        Saved {
            description: Description {
                explorer: "random".into(),
                observation: estimator.observation(problem).unwrap(),
                ..Description::new(NAME, problem, serde_json::Value::Null)
            },
            tensors,
        }
    }

    fn episode(problem: &Problem<'_>) -> Episode {
        use asid_core::RealWorld as _;
        let random = (find::<ExplorerEntry>("random").unwrap().make)(&Settings::new()).unwrap();
        let mut explored = random.explore(problem, None).unwrap();
        let mut world = asid_worlds::SimulatedWorld::new(
            problem.task,
            problem.model,
            problem.parameters,
            &[0.05],
            problem.signals,
            problem.streams.child("world"),
        )
        .unwrap();
        world.explore(&mut *explored.policy).unwrap().episode
    }

    /// Outputs 0 and 0 mean a mean of 0 and a standard deviation of 1. In the truncated Gaussian 95
    /// % lie within 1.516 of 0 (Phi(1.516) - 1/2 = 0.95 (Phi(b) - 1/2)); for the prior this is
    /// 1.645.
    #[test]
    fn a_file_gives_a_posterior_without_a_library_of_networks() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("estimator.safetensors");
        with_problem("rod-balancing", |problem| {
            constant(problem, [0.0, 0.0]).save(&path).unwrap();
            let estimator = Estimator {
                network: path.display().to_string(),
                explorer: "random".into(),
                samples: 20_000,
                ..Estimator::default()
            };
            let mut log = episode(problem);
            // Readings may be missing; the first complete row gives the start pose of the rod.
            let width = log.width();
            log.readings[3 * width..5 * width].fill(f64::NAN);
            let found = estimator.identify(problem, &[log]).unwrap();
            let marginal = &found.posterior.marginals[0];
            let bound = problem.parameters[0].from_scaled(1.516);
            assert!(
                (marginal.interval95[1] - bound).abs() < 0.02 * bound,
                "{marginal:?}"
            );
            assert!(marginal.estimate.abs() < 0.02 * bound);
            assert_eq!(found.starts.len(), 1);
            assert!(found.residual.is_finite());
        });
    }

    #[test]
    fn a_network_of_other_episodes_is_refused_and_a_missing_one_says_how_to_get_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("estimator.safetensors");
        with_problem("rod-balancing", |problem| {
            constant(problem, [0.0, 0.0]).save(&path).unwrap();
            let log = episode(problem);
            let message = |estimator: Estimator| {
                let found = estimator.identify(problem, std::slice::from_ref(&log));
                found.unwrap_err().to_string()
            };
            let other = message(Estimator {
                network: path.display().to_string(),
                explorer: "maxmi".into(),
                ..Estimator::default()
            });
            assert!(other.contains("learned from episodes of `random`, not of `maxmi`"));
            let none = message(Estimator {
                explorer: "random".into(),
                ..Estimator::default()
            });
            for part in [
                "random",
                "--features torch",
                "--train FILE",
                "identifier.network",
            ] {
                assert!(none.contains(part), "{none}");
            }
        });
    }

    #[test]
    fn wrong_settings_are_named() {
        let make = find::<IdentifierEntry>("estimator").unwrap().make;
        for (text, key) in [
            ("episodes = 3", "identifier.episodes"),
            ("missing = 1.0", "identifier.missing"),
            ("hidden = [0]", "identifier.hidden"),
        ] {
            let message = make(&text.parse().unwrap()).err().unwrap().to_string();
            assert!(message.contains(key), "{message}");
        }
    }
}
