//! Obtains the network to play: from a file, from those that ship with the program, or from a
//! training.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use asid_core::explore::{CurvePoint, Explored};
use asid_core::registry::{self, Settings};
use asid_core::{Error, Problem, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::file::{Description, ObservationEntry, Saved, Tensor, Tensors, write_atomically};
use crate::shipped;
use crate::tensorboard::{Scalars, encode};

/// Value of the setting `policy` that trains anew even where a policy ships.
pub const TRAIN: &str = "train";

/// Value of the setting `policy` that plays the shipped policy and never trains: for comparisons,
/// where otherwise every run would train.
pub const SHIPPED: &str = "shipped";

/// Name of the tensor that holds the learning curve, `points x (x, mean, std)`.
const CURVE: &str = "curve";

/// Result of a training.
pub struct Training {
    /// The networks.
    pub tensors: Tensors,
    /// Inputs of the policy.
    pub observation: Vec<ObservationEntry>,
    /// Number of simulated control steps.
    pub steps: u64,
    /// Figures of the training by name.
    pub figures: Vec<(&'static str, f64)>,
    /// Return over the course of the training.
    pub curve: Vec<CurvePoint>,
    /// The curve and further values, for TensorBoard.
    pub events: Vec<Scalars>,
}

/// Trains an explorer; crates that can train submit one through `inventory`.
pub struct Trainer {
    /// Name of the explorer.
    pub algorithm: &'static str,
    /// Trains with all of the explorer's settings.
    pub train: fn(&Problem<'_>, &Settings) -> Result<Training>,
}

inventory::collect!(Trainer);

/// Whether this program can train the explorer `algorithm`.
#[must_use]
pub fn can_train(algorithm: &str) -> bool {
    inventory::iter::<Trainer>().any(|t| t.algorithm == algorithm)
}

/// An explorer that plays a learned policy.
///
/// `learned_explorer!` implements [`asid_core::Explorer`] for it and registers it.
pub trait LearnedExplorer: Serialize + DeserializeOwned + Default + PartialEq + Clone {
    /// Name on the command line.
    const NAME: &'static str;
    /// The setting `policy`: a file, `train`, `shipped`, or empty.
    fn policy(&self) -> &str;
    /// Sets the setting `policy`.
    fn set_policy(&mut self, policy: &str);
    /// Checks every setting.
    ///
    /// # Errors
    /// [`Error::Config`] names the first that is out of its domain.
    fn check(&self) -> Result<()>;
    /// Inputs of the policy on a problem.
    ///
    /// # Errors
    /// When the scene lacks a channel of the protocol.
    fn observation(&self, problem: &Problem<'_>) -> Result<Vec<ObservationEntry>>;
    /// Cache of the policy that was trained on the spot.
    fn cache(&self) -> &Cache;
    /// Plays a learned policy.
    ///
    /// # Errors
    /// When the policy does not fit the problem.
    fn play<'a>(&'a self, problem: &'a Problem<'a>, saved: Arc<Saved>) -> Result<Explored<'a>>;
}

/// Implements [`asid_core::Explorer`] for a [`LearnedExplorer`] and registers it.
macro_rules! learned_explorer {
    ($explorer:ty, $about:expr) => {
        asid_core::register!(ExplorerEntry {
            name: <$explorer as $crate::learning::LearnedExplorer>::NAME,
            about: $about,
            defaults: asid_core::registry::defaults::<$explorer>,
            meanings: asid_core::registry::meanings::<$explorer>,
            make: |settings| {
                let explorer: $explorer = asid_core::registry::settings("explorer", settings)?;
                $crate::learning::LearnedExplorer::check(&explorer)?;
                Ok(Box::new(explorer))
            },
        });

        impl asid_core::Explorer for $explorer {
            fn explore<'a>(
                &'a self,
                problem: &'a asid_core::Problem<'a>,
                _start: Option<&[f64]>,
            ) -> asid_core::Result<asid_core::explore::Explored<'a>> {
                let saved = $crate::learning::obtain(self, problem)?;
                $crate::learning::LearnedExplorer::play(self, problem, saved)
            }

            fn train(
                &self,
                problem: &asid_core::Problem<'_>,
                file: &std::path::Path,
            ) -> asid_core::Result<bool> {
                $crate::learning::train_to_file(self, problem, file)
            }
        }
    };
}
pub(crate) use learned_explorer;

/// Policy that was trained on the spot, kept for further episodes of the same explorer.
#[derive(Debug, Default)]
pub struct Cache(Mutex<Option<Arc<Saved>>>);

impl Clone for Cache {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl PartialEq for Cache {
    /// Always equal: the cache is no setting.
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Cache {
    pub(crate) fn get(&self) -> Option<Arc<Saved>> {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.clone()
    }

    pub(crate) fn keep(&self, saved: &Arc<Saved>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::clone(saved));
    }
}

/// Obtains the policy that an explorer plays on a problem.
///
/// It comes from the file that the setting `policy` names. If that is empty and the settings are
/// the task's own, it is the one that ships. Otherwise it is trained now.
///
/// # Errors
/// [`Error::Config`] where the file does not fit the problem, [`Error::Missing`] where there is no
/// policy and this program cannot train.
pub fn obtain<L: LearnedExplorer>(explorer: &L, problem: &Problem<'_>) -> Result<Arc<Saved>> {
    let cache = explorer.cache();
    let observation = explorer.observation(problem)?;
    let misfit = |saved: &Saved| saved.description.misfit(L::NAME, problem, &observation);
    let policy = explorer.policy();
    if is_file(policy) {
        let saved = Saved::load(Path::new(policy))?;
        return match misfit(&saved) {
            None => Ok(Arc::new(saved)),
            Some(why) => Err(Error::Config {
                key: "explorer.policy".into(),
                message: format!("{policy} {why}"),
            }),
        };
    }
    let mut refused = None;
    if policy != TRAIN && has_own_settings(explorer, problem)? {
        match from_program(problem.task.name(), L::NAME)? {
            Some(saved) => match misfit(&saved) {
                None => return Ok(Arc::new(saved)),
                Some(why) => refused = Some(why),
            },
            None => refused = Some("is none".to_owned()),
        }
    }
    if let Some(saved) = cache.get().filter(|s| misfit(s).is_none()) {
        return Ok(saved);
    }
    if policy == SHIPPED || !can_train(L::NAME) {
        let why = match refused {
            Some(why) => format!("what ships for this task {why}"),
            None if policy == TRAIN => "training is asked for".to_owned(),
            None => "what ships is for the task's own settings".to_owned(),
        };
        return Err(missing(problem.task.name(), L::NAME, &why));
    }
    let saved = Arc::new(train(explorer, problem)?.0);
    cache.keep(&saved);
    Ok(saved)
}

/// Whether a setting names a file.
pub(crate) fn is_file(setting: &str) -> bool {
    !["", TRAIN, SHIPPED].contains(&setting)
}

/// Reads the file that ships for a task under a name.
///
/// # Errors
/// When the file cannot be read, which is a defect of the program.
pub fn from_program(task: &str, name: &str) -> Result<Option<Saved>> {
    let Some(file) = shipped::find(task, name) else {
        return Ok(None);
    };
    Saved::from_bytes(file.bytes)
        .map(Some)
        .map_err(|why| Error::Failed(format!("what ships as {task}/{name} {why}")))
}

/// The learning curve stored in a file.
#[must_use]
pub fn curve(saved: &Saved) -> Vec<CurvePoint> {
    let rows = saved.tensors.get(CURVE).map(|t| t.values.chunks_exact(3));
    rows.into_iter()
        .flatten()
        .map(|row| CurvePoint {
            x: f64::from(row[0]),
            mean: f64::from(row[1]),
            std: f64::from(row[2]),
        })
        .collect()
}

/// Trains an explorer; writes the file and its curves beside it.
///
/// # Errors
/// [`Error::Missing`] where this program cannot train, those of the training, and
/// [`Error::File`] where a file cannot be written.
pub fn train_to_file<L: LearnedExplorer>(
    explorer: &L,
    problem: &Problem<'_>,
    file: &Path,
) -> Result<bool> {
    let (saved, events) = train(explorer, problem)?;
    saved.save(file)?;
    write_atomically(&events_of(file), &encode(&events))?;
    Ok(true)
}

/// Path of the curves of a file, in their own folder: TensorBoard treats a folder as one run.
#[must_use]
pub fn events_of(file: &Path) -> PathBuf {
    file.with_extension("tensorboard")
        .join("events.out.tfevents.0.asid")
}

/// Runs one training; returns the file with its description, and the events.
fn train<L: LearnedExplorer>(explorer: &L, problem: &Problem<'_>) -> Result<(Saved, Vec<Scalars>)> {
    let trainer = inventory::iter::<Trainer>().find(|t| t.algorithm == L::NAME);
    let Some(trainer) = trainer else {
        return Err(missing(
            problem.task.name(),
            L::NAME,
            "training is asked for",
        ));
    };
    let mut settings = explorer.clone();
    settings.set_policy("");
    let text = |e: &dyn std::fmt::Display| Error::Failed(format!("settings: {e}"));
    let table = Settings::try_from(&settings).map_err(|e| text(&e))?;
    let clock = Instant::now();
    let training = (trainer.train)(problem, &table)?;
    let settings = serde_json::to_value(&settings).map_err(|e| text(&e))?;
    let mut tensors = training.tensors;
    let points = training.curve.iter();
    tensors.insert(
        CURVE.to_owned(),
        Tensor {
            shape: vec![training.curve.len(), 3],
            values: points
                .flat_map(|p| [p.x as f32, p.mean as f32, p.std as f32])
                .collect(),
        },
    );
    let figures = training.figures.into_iter().filter(|f| f.1.is_finite());
    let saved = Saved {
        description: Description {
            observation: training.observation,
            training_steps: training.steps,
            seconds: clock.elapsed().as_secs_f64(),
            figures: figures.map(|(n, x)| (n.to_owned(), x)).collect(),
            ..Description::new(L::NAME, problem, settings)
        },
        tensors,
    };
    Ok((saved, training.events))
}

/// Whether an explorer's settings are the defaults that the task gives it.
fn has_own_settings<L: LearnedExplorer>(explorer: &L, problem: &Problem<'_>) -> Result<bool> {
    let mut table = registry::defaults::<L>();
    overlay(&mut table, problem.task.settings("explorer", L::NAME));
    let mut own: L = registry::settings("explorer", &table)?;
    own.set_policy("");
    let mut given = explorer.clone();
    given.set_policy("");
    Ok(own == given)
}

/// Overlays one table on another, recursively.
fn overlay(into: &mut Settings, from: Settings) {
    for (key, value) in from {
        match (into.get_mut(&key), value) {
            (Some(toml::Value::Table(a)), toml::Value::Table(b)) => overlay(a, b),
            (_, value) => {
                into.insert(key, value);
            }
        }
    }
}

/// Error that there is no policy to play, with the ways to get one.
fn missing(task: &str, name: &str, why: &str) -> Error {
    Error::Missing {
        what: format!("a trained policy of `{name}` for `{task}`"),
        message: format!(
            "{why}; name a file with --policy FILE (setting `policy`), or train one with a build that can \
             (`cargo xtask setup`, `--features torch`): `asid explore {task} --explorer {name} --train FILE`"
        ),
    }
}
