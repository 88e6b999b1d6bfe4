//! The settings of a command, resolved into one record that repeats the run.
//!
//! The defaults are overridden by the configuration file, then by `--set`, then by the options.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::registry::IdentifierEntry;
use asid_core::task::Condition;
use asid_core::{Error, Parameter, Task, registry};
use asid_effects::EffectSpec;
use asid_effects::refined_model::RefinedModel;
use asid_worlds::{MODEL_ERRORS, ModelErrors, WorldKind};
use schemars::JsonSchema;
use serde::Serialize;

use super::options::{Algorithms, Common, Worlds};
use super::plugins::{file_of, recorded, used};
use component::{Component, component};
use expected::ExpectedConfig;
pub use real::RealConfig;
pub use stage::Stage;
use stage::start;
use table::section;
pub use table::{configured, given, parsed, read, read_table, seed, set, text, texts, wrong};
pub use unknowns::ParameterConfig;
use unknowns::{noise, unknowns};

mod component;
pub mod difficulty;
mod expected;
mod real;
mod stage;
mod table;
mod unknowns;

/// Everything that decides the result of a command.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Config {
    /// What it was resolved for.
    #[serde(skip_serializing_if = "Stage::is_run")]
    #[schemars(with = "String")]
    pub command: Stage,
    /// The task's name.
    pub task: String,
    /// Engine of the simulator.
    pub backend: String,
    /// Model file of the simulator, MJCF or TOML; empty for the task's scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<PathBuf>,
    /// Condition of the task; `prior` for the whole prior.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub condition: Option<String>,
    /// Seed.
    pub seed: u64,
    /// Files of the plugins that it needs, each with its hash: `FILE#sha256=HEX`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub plugins: Vec<PathBuf>,
    /// Start pose of the object by coordinate, for a stage that is told it.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub start: BTreeMap<String, f64>,
    /// Coordinates of the start pose that were not given and took the middle of their range.
    #[serde(skip)]
    pub assumed: Vec<String>,
    /// The explorer: which episode is played in the real world.
    #[schemars(with = "()")]
    pub explorer: Component,
    /// The identifier: what the unknowns are, given that episode.
    #[schemars(with = "()")]
    pub identifier: Component,
    /// The solver: which action achieves the task.
    #[schemars(with = "()")]
    pub solver: Component,
    /// How the expected deviations of a run are computed.
    pub expected: ExpectedConfig,
    /// Errors of the simulator that identification takes into account.
    pub model_errors: ModelErrors,
    /// Whether the settings say how many models there are.
    #[serde(skip)]
    pub members_given: bool,
    /// Real world.
    pub real: RealConfig,
    /// How hard the task is, by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub difficulty: BTreeMap<String, f64>,
    /// Noise of each tracked sensor, in its unit.
    pub noise: BTreeMap<String, f64>,
    /// The unknowns, by name.
    pub parameter: BTreeMap<String, ParameterConfig>,
}

/// Keys at the top of a configuration.
const KEYS: [&str; 19] = [
    "schema",
    "command",
    "task",
    "backend",
    "model",
    "condition",
    "seed",
    "plugins",
    "start",
    "explorer",
    "identifier",
    "solver",
    "expected",
    MODEL_ERRORS,
    "real",
    "preset",
    "difficulty",
    "noise",
    "parameter",
];

/// Algorithms that are used by default.
pub struct Defaults {
    /// Explorer.
    pub explorer: &'static str,
    /// Identifier.
    pub identifier: &'static str,
    /// Solver.
    pub solver: &'static str,
}

/// The method that performs best in measurements, `asid`.
pub const ASID: Defaults = Defaults {
    explorer: "fisher-cem",
    identifier: "reps",
    solver: "cem",
};

