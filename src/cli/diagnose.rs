//! `asid diagnose`: where the sim-to-real gap lies, which effect causes it, and how far it shrinks.

mod config;
mod live;
mod real_world;
mod terminal;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Result;
use asid_core::{Backend, Target};
use asid_diagnosis::diagnose::{Diagnosis, diagnose as diagnose_study};
use asid_diagnosis::machine::Machine;
use asid_diagnosis::study::{Study, named_as_written};
use asid_effects::refined_model::RefinedModel;
use asid_mjcf::Plant;
use asid_mjcf::native::way;
use asid_report::diagnosis::page;
use asid_results::diagnosis::{NotTried, RealWorld};
use asid_results::trace::{DiagnosisTrace, NamedText};

use super::failure;
use super::options::{Algorithms, Common, Worlds};
use super::output::{OutFolder, write_json, write_text};
use super::session::backend;
use super::trace::files;
pub use config::{Config, default_backend};
use live::Live;

/// Arguments of `diagnose`.
#[derive(clap::Args)]
#[command(after_help = "\
A study is a TOML file, or a folder with study.toml: the model, logs to fit to and logs held out, and what \
is fitted already. docs/diagnosis.md tells how to write one, and how to read the answer.

With --task a built-in task takes the study's place. Without --train the task is first run --runs times in its \
simulated real world (--real-effect and the like). The logs of these runs are diagnosed; the last third is held out. \
Where effects are found, the task is then played with the refined model, --seeds times, to count successes.

