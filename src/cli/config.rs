//! The settings of a command: defaults, then the configuration file, then
//! `--set`, then the options, resolved into one record that repeats the run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::parameter::{Parameter, Scale};
use asid_core::registry::{self, AlgorithmEntry, Entry, Settings};
use asid_core::task::Coordinate;
use asid_core::{Error, Target, Task};
use serde::{Deserialize, Serialize};

use super::options::{Algorithms, Common, Real};

/// What settings are resolved for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// The whole pipeline, or many of them.
    Run,
    /// Exploration alone.
    Explore,
    /// Identification alone.
    Identify,
    /// Solving alone.
    Solve,
}

impl Stage {
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Run => "run",
            Self::Explore => "explore",
            Self::Identify => "identify",
            Self::Solve => "solve",
        }
    }

    /// Coordinates of the start pose that the stage is told.
    pub fn start(self, task: &dyn Task) -> &[Coordinate] {
        match self {
            Self::Run | Self::Identify => &[],
            Self::Explore => &task.exploration().start,
            Self::Solve => &task.downstream().start,
        }
    }

    fn is_run(&self) -> bool {
        *self == Self::Run
    }
}

/// An algorithm by name, with its settings.
#[derive(Clone, Debug, Serialize)]
pub struct Component {
    /// Name in the registry.
    pub name: String,
    /// All settings, defaults filled in.
    #[serde(flatten)]
    pub settings: Settings,
}

/// The simulated real world.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RealConfig {
    /// Engine.
    pub backend: String,
    /// Model file; empty for the task's scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<PathBuf>,
    /// True values that were given; the others are drawn from the prior.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub truth: BTreeMap<String, f64>,
}

/// Everything that decides the result of a command.
#[derive(Clone, Debug, Serialize)]
pub struct Config {
    /// What it was resolved for.
    #[serde(skip_serializing_if = "Stage::is_run")]
    pub command: Stage,
    /// The task's name.
    pub task: String,
    /// Engine of the simulator.
    pub backend: String,
    /// Seed.
    pub seed: u64,
    /// Start pose of the object by coordinate, for a stage that is told it.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub start: BTreeMap<String, f64>,
    /// Coordinates of the start pose that were not given and took the middle of their range.
    #[serde(skip)]
    pub assumed: Vec<String>,
    /// Explorer.
    pub explorer: Component,
    /// Identifier.
    pub identifier: Component,
    /// Solver.
    pub solver: Component,
    /// Real world.
    pub real: RealConfig,
    /// Noise of each tracked sensor, in its unit.
    pub noise: BTreeMap<String, f64>,
    /// The unknowns, by name.
    pub parameter: BTreeMap<String, ParameterConfig>,
}

/// An unknown as it stands in a configuration.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterConfig {
    /// One target.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<Target>,
    /// Several targets that share the value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub targets: Option<Vec<Target>>,
    /// Smallest and largest value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
    /// Scale of the prior.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<Scale>,
    /// Unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Whether it is identified.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub enabled: Option<bool>,
}

/// Keys at the top of a configuration.
const KEYS: [&str; 12] = [
    "schema",
    "command",
    "task",
    "backend",
    "seed",
    "start",
    "explorer",
    "identifier",
    "solver",
    "real",
    "noise",
    "parameter",
];

/// Names that are used where nothing else is said.
pub struct Defaults {
    /// Explorer.
    pub explorer: &'static str,
    /// Identifier.
    pub identifier: &'static str,
    /// Solver.
    pub solver: &'static str,
}

/// The method that measures best, `asid`.
pub const ASID: Defaults = Defaults {
    explorer: "fisher-cem",
    identifier: "reps",
    solver: "cem",
};

fn wrong(key: &str, message: impl Into<String>) -> anyhow::Error {
    Error::Config {
        key: key.to_owned(),
        message: message.into(),
    }
    .into()
}

