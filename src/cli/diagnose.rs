//! `asid diagnose`: where the sim-to-real gap lies, which effect causes it, how far it shrinks.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use asid_core::registry::{self, BackendEntry, EffectEntry, TaskEntry, find};
use asid_core::{Backend, Capabilities, Error, Target};
use asid_diagnosis::diagnose::{Diagnosis, Settings, diagnose as diagnose_study};
use asid_diagnosis::machine::Machine;
use asid_diagnosis::refined_model::RefinedModel;
use asid_diagnosis::result::DiagnosisResult;
use asid_diagnosis::search::Breadth;
use asid_diagnosis::study::Study;
use serde::{Deserialize, Serialize};

use super::diagnosis_report::{self, Meta};
use super::model::{self, Needs};
use super::options::Common;
use super::output::{OutFolder, write_json, write_text};
use super::progress::Bars;
use super::session::backend;
use super::{config, failure};
use asid_report::diagnosis as report;

/// Arguments of `diagnose`.
#[derive(clap::Args)]
#[command(after_help = "\
A study is a TOML file, or a folder with study.toml: the model, logs to fit to and logs held out, and what \
is fitted already. docs/diagnosis.md tells how to write one, and how to read the answer.

The folder holds result.json, refined.toml (the model with the effects of the verdict, for a study's \
`model`), config.toml, copies of the logs, report.html and trace.json.")]
pub struct Arguments {
    /// The study: a TOML file, or a folder with study.toml
    #[arg(required_unless_present_any = ["task", "config"], conflicts_with = "task")]
    study: Option<PathBuf>,
    /// A built-in task in place of a study
    #[arg(long, value_name = "TASK", requires = "train")]
    task: Option<String>,
    /// Logs of the task to fit to
    #[arg(long, value_name = "FILE", num_args = 1.., requires = "task")]
    train: Vec<PathBuf>,
    /// Logs of the task held out
    #[arg(long, value_name = "FILE", num_args = 1.., requires = "task")]
    test: Vec<PathBuf>,
    /// An effect of the catalogue that is not to be tried (repeatable)
    #[arg(long, value_name = "EFFECT")]
    without: Vec<String>,
    /// Model of the task in place of its scene: MJCF, or TOML of a refined model
    #[arg(long, value_name = "FILE", requires = "task")]
    model: Option<PathBuf>,
    #[command(flatten)]
    pub common: Common,
}

/// `config.toml` of a diagnosis.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    study: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    task: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    model: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    train: Vec<PathBuf>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    test: Vec<PathBuf>,
    #[serde(default = "default_backend")]
    backend: String,
    #[serde(default)]
    seed: u64,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    without: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    plugins: Vec<PathBuf>,
    #[serde(default)]
    search: SearchConfig,
}

/// How widely to search.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct SearchConfig {
    first: usize,
    last: usize,
    singles: usize,
    beam: usize,
    depth: usize,
}

impl Default for SearchConfig {
    fn default() -> Self {
        let Breadth {
            first,
            last,
            singles,
            beam,
            depth,
        } = Breadth::default();
        Self {
            first,
            last,
            singles,
            beam,
            depth,
        }
    }
}

impl Config {
    /// The configuration file, `--set`, then the command line.
    fn resolve(arguments: &Arguments) -> Result<Self> {
        let common = &arguments.common;
        let mut table = match &common.config {
            Some(path) => config::read_table(path)?,
            None => toml::Table::new(),
        };
        for setting in &common.set {
            config::set(&mut table, setting)?;
        }
        let mut config: Self = table
            .try_into()
            .map_err(|e: toml::de::Error| config_error("config", e.message().replace('\n', " ")))?;
        if arguments.study.is_some() || arguments.task.is_some() {
            config.study.clone_from(&arguments.study);
            config.task.clone_from(&arguments.task);
            config.model.clone_from(&arguments.model);
            config.train.clone_from(&arguments.train);
            config.test.clone_from(&arguments.test);
        }
        if let Some(name) = &common.backend {
            config.backend.clone_from(name);
        }
        config.seed = common.seed.unwrap_or(config.seed);
        config.without.extend(arguments.without.iter().cloned());
        for name in &config.without {
            find::<EffectEntry>(name)?;
        }
        let SearchConfig {
            first, last, depth, ..
        } = config.search;
        if first == 0 || last == 0 || depth == 0 || config.search.beam == 0 {
            return Err(config_error("search", "every number is at least 1".into()));
        }
        Ok(config)
    }