The folder holds result.json, refined.toml (the model with the diagnosed effects added, for a study's \
`model`), config.toml, copies of the logs, report.html, trace.json and \
evidence.json (what the decision rests on); and next.csv, the commands of the next experiment, where there is one.")]
pub struct Arguments {
    /// Diagnose this study: a TOML file, or a folder with study.toml
    #[arg(required_unless_present_any = ["task", "config"], conflicts_with = "task")]
    study: Option<PathBuf>,
    /// Diagnose a task in place of a study
    #[arg(long, value_name = "TASK")]
    task: Option<String>,
    /// Fit to these logs of the task [default: logs of runs in its simulated real world, made
    /// first: see --runs]
    #[arg(long, value_name = "FILE", num_args = 1.., requires = "task")]
    train: Vec<PathBuf>,
    /// Hold out these logs of the task
    #[arg(long, value_name = "FILE", num_args = 1.., requires = "train")]
    test: Vec<PathBuf>,
    /// Run the task this often for logs, of which a third are held out [default: 6]
    #[arg(long, value_name = "N", conflicts_with = "train")]
    runs: Option<usize>,
    /// Play this many further episodes that tell the rival explanations apart [default: 0]
    #[arg(long, value_name = "N", conflicts_with = "train")]
    experiments: Option<usize>,
    /// Run the task this many times with the nominal and with the refined model, to count successes
    /// [default: 5]
    #[arg(long, value_name = "N")]
    seeds: Option<u64>,
    /// Answer after about this time, or at Ctrl-C, with what is known by then; result.json lists
    /// what was not tried. Runs of a task take their own time [default: 1.5]
    #[arg(long, value_name = "MINUTES")]
    minutes: Option<f64>,
    /// Repeat the diagnosis on simulated logs for as long as --minutes allows, and tell how often
    /// it was right
    #[arg(long)]
    calibrate: bool,
    /// Accuse a machine that lacks nothing no more often than this, by chance; 0.05 finds smaller
    /// effects [default: 0.01]
    #[arg(long, value_name = "P")]
    false_alarms: Option<f64>,
    /// Leave out an effect of the catalogue (repeatable)
    #[arg(long, value_name = "EFFECT")]
    without: Vec<String>,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    algorithms: Algorithms,
    #[command(flatten)]
    worlds: Worlds,
}

impl Arguments {
    /// Whether the command line describes runs of a task in a simulated real world.
    fn describes_a_run(&self) -> bool {
        let Algorithms {
            explorer,
            policy,
            identifier,
            solver,
        } = &self.algorithms;
        self.worlds.real.is_described()
            || policy.is_some()
            || [explorer, identifier, solver].iter().any(|a| a.is_some())
    }

    /// Whether the logs that a configuration file names are diagnosed.
    ///
    /// They are not where the command line names logs, a number of runs that make them, or another
    /// study or task than the file.
    fn keeps_logs_of(&self, table: &toml::Table) -> bool {
        let named = |key: &str| table.get(key).and_then(toml::Value::as_str);
        let other = match &self.task {
            Some(task) => named("study").is_some() || named("task").is_some_and(|t| t != task),
            None => self.study.is_some(),
        };
        !other && self.train.is_empty() && self.runs.is_none()
    }

    /// Whether the task is run: for its logs, or to try the answer.
    fn runs_task(&self, table: &toml::Table) -> bool {
        let task = self.task.is_some() || (self.study.is_none() && table.contains_key("task"));
        let given = table.contains_key("train") && self.keeps_logs_of(table);
        let logs = !self.train.is_empty() || given;
        task && (!logs
            || self.seeds.is_some()
            || self.describes_a_run()
            || table.contains_key("seeds"))
    }
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

/// Diagnoses a study, or a task.
pub fn diagnose(arguments: &Arguments) -> Result<()> {
    let common = &arguments.common;
    let (config, of_run) = Config::resolve(arguments)?;
    let mut progress = Live::new(common.quiet, config.minutes);
    let world = of_run
        .map(|of_run| {
            let (algorithms, worlds) = (&arguments.algorithms, &arguments.worlds);
            real_world::Machine::new(&config, of_run, common, algorithms, worlds)
        })
        .transpose()?;
    let subject = config.task.clone().or_else(|| {
        let path = config.study.as_ref()?;
        Some(path.file_stem()?.to_string_lossy().into_owned())
    });
    let stem = format!("{}-diagnose", subject.unwrap_or_else(|| "study".into()));
    let plays = world.is_some() && config.train.is_empty();
    // Errors of a study are reported before anything is claimed or run.
    let given = if plays {
        None
    } else {
        Some(config.study(None)?)
    };
    let out = OutFolder::claim(common.out.as_deref(), &stem)?;
    let runs = match &world {
        Some(world) => world.before(plays, &progress)?,
        None => Vec::new(),
    };
    let mut study = match (given, &world) {
        (Some(study), _) => study,
        (None, Some(world)) => config.study(Some(world.logs(&runs)))?,
        (None, None) => config.study(None)?,
    };
    let machine = machine(&study, &config.backend, common.threads.unwrap_or(0))?;
    progress.watch()?;
    let (mut diagnosis, work) = diagnose_study(&study, machine, config.settings(), &progress)
        .map_err(|e| named_as_written(&study.parameters, e))?;
    let mut experiments = None;
    if let (Some(world), Some(n @ 1..)) = (&world, config.experiments)
        && !progress.is_interrupted()
        && let Some(played) = world.tell_apart(&work, n, &progress)?
    {
        let (train, test) = world.logs(&runs);
        let logs = (
            [train, played.logs.0].concat(),
            [test, played.logs.1].concat(),
        );
        experiments = Some(format!(
            "{}. Before them: {}",
            played.what, diagnosis.result.sentence
        ));
        study = config.study(Some(logs))?;
        let again = self::machine(&study, &config.backend, common.threads.unwrap_or(0))?;
        progress.start();
        diagnosis = diagnose_study(&study, again, config.settings(), &progress)?.0;
    }
    drop(work);
    if progress.is_interrupted() && world.is_some() {
        diagnosis.result.not_tried.push(NotTried {
            stage: "experiments, and the task before and after".into(),
            effects: Vec::new(),
        });
    } else if let Some(world) = &world {
        let compared = world.compare(&runs, &diagnosis.effects, &progress)?;
        diagnosis.result.real_world = Some(RealWorld {
            experiments: experiments.unwrap_or_default(),
            ..compared
        });
    }
    let engine = {
        let backend = backend(&config.backend)?;
        format!("{} {}", backend.name(), backend.version())
    };
    let settings = settings(&config, world.as_ref())?;
    diagnosis.result.seconds = Some(progress.seconds());
    diagnosis.result.seconds_to_first_table = progress.seconds_to_first_table();
    tell_origin(&mut diagnosis.trace, &engine, config.seed);
    let more = files(&[("evidence.json", "what the decision rests on")]);
    diagnosis.trace.files.extend(more);
    write(&out, &study, &mut diagnosis, &settings)?;
    let result = &diagnosis.result;
    let lines = terminal::lines((result, &diagnosis.trace), &engine, progress.seconds());
    out.tell(common.json, result, &lines)?;
    for check in result.checks.iter().filter(|c| !c.ok) {
        failure::warn(&format!("check {}: {}", check.check, check.detail));
    }
    Ok(())
}

/// Writes the folder of a diagnosis.
fn write(
    out: &OutFolder,
    study: &Study,
    diagnosis: &mut Diagnosis,
    settings: &toml::Table,
) -> Result<()> {
    let next = diagnosis.result.next_experiment.file.clone();
    if !next.is_empty() {
        let commands = files(&[(&*next, "the commands of the next experiment")]);
        diagnosis.trace.files.extend(commands);
    }
    let (result, trace) = (&diagnosis.result, &diagnosis.trace);
    out.write(|folder| {
        write_json(&folder.join("result.json"), result)?;
        write_json(&folder.join("trace.json"), trace)?;
        write_json(&folder.join("evidence.json"), &diagnosis.evidence)?;
        write_text(&folder.join("report.html"), &page(result, trace))?;
        write_text(&folder.join("config.toml"), &toml::to_string(settings)?)?;
        write_text(
            &folder.join("refined.toml"),
            &refined((study, &out.path()), diagnosis, folder)?,
        )?;
        if let Some(commands) = &diagnosis.next_commands {
            commands.write_csv(&folder.join(&next))?;
        }
        copy_logs(study, folder)
    })
}

/// Content of `config.toml`: the diagnosis' own settings, which take precedence, and those of the
/// task's runs.
fn settings(config: &Config, world: Option<&real_world::Machine>) -> Result<toml::Table> {
    let mut settings = toml::Table::try_from(config)?;
    if let Some(world) = world {
        let of_run = world.settings()?.into_iter();
        let more: Vec<_> = of_run.filter(|(k, _)| !settings.contains_key(k)).collect();
        settings.extend(more);
    }
    Ok(settings)
}

/// Adds to a trace the engine, seed and command that made it, and the files beside it.
fn tell_origin(trace: &mut DiagnosisTrace, engine: &str, seed: u64) {
    trace.command = super::run::command_line();
    trace.engine = engine.to_owned();
    trace.versions = vec![
        NamedText::new("seed", seed.to_string()),
        NamedText::new("asid", env!("CARGO_PKG_VERSION")),
        NamedText::new("engine", engine),
        NamedText::new("git", env!("ASID_GIT")),
    ];
    trace.files = files(&[
        ("result.json", "the numbers"),
        ("refined.toml", "the model with the diagnosed effects added"),
        (
            "config.toml",
            "the settings; `asid diagnose --config config.toml` repeats the diagnosis",
        ),
        ("trace.json", "the data of the pictures"),
    ]);
}

/// The text of the refined model, whose final folder is `home`.
///
/// Its document is copied beside it into `folder` if it needs no other file. Else it is named by
/// its path from `home`.
fn refined((study, home): (&Study, &Path), diagnosis: &Diagnosis, folder: &Path) -> Result<String> {
    let alone = !study.scene.xml().contains("file=");
    let model = if alone {
        write_text(&folder.join("model.xml"), study.scene.xml())?;
        PathBuf::from("model.xml")
    } else {
        way(home, Path::new(study.scene.name()))
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
    let plant = Plant::of(&study.scene)?;
    for (kind, logs) in [("train", &study.train), ("test", &study.test)] {
        for (i, (_, episode)) in logs.iter().enumerate() {
            let path = folder.join(format!("{kind}-{}.csv", i + 1));
            episode.write_csv_with_start(&path, &plant.layout)?;
        }
    }
    Ok(())
}