impl Config {
    /// Resolves the settings of a task for a stage, and the unknowns they make.
    pub fn resolve(
        stage: Stage,
        task: &dyn Task,
        common: &Common,
        algorithms: &Algorithms,
        real: &Real,
    ) -> Result<(Self, Vec<Parameter>)> {
        let mut table = match &common.config {
            Some(path) => read_table(path)?,
            None => toml::Table::new(),
        };
        // A start pose in the settings of one stage means nothing to another.
        if text(&table, "command")?.is_some_and(|c| c != stage.name()) {
            table.remove("start");
        }
        for assignment in &common.set {
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
        let backend = match (&common.backend, text(&table, "backend")?) {
            (Some(name), _) => name.clone(),
            (None, Some(name)) => name,
            (None, None) => default_backend(),
        };
        let real_table = section(&table, "real")?;
        check_keys("real", &real_table, &["backend", "model", "truth"])?;
        let mut truth: BTreeMap<String, f64> =
            numbers("real.truth", &section(&real_table, "truth")?)?;
        for given in &real.truth {
            let (name, value) = given
                .split_once('=')
                .ok_or_else(|| wrong("--truth", format!("`{given}` is not NAME=VALUE")))?;
            let value: f64 = value
                .trim()
                .parse()
                .ok()
                .filter(|x: &f64| x.is_finite())
                .ok_or_else(|| {
                    wrong(
                        &format!("--truth {name}"),
                        format!("`{value}` is not a finite number"),
                    )
                })?;
            truth.insert(name.trim().to_owned(), value);
        }
        let (parameter, parameters) = unknowns(task, &section(&table, "parameter")?)?;
        for name in truth.keys() {
            if !parameters.iter().any(|p| &p.name == name) {
                let known = parameters.iter().map(|p| &*p.name);
                return Err(Error::unknown("parameter", name, known).into());
            }
        }
        let model = match (&real.real_model, text(&real_table, "model")?) {
            (Some(path), _) => Some(path.clone()),
            (None, path) => path.map(PathBuf::from),
        };
        let (start, assumed) = start(stage, task, &section(&table, "start")?)?;
        let config = Self {
            command: stage,
            task: task.name().to_owned(),
            seed: match (common.seed, table.get("seed")) {
                (Some(seed), _) => seed,
                (None, None) => 0,
                (None, Some(value)) => value
                    .as_integer()
                    .and_then(|s| u64::try_from(s).ok())
                    .ok_or_else(|| {
                        wrong("seed", format!("{value} is not a whole number from 0 up"))
                    })?,
            },
            start,
            assumed,
            explorer: component::<dyn asid_core::Explorer>(
                &table,
                "explorer",
                algorithms.explorer.as_deref(),
                ASID.explorer,
            )?,
            identifier: component::<dyn asid_core::Identifier>(
                &table,
                "identifier",
                algorithms.identifier.as_deref(),
                ASID.identifier,
            )?,
            solver: component::<dyn asid_core::TaskSolver>(
                &table,
                "solver",
                algorithms.solver.as_deref(),
                ASID.solver,
            )?,
            real: RealConfig {
                backend: match (&real.real_backend, text(&real_table, "backend")?) {
                    (Some(name), _) => name.clone(),
                    (None, Some(name)) => name,
                    (None, None) => backend.clone(),
                },
                model,
                truth,
            },
            noise: noise(task, &section(&table, "noise")?)?,
            backend,
            parameter,
        };
        Ok((config, parameters))
    }
}

/// The engine that is used where none is named: the first that is built in, MuJoCo last,
/// so that nothing depends on a native library.
fn default_backend() -> String {
    let all = registry::all::<registry::BackendEntry>();
    let rapier = all.iter().find(|e| e.name == "rapier");
    rapier
        .or(all.first())
        .map_or_else(String::new, |e| e.name.to_owned())
}

fn read_table(path: &Path) -> Result<toml::Table> {
    let file = |message: String| Error::File {
        path: path.to_owned(),
        message,
    };
    let text = std::fs::read_to_string(path).map_err(|e| file(e.to_string()))?;
    Ok(text.parse().map_err(|e: toml::de::Error| {
        let line = e.span().map_or(0, |s| {
            text[..s.start.min(text.len())].lines().count().max(1)
        });
        file(format!("line {line}: {}", e.message()))
    })?)
}

/// Applies `key.key=value`; a value that is no TOML is taken as text.
fn set(table: &mut toml::Table, assignment: &str) -> Result<()> {
    let (key, value) = assignment
        .split_once('=')
        .ok_or_else(|| wrong("--set", format!("`{assignment}` is not KEY=VALUE")))?;
    let value = format!("x = {value}")
        .parse::<toml::Table>()
        .ok()
        .and_then(|mut t| t.remove("x"))
        .unwrap_or_else(|| toml::Value::String(value.trim().to_owned()));
    let mut parts: Vec<&str> = key.trim().split('.').collect();
    let last = parts.pop().unwrap_or_default();
    let mut at = table;
    for part in parts {
        at = at
            .entry(part)
            .or_insert_with(|| toml::Value::Table(toml::Table::new()))
            .as_table_mut()
            .ok_or_else(|| {
                wrong(
                    key,
                    format!("`{part}` is a value and has no settings below it"),
                )
            })?;
    }
    at.insert(last.to_owned(), value);
    Ok(())
}

fn text(table: &toml::Table, key: &str) -> Result<Option<String>> {
    table
        .get(key)
        .map(|v| {
            v.as_str()
                .map(str::to_owned)
                .ok_or_else(|| wrong(key, format!("{v} is not a text in quotes")))
        })
        .transpose()
}

fn section(table: &toml::Table, key: &str) -> Result<toml::Table> {
    match table.get(key) {
        None => Ok(toml::Table::new()),
        Some(toml::Value::Table(t)) => Ok(t.clone()),
        Some(other) => Err(wrong(key, format!("{other} is not a section of settings"))),
    }
}

fn check_keys(name: &str, table: &toml::Table, known: &[&'static str]) -> Result<()> {
    for key in table.keys() {
        if !known.contains(&key.as_str()) {
            let unknown = Error::unknown("setting", key, known.iter().copied());
            return Err(wrong(name, unknown.to_string()));
        }
    }
    Ok(())
}

fn numbers(name: &str, table: &toml::Table) -> Result<BTreeMap<String, f64>> {
    table
        .iter()
        .map(|(key, value)| {
            value
                .as_float()
                .or_else(|| value.as_integer().map(|i| i as f64))
                .filter(|x| x.is_finite())
                .map(|x| (key.clone(), x))
                .ok_or_else(|| {
                    wrong(
                        &format!("{name}.{key}"),
                        format!("{value} is not a finite number"),
                    )
                })
        })
        .collect()
}

/// The algorithm of a section with all its settings. Settings in the file are
/// those of the algorithm named there; another one on the command line starts
/// from its defaults.
fn component<T: ?Sized + 'static>(
    table: &toml::Table,
    key: &str,
    option: Option<&str>,
    default: &str,
) -> Result<Component>
where
    AlgorithmEntry<T>: Entry,
{
    let mut given = section(table, key)?;
    let named = text(&given, "name")?;
    given.remove("name");
    let name = option
        .map(str::to_owned)
        .or_else(|| named.clone())
        .unwrap_or_else(|| default.to_owned());
    if named.is_some_and(|n| n != name) {
        given.clear();
    }
    let entry = registry::find::<AlgorithmEntry<T>>(&name).map_err(|unknown| {
        super::list::missing(AlgorithmEntry::<T>::KIND, &name).unwrap_or(unknown)
    })?;
    let mut settings = (entry.defaults)();
    merge(key, &mut settings, given)?;
    (entry.make)(&settings)?;
    Ok(Component { name, settings })
}

/// Settings over their defaults, which say what kind of value each one is.
fn merge(section: &str, into: &mut toml::Table, from: toml::Table) -> Result<()> {
    use toml::Value::{Boolean, Float, Integer, String, Table};
    for (key, value) in from {
        let full = format!("{section}.{key}");
        let value = match (into.get_mut(&key), value) {
            (Some(Table(a)), Table(b)) => {
                merge(&full, a, b)?;
                continue;
            }
            (Some(Float(_)), Integer(i)) => Float(i as f64),
            (Some(Float(_)), Float(x)) => Float(x),
            (Some(Float(_)), other) => {
                return Err(wrong(&full, format!("{other} is not a number")));
            }
            (Some(Integer(_)), Integer(i)) if i >= 0 => Integer(i),
            (Some(Integer(_)), other) => {
                return Err(wrong(
                    &full,
                    format!("{other} is not a whole number from 0 up"),
                ));
            }
            (Some(Boolean(_)), other) if !other.is_bool() => {
                return Err(wrong(&full, format!("{other} is neither true nor false")));
            }
            (Some(String(_)), other) if !other.is_str() => {
                return Err(wrong(&full, format!("{other} is not a text in quotes")));
            }
            (Some(Table(_)), other) => {
                return Err(wrong(
                    &full,
                    format!("{other} is not a section of settings"),
                ));
            }
            (_, other) => other,
        };
        into.insert(key, value);
    }
    Ok(())
}

/// The task's unknowns with what the configuration says of them.
fn unknowns(
    task: &dyn Task,
    table: &toml::Table,
) -> Result<(BTreeMap<String, ParameterConfig>, Vec<Parameter>)> {
    let mut given: BTreeMap<String, ParameterConfig> = BTreeMap::new();
    for (name, value) in table {
        let read = ParameterConfig::deserialize(value.clone())
            .map_err(|e| wrong(&format!("parameter.{name}"), e.message().to_owned()))?;
        given.insert(name.clone(), read);
    }
    let mut parameters = task.parameters();
    let mut order: Vec<String> = parameters.iter().map(|p| p.name.clone()).collect();
    for p in task.optional_parameters() {
        if given.contains_key(&p.name) {
            order.push(p.name.clone());
            parameters.push(p);
        }
    }
    for (name, config) in &given {
        if order.contains(name) {
            continue;
        }
        if config.target.is_none() && config.targets.is_none() {
            let known = task
                .parameters()
                .into_iter()
                .chain(task.optional_parameters())
                .map(|p| p.name)
                .collect::<Vec<_>>();
            let unknown = Error::unknown("parameter", name, known.iter().map(String::as_str));
            return Err(wrong(
                &format!("parameter.{name}"),
                format!("{unknown}; a new one needs a `target` and a `range`"),
            ));
        }
        parameters.push(Parameter {
            name: name.clone(),
            targets: Vec::new(),
            range: config
                .range
                .ok_or_else(|| wrong(&format!("parameter.{name}"), "needs a `range`"))?,
            scale: Scale::Linear,
            unit: String::new(),
        });
    }
    parameters.retain_mut(|p| {
        let Some(config) = given.get(&p.name) else {
            return true;
        };
        if let Some(targets) = &config.targets {
            p.targets.clone_from(targets);
        }
        if let Some(target) = &config.target {
            p.targets = vec![target.clone()];
        }
        if let Some(range) = config.range {
            p.range = range;
        }
        if let Some(scale) = config.scale {
            p.scale = scale;
        }
        if let Some(unit) = &config.unit {
            p.unit.clone_from(unit);
        }
        config.enabled != Some(false)
    });
    if parameters.is_empty() {
        return Err(wrong("parameter", "every unknown is switched off"));
    }
    for p in &parameters {
        p.check()?;
    }
    let mut resolved: BTreeMap<String, ParameterConfig> = parameters
        .iter()
        .map(|p| {
            (
                p.name.clone(),
                ParameterConfig {
                    target: None,
                    targets: Some(p.targets.clone()),
                    range: Some(p.range),
                    scale: Some(p.scale),
                    unit: Some(p.unit.clone()),
                    enabled: None,
                },
            )
        })
        .collect();
    for (name, config) in given {
        if config.enabled == Some(false) {
            let off = ParameterConfig {
                enabled: Some(false),
                ..ParameterConfig::default()
            };
            resolved.insert(name, off);
        }
    }
    Ok((resolved, parameters))
}

/// The task's tracking noise with what the configuration says of it.
fn noise(task: &dyn Task, table: &toml::Table) -> Result<BTreeMap<String, f64>> {
    let mut all: BTreeMap<String, f64> = task
        .exploration()
        .signals
        .iter()
        .map(|s| (s.sensor.clone(), s.noise))
        .collect();
    for (name, value) in numbers("noise", table)? {
        if value <= 0.0 {
            return Err(wrong(
                &format!("noise.{name}"),
                format!("must be positive, not {value}"),
            ));
        }
        if all.insert(name.clone(), value).is_none() {
            let known = task.exploration().signals.iter().map(|s| &*s.sensor);
            return Err(Error::unknown("tracked sensor", &name, known).into());
        }
    }
    Ok(all)
}

/// The start pose of a stage that is told it, and the names of the coordinates that
/// were not given and took the middle of their range.
fn start(
    stage: Stage,
    task: &dyn Task,
    table: &toml::Table,
) -> Result<(BTreeMap<String, f64>, Vec<String>)> {
    let given = numbers("start", table)?;
    let coordinates = stage.start(task);
    for (name, &value) in &given {
        if coordinates.is_empty() {
            return Err(wrong(
                &format!("start.{name}"),
                format!(
                    "`{}` takes no start pose; `explore` and `solve` do",
                    stage.name()
                ),
            ));
        }
        let Some(c) = coordinates.iter().find(|c| &c.name == name) else {
            let known = coordinates.iter().map(|c| &*c.name);
            return Err(Error::unknown("start coordinate", name, known).into());
        };
        // A tracker may show an object a little outside; further off it is another unit or frame.
        let [low, high] = c.range;
        let slack = high - low;
        if !(low - slack..=high + slack).contains(&value) {
            return Err(wrong(
                &format!("start.{name}"),
                format!(
                    "{value} {} is far outside the task's range, {low} to {high}",
                    c.unit
                ),
            ));
        }
    }
    let missing = coordinates.iter().filter(|c| !given.contains_key(&c.name));
    let assumed = missing.map(|c| c.name.clone()).collect();
    let all = coordinates
        .iter()
        .map(|c| {
            (
                c.name.clone(),
                given.get(&c.name).copied().unwrap_or(c.center()),
            )
        })
        .collect();
    Ok((all, assumed))
}