impl Config {
    /// Resolves the settings of a task for a stage, and the unknowns that follow from them.
    ///
    /// The difficulty of the task is that of [`difficulty::levels`].
    pub fn resolve(
        stage: Stage,
        task: &dyn Task,
        common: &Common,
        algorithms: &Algorithms,
        worlds: &Worlds,
    ) -> Result<(Self, Vec<Parameter>)> {
        let Worlds { simulator, real } = worlds;
        let table = table_of(stage, task, common)?;
        let backend = match (&common.backend, text(&table, "backend")?) {
            (Some(name), _) => name.clone(),
            (None, Some(name)) => name,
            (None, None) => default_backend(),
        };
        let condition = text(&table, "condition")?;
        if let Some(name) = &condition {
            check_condition(&task.conditions(), name)?;
        }
        let (parameter, parameters) = unknowns(task, &section(&table, "parameter")?)?;
        let model = model_file(&simulator.model, &table)?;
        let own_model = model.is_some() || simulator.refined.is_some();
        let section_real = section(&table, "real")?;
        let simulator = (&*backend, own_model);
        let real = real::resolve(&section_real, real, task, &parameters, simulator)?;
        let model_errors = section(&table, MODEL_ERRORS)?;
        let (start, assumed) = start(stage, task, &section(&table, "start")?)?;
        let mut config = Self {
            command: stage,
            task: task.name().to_owned(),
            model,
            condition,
            seed: common.seed.or(seed(&table)?).unwrap_or(0),
            plugins: Vec::new(),
            start,
            assumed,
            explorer: with_policy(
                component::<dyn asid_core::Explorer>(
                    task,
                    &table,
                    "explorer",
                    algorithms.explorer.as_deref(),
                    ASID.explorer,
                )?,
                algorithms.policy.as_deref(),
            )?,
            identifier: component::<dyn asid_core::Identifier>(
                task,
                &table,
                "identifier",
                algorithms.identifier.as_deref(),
                ASID.identifier,
            )?,
            solver: component::<dyn asid_core::TaskSolver>(
                task,
                &table,
                "solver",
                algorithms.solver.as_deref(),
                ASID.solver,
            )?,
            expected: ExpectedConfig::of(&table)?,
            model_errors: ModelErrors::read(&model_errors)?,
            members_given: model_errors.contains_key("members"),
            real,
            difficulty: difficulty::levels(task, common)?,
            noise: noise(task, &section(&table, "noise")?)?,
            backend,
            parameter,
        };
        config.plugins = config.used_plugins();
        let given = section(&table, "identifier")?;
        config.learn_from_explorer(&given);
        config.expect_model_errors()?;
        config.weigh_jointly_in_an_ensemble(&given);
        Ok((config, parameters))
    }

    /// Lets the method identify in several models where its simulator is not the real world: in a
    /// world that deviates by chance, and from logs, which come from anywhere. Only identifiers that
    /// measure the scatter that models cause do so, and only unless the settings say otherwise.
    ///
    /// In a custom world the differences are those that the user named.
    fn expect_model_errors(&mut self) -> Result<()> {
        let deviates = match self.command {
            Stage::Run => !matches!(self.real.world, WorldKind::Matched | WorldKind::Custom),
            Stage::Identify => true,
            Stage::Explore | Stage::Solve => false,
        };
        if deviates && !self.members_given {
            let Component { name, settings } = &self.identifier;
            let identifier = (registry::find::<IdentifierEntry>(name)?.make)(settings)?;
            if identifier.assumes().scatter {
                self.model_errors.members = ModelErrors::USUAL_MEMBERS;
            }
        }
        Ok(())
    }

    /// Lets an identifier that simulates in several models weigh readings by the whole covariance of
    /// their scatter, unless the settings say otherwise: an error of a model moves all readings after
    /// a contact together.
    fn weigh_jointly_in_an_ensemble(&mut self, given: &toml::Table) {
        let given = given.get("sampling").and_then(toml::Value::as_table);
        let is_given = given.is_some_and(|sampling| sampling.contains_key("correlated"));
        if self.model_errors.members > 0
            && !is_given
            && let Some(sampling) = self.identifier.settings.get_mut("sampling")
            && let Some(correlated) = sampling.get_mut("correlated")
        {
            *correlated = true.into();
        }
    }

