//! The settings of a diagnosis.

mod checks;
mod search;
mod study;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::Capabilities;
use asid_core::registry::{self, BackendEntry, TaskEntry, find};
use asid_diagnosis::diagnose::Settings;
use asid_diagnosis::settings::{Breadth, FALSE_ALARMS};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::options::Common;
use super::super::plugins::{file_of, recorded, used};
use super::super::settings::{difficulty, given, parsed, wrong};
use super::Arguments;
use search::SearchConfig;

pub use study::Logs;

/// `config.toml` of a diagnosis.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// The study that is diagnosed: a TOML file, or a folder with study.toml.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub study: Option<PathBuf>,
    /// The task that is diagnosed in place of a study.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub task: Option<String>,
    /// The model in place of the task's scene or of the study's own: MJCF, or a refined model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<PathBuf>,
    /// Logs of the task that are fitted to.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub train: Vec<PathBuf>,
    /// Logs of the task that are held out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub test: Vec<PathBuf>,
    /// The engine: see `asid list`.
    #[serde(default = "default_backend")]
    pub backend: String,
    /// Seed of all random numbers.
    #[serde(default)]
    pub seed: u64,
    /// How hard the task is, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    difficulty: BTreeMap<String, f64>,
    /// A preset of it.
    #[serde(default, skip_serializing)]
    #[expect(dead_code, reason = "read with the difficulty")]
    preset: Option<String>,
    /// Runs of a task whose logs are diagnosed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub runs: Option<usize>,
    /// Episodes that are then played to tell rivals apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub experiments: Option<usize>,
    /// Which of their logs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub logs: Option<RunLogs>,
    /// Seeds that the task is tried with, before and after.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seeds: Option<u64>,
    /// Time limit, minutes: it answers by then with what is known, and lists what was not tried.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub minutes: Option<f64>,
    /// Whether the diagnosis is repeated on simulated logs, for as long as `minutes` allows.
    #[serde(default)]
    calibrate: bool,
    /// Probability at which chance may accuse a machine that lacks nothing; a larger one finds
    /// smaller effects.
    #[serde(default = "false_alarms")]
    false_alarms: f64,
    /// Effects of the catalogue that are left out, by name.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    without: Vec<String>,
    /// Plugins that are loaded first, with the SHA-256 of each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    plugins: Vec<PathBuf>,
    /// How widely effects are searched.
    #[serde(default)]
    search: SearchConfig,
}

/// Logs of a run of a task.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum RunLogs {
    /// Of exploration.
    Exploration,
    /// Of the attempt at the task.
    Attempt,
    /// Both.
    #[default]
    Both,
}

impl RunLogs {
    /// Whether it includes logs of exploration.
    pub fn exploration(self) -> bool {
        self != Self::Attempt
    }

    /// Whether it includes logs of the attempt.
    pub fn attempt(self) -> bool {
        self != Self::Exploration
    }
}

/// Keys of the diagnosis itself. Where a task is run, all other keys belong to that run.
const OWN: [&str; 19] = [
    "study",
    "task",
    "model",
    "train",
    "test",
    "backend",
    "seed",
    "runs",
    "experiments",
    "logs",
    "seeds",
    "minutes",
    "calibrate",
    "false_alarms",
    "without",
    "plugins",
    "search",
    "difficulty",
    "preset",
];

/// Default time limit, min. Most machines have their whole answer within a minute. A user who still
/// waits prefers the partial result.
pub const MINUTES: f64 = 1.5;

/// Default rate of false alarms.
fn false_alarms() -> f64 {
    FALSE_ALARMS
}

impl Config {
    /// The settings of a study from the configuration file and `--set` alone.
    pub fn of_study(study: &Path, common: &Common) -> Result<Self> {
        let mut config = parsed::<Self>(given(common)?)?;
        config.study = Some(study.to_owned());
        if let Some(name) = &common.backend {
            config.backend.clone_from(name);
        }
        config.minutes = config.minutes.or(Some(MINUTES));
        Ok(config)
    }