    fn settings(&self) -> Settings {
        let SearchConfig {
            first,
            last,
            singles,
            beam,
            depth,
        } = self.search;
        Settings {
            seed: self.seed,
            breadth: Breadth {
                first,
                last,
                singles,
                beam,
                depth,
            },
            without: self.without.clone(),
        }
    }

    fn study(&self) -> Result<Study> {
        match (&self.study, &self.task) {
            (Some(path), _) => Ok(Study::read(path)?),
            (None, Some(name)) => {
                let task = (find::<TaskEntry>(name)?.make)()?;
                let model = match &self.model {
                    None => model::of_task(&*task),
                    Some(path) => {
                        let backend = backend(&self.backend)?;
                        let scene = backend.load(task.scene())?;
                        let needs = Needs {
                            task: &*task,
                            layout: scene.layout(),
                            parameters: &task.parameters(),
                        };
                        needs.open(&*backend, path, "simulator", &[])?.0
                    }
                };
                Ok(Study::of_task(&*task, model, &self.train, &self.test)?)
            }
            (None, None) => Err(config_error("study", "is missing".into())),
        }
    }
}

/// The engine that is used where none is named: the first built in that computes in double
/// precision, for which replays of logs are smooth in every parameter; else the first.
pub fn default_backend() -> String {
    let all = registry::all::<BackendEntry>();
    let double = |entry: &&&BackendEntry| {
        let made = (entry.make)();
        made.is_ok_and(|b| b.capabilities().contains(Capabilities::DOUBLE_PRECISION))
    };
    let found = all.iter().find(double).or(all.first());
    found.map_or_else(String::new, |e| e.name.to_owned())
}

fn config_error(key: &str, message: String) -> anyhow::Error {
    Error::Config {
        key: key.into(),
        message,
    }
    .into()
}

/// The machine of a study on an engine.
pub fn machine(study: &Study, engine: &str, threads: usize) -> Result<Machine> {
    let backend: Arc<dyn Backend> = backend(engine)?.into();
    Ok(Machine::new(
        backend,
        &study.scene,
        &study.fixed,
        &study.effects,
        threads,
    )?)
}

/// Diagnoses a study.
pub fn diagnose(arguments: &Arguments) -> Result<()> {
    let clock = Instant::now();
    let common = &arguments.common;
    let config = Config::resolve(arguments)?;
    let study = config.study()?;
    let machine = machine(&study, &config.backend, common.threads.unwrap_or(0))?;
    let out = OutFolder::claim(common.out.as_deref(), &format!("{}-diagnose", study.name))?;
    let progress = Bars::new(common.quiet);
    let (diagnosis, _) = diagnose_study(&study, machine, config.settings(), &progress)?;
    let engine = {
        let backend = backend(&config.backend)?;
        format!("{} {}", backend.name(), backend.version())
    };
    out.write(|folder| {
        write_json(&folder.join("result.json"), &diagnosis.result)?;
        let report = diagnosis_report::diagnosis(
            &diagnosis.result,
            &diagnosis.trace,
            meta(&study, &engine, config.seed),
        );
        write_json(&folder.join("trace.json"), &report)?;
        write_text(&folder.join("report.html"), &report::page(&report))?;
        write_text(&folder.join("config.toml"), &toml::to_string(&config)?)?;
        write_text(
            &folder.join("refined.toml"),
            &refined(&study, &diagnosis, folder)?,
        )?;
        copy_logs(&study, folder)?;
        Ok(())
    })?;
    let mut stdout = std::io::stdout().lock();
    if common.json {
        let text = serde_json::to_string_pretty(&diagnosis.result)?;
        writeln!(stdout, "{text}")?;
    } else {
        let seconds = clock.elapsed().as_secs_f64();
        for line in lines(&diagnosis.result, &engine, seconds) {
            writeln!(stdout, "{line}")?;
        }
        writeln!(stdout, "results: {}", out.path().display())?;
    }
    drop(stdout);
    for check in diagnosis.result.checks.iter().filter(|c| !c.ok) {
        failure::warn(&format!("check {}: {}", check.check, check.detail));
    }
    Ok(())
}