    /// Lets an identifier that learns from an explorer's episodes learn from this run's explorer,
    /// unless the settings name another.
    fn learn_from_explorer(&mut self, given: &toml::Table) {
        if self.command == Stage::Run
            && !given.contains_key("explorer")
            && let Some(setting) = self.identifier.settings.get_mut("explorer")
        {
            *setting = self.explorer.name.clone().into();
        }
    }

    /// Files of plugins that were named, or that provide parts named in the settings.
    fn used_plugins(&self) -> Vec<PathBuf> {
        use asid_effects::EffectEntry;
        use registry::{BackendEntry, ExplorerEntry, IdentifierEntry, SolverEntry, TaskEntry};
        let mut files = vec![
            file_of::<TaskEntry>(&self.task),
            file_of::<BackendEntry>(&self.backend),
            file_of::<BackendEntry>(&self.real.backend),
            file_of::<ExplorerEntry>(&self.explorer.name),
            file_of::<IdentifierEntry>(&self.identifier.name),
            file_of::<SolverEntry>(&self.solver.name),
        ];
        let effects = self.real.effects.iter();
        let specs = effects.filter_map(|text| text.parse::<EffectSpec>().ok());
        files.extend(specs.map(|spec| file_of::<EffectEntry>(&spec.name)));
        // A file that cannot be opened is reported where it is used.
        let models = [&self.model, &self.real.model].into_iter().flatten();
        for model in models.filter_map(|path| RefinedModel::open(path).ok()) {
            let names = model.effects.iter().map(|e| &e.name);
            files.extend(names.map(|name| file_of::<EffectEntry>(name)));
        }
        recorded(used(&files))
    }
}

/// The table of all settings of a task for a stage: the file's, then those of `--set`.
fn table_of(stage: Stage, task: &dyn Task, common: &Common) -> Result<toml::Table> {
    let mut table = configured(common)?;
    difficulty::forget_noise(task, &mut table)?;
    // A start pose of another stage does not apply to this one.
    if text(&table, "command")?.is_some_and(|c| c != stage.name()) {
        table.remove("start");
    }
    for assignment in &common.set {
        if assignment.trim_start().starts_with("plugins") {
            return Err(wrong("plugins", "is given by --plugin FILE, not by --set"));
        }
        set(&mut table, assignment)?;
    }
    for key in table.keys() {
        if !KEYS.contains(&key.as_str()) {
            return Err(Error::unknown("setting", key, KEYS).into());
        }
    }
    if let Some(name) = text(&table, "task")?
        && name != task.name()
    {
        return Err(wrong(
            "task",
            format!(
                "the configuration is for `{name}`, the command for `{}`",
                task.name()
            ),
        ));
    }
    Ok(table)
}

/// The explorer, with the file of `--policy`.
fn with_policy(mut explorer: Component, policy: Option<&Path>) -> Result<Component> {
    let Some(file) = policy else {
        return Ok(explorer);
    };
    let Some(setting) = explorer.settings.get_mut("policy") else {
        let message = format!("the explorer `{}` plays no trained policy", explorer.name);
        return Err(wrong("--policy", message));
    };
    *setting = file.display().to_string().into();
    Ok(explorer)
}

/// The condition whose truths are drawn from the whole prior; every task has it.
pub const PRIOR: &str = "prior";

/// Checks that a task has a condition of this name.
pub fn check_condition(all: &[Condition], name: &str) -> Result<()> {
    let known = || all.iter().map(|c| &*c.name).chain([PRIOR]);
    if known().any(|k| k == name) {
        return Ok(());
    }
    Err(Error::unknown("condition", name, known()).into())
}

/// The file of a model: the given one, else the one of a section.
fn model_file(given: &Option<PathBuf>, table: &toml::Table) -> Result<Option<PathBuf>> {
    let set = text(table, "model")?.map(PathBuf::from);
    Ok(given.clone().or(set))
}

/// Name of the default engine.
pub fn default_backend() -> String {
    registry::default_backend().map_or_else(String::new, |e| e.name.to_owned())
}