    /// The settings from the configuration file, `--set` and the command line, in rising
    /// precedence.
    ///
    /// Where the task is to be run, the settings of its runs are returned separately.
    pub fn resolve(arguments: &Arguments) -> Result<(Self, Option<toml::Table>)> {
        let common = &arguments.common;
        let mut table = given(common)?;
        let mut of_run = toml::Table::new();
        let runs_task = arguments.runs_task(&table);
        let keeps_logs = arguments.keeps_logs_of(&table);
        if runs_task {
            let others: Vec<String> = table
                .keys()
                .filter(|k| !OWN.contains(&k.as_str()))
                .cloned()
                .collect();
            for key in others {
                of_run.extend(table.remove_entry(&key));
            }
        }
        let mut config: Self = parsed(table)?;
        if arguments.study.is_some() || arguments.task.is_some() {
            config.study.clone_from(&arguments.study);
            config.task.clone_from(&arguments.task);
        }
        if !keeps_logs {
            config.train.clone_from(&arguments.train);
            config.test.clone_from(&arguments.test);
        }
        if let Some(model) = &arguments.worlds.simulator.model {
            config.model = Some(model.clone());
        }
        if let Some(name) = &common.backend {
            config.backend.clone_from(name);
        }
        config.seed = common.seed.unwrap_or(config.seed);
        config.difficulty = match &config.task {
            Some(name) => difficulty::levels(&*(find::<TaskEntry>(name)?.make)()?, common)?,
            None => BTreeMap::new(),
        };
        if !config.difficulty.is_empty() {
            let levels = toml::Table::try_from(&config.difficulty)?;
            of_run.insert("difficulty".into(), levels.into());
        }
        // The loaded plugins include those that the file names.
        config.plugins = recorded(used(&[file_of::<BackendEntry>(&config.backend)]));
        config.runs = arguments.runs.or(config.runs);
        config.experiments = arguments.experiments.or(config.experiments);
        config.seeds = arguments.seeds.or(config.seeds);
        config.minutes = arguments.minutes.or(config.minutes).or(Some(MINUTES));
        config.false_alarms = arguments.false_alarms.unwrap_or(config.false_alarms);
        config.calibrate |= arguments.calibrate;
        config.without.extend(arguments.without.iter().cloned());
        config.check(arguments)?;
        if runs_task {
            config.runs.get_or_insert(RUNS);
            config.logs.get_or_insert_default();
            config.seeds.get_or_insert(SEEDS);
            if config.train.is_empty() && config.runs.unwrap_or(RUNS) < 2 {
                return Err(wrong(
                    "--runs",
                    "at least 2: one to fit to and one to hold out",
                ));
            }
        } else {
            config.refuse_runs(arguments)?;
        }
        Ok((config, runs_task.then_some(of_run)))
    }

    /// The settings of the diagnosis itself.
    pub fn settings(&self) -> Settings {
        Settings {
            breadth: Breadth {
                seed: self.seed,
                false_alarms: self.false_alarms,
                ..self.search.breadth()
            },
            without: self.without.clone(),
            calibrate: self.calibrate,
        }
    }
}

/// Default number of runs whose logs are diagnosed: four to fit, two held out.
const RUNS: usize = 6;
/// Default number of seeds with which the task is tried.
const SEEDS: u64 = 5;

/// The default engine: the first built-in one with double precision, else the first.
///
/// In double precision, replays of logs are smooth in every parameter.
pub fn default_backend() -> String {
    let all = registry::all::<BackendEntry>();
    let double = |entry: &&&BackendEntry| {
        let made = (entry.make)();
        made.is_ok_and(|b| b.capabilities().contains(Capabilities::DOUBLE_PRECISION))
    };
    let found = all.iter().find(double).or(all.first());
    found.map_or_else(String::new, |e| e.name.to_owned())
}