/// What the report tells besides the result.
fn meta(study: &Study, engine: &str, seed: u64) -> Meta {
    let parameters = study.parameters.iter();
    Meta {
        command: super::run::command_line(),
        engine: engine.to_owned(),
        seed,
        parameters: parameters
            .map(|p| (p.name.clone(), p.unit.clone(), None))
            .collect(),
        held_out: study.test.len(),
        fitted_to: study.train.len(),
        files: vec![
            ("result.json", "the numbers"),
            ("refined.toml", "the model with the effects of the verdict"),
            (
                "config.toml",
                "the settings: `--config` with it repeats this",
            ),
            ("trace.json", "the data of this report"),
        ],
    }
}

/// The text of the refined model; its document is copied beside it where it needs no other file.
fn refined(study: &Study, diagnosis: &Diagnosis, folder: &Path) -> Result<String> {
    let alone = !study.scene.xml().contains("file=");
    let model = if alone {
        write_text(&folder.join("model.xml"), study.scene.xml())?;
        PathBuf::from("model.xml")
    } else {
        let path = PathBuf::from(study.scene.name());
        path.canonicalize().unwrap_or(path)
    };
    let mut values: Vec<(Target, f64)> = study.fixed.clone();
    for (parameter, value) in study.parameters.iter().zip(&diagnosis.values) {
        for target in &parameter.targets {
            values.retain(|(t, _)| t != target);
            values.push((target.clone(), parameter.setting(*value)));
        }
    }
    let effects = [&study.effects[..], &diagnosis.effects].concat();
    Ok(RefinedModel::text(&model, &values, &effects)?)
}

/// Copies the logs, `train-…` and `test-…`.
fn copy_logs(study: &Study, folder: &Path) -> Result<()> {
    for (kind, logs) in [("train", &study.train), ("test", &study.test)] {
        for (i, (_, episode)) in logs.iter().enumerate() {
            episode.write_csv(&folder.join(format!("{kind}-{}.csv", i + 1)))?;
        }
    }
    Ok(())
}

/// The answer on the terminal.
fn lines(result: &DiagnosisResult, engine: &str, seconds: f64) -> Vec<String> {
    let mut all = Vec::new();
    let mut line = |text: &str| all.push(text.to_owned());
    line(&result.sentence);
    let gap = &result.gap;
    line(&format!(
        "gap on logs held out, in units of the noise: {:.2} as given, {:.2} identified, {:.2} refined",
        gap.nominal, gap.identified, gap.refined
    ));
    for h in result
        .hypotheses
        .iter()
        .take(4)
        .filter(|h| h.probability > 0.001)
    {
        line(&format!(
            "  {:5.1} %  {}",
            100.0 * h.probability,
            h.effects.join(" + ")
        ));
    }
    for e in result.effects.iter().filter(|e| {
        let label = if e.site.is_empty() {
            e.effect.clone()
        } else {
            format!("{}@{}", e.effect, e.site)
        };
        result.verdict.effects.contains(&label)
    }) {
        let values = e.parameters.iter().filter(|(_, v)| **v != 0.0);
        let text: Vec<String> = values.map(|(n, v)| format!("{n} = {v:.4}")).collect();
        line(&format!("  {} {}: {}", e.effect, e.site, text.join(", ")));
    }
    for p in &result.parameters {
        line(&format!("  {} = {:.5} ± {:.5}", p.name, p.estimate, p.std));
    }
    if !result.next_experiment.how.is_empty() {
        line(&format!("next: {}", result.next_experiment.how));
    }
    line(&format!("{engine}, {seconds:.1} s"));
    all
}
