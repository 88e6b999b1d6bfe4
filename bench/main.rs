//! Compares the speed of ASID with that of its engines: a table, and a JSON file with the
//! circumstances.
//!
//! `cargo xtask bench` builds and calls it. Speeds depend on the machine, so nothing here passes or
//! fails. A row with a counterpart is measured together with it, in turns. The best of some rounds
//! counts, because other load only slows down.

// A measuring tool prints to the terminal.
#![allow(clippy::print_stdout, clippy::print_stderr)]

// Linked engines and tasks register themselves.
#[cfg(feature = "mujoco")]
use asid_mujoco as _;
use asid_tasks as _;

mod bare;
mod clock;
mod diagnosis;
mod fisher;
mod loops;
mod machine;
#[cfg(feature = "mujoco")]
mod mujoco;
mod page;
#[cfg(feature = "peers")]
mod peers;
mod physics;
mod plugin;
mod program;
mod rapier;
mod workload;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use asid_core::registry::{BackendEntry, TaskEntry, all, find};
use clap::{Parser, ValueEnum};
use serde::Serialize;

use crate::machine::Circumstances;

/// Version of the JSON file's layout.
const SCHEMA: u32 = 1;

/// The task whose scene and pipeline are measured.
const TASK: &str = "rod-balancing";

/// A part of the measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
    /// Physics steps of batches beside the bare loop
    Physics,
    /// Engines loaded as plugins beside themselves linked in
    Plugin,
    /// Environment steps of Fisher exploration
    Fisher,
    /// A whole run, and identification alone
    Program,
    /// Diagnoses of arms, against joints and rows
    Diagnosis,
    /// Start-up
    Start,
}

/// Measures the speed of ASID beside that of its engines.
#[derive(Parser)]
#[command(name = "cargo xtask bench")]
struct Arguments {
    /// One short round of everything, and no whole runs
    #[arg(long)]
    quick: bool,
    /// Only these parts
    #[arg(long, value_enum, value_delimiter = ',')]
    only: Vec<Part>,
    /// Only this engine
    #[arg(long, value_name = "NAME")]
    engine: Option<String>,
    /// Where to write the JSON file [default: bench.json or peers.json in the target folder]
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
    /// A page whose tables between the two `bench` markers (with --peers: `peers`) are rewritten
    #[arg(long, value_name = "FILE.md")]
    markdown: Option<PathBuf>,
    /// Measure against Python instead: exploration and identification
    #[arg(long, requires = "python", conflicts_with_all = ["only", "engine"])]
    peers: bool,
    /// Python of the peers' virtual environment; `cargo xtask bench --peers` gives it
    #[arg(long, value_name = "PROGRAM", requires = "peers")]
    python: Option<PathBuf>,
}

impl Arguments {
    fn wants(&self, part: Part) -> bool {
        let whole = !matches!(part, Part::Program | Part::Diagnosis) || !self.quick;
        self.only.contains(&part) || (self.only.is_empty() && whole)
    }

    fn out(&self) -> Result<PathBuf> {
        if let Some(out) = &self.out {
            return Ok(out.clone());
        }
        let own = std::env::current_exe().context("cannot tell where this program lies")?;
        let target = own.ancestors().nth(2).context("no target folder")?;
        let name = if self.peers { "peers" } else { "bench" };
        Ok(target.join(name).with_extension("json"))
    }
}

/// All results.
#[derive(Serialize)]
struct Results {
    schema: u32,
    task: &'static str,
    circumstances: Circumstances,
    physics: Vec<physics::PhysicsRow>,
    plugin: Vec<plugin::PluginRow>,
    fisher: Vec<fisher::FisherRow>,
    program: Vec<program::RunRow>,
    diagnosis: Vec<diagnosis::DiagnosisRow>,
    start: Vec<program::StartRow>,
}

impl Results {
    fn markdown(&self) -> String {
        let threads = "threads";
        let mut out = format!(
            "`{}`, {}\n\n",
            self.circumstances.command,
            self.circumstances.sentence()
        );
        out += &page::table(
            "Physics steps",
            &[
                "engine",
                "batch",
                threads,
                "steps/s",
                "bare loop",
                "ratio",
                "ratio of CPU time",
            ],
            &physics::table(&self.physics),
        );
        out += &page::table(
            "An engine loaded as a plugin, by the same engine linked in: a batch of 64",
            &[
                "engine",
                "a call each",
                threads,
                "steps/s linked",
                "time",
                "CPU time",
                "median time of a round",
            ],
            &plugin::table(&self.plugin),
        );
        out += &page::table(
            "Fisher exploration, one unknown",
            &[
                "engine",
                "form",
                threads,
                "environment steps/s",
                "physics steps/s",
                "CPU time in the engine",
            ],
            &fisher::table(&self.fisher),
        );
        out += &page::table(
            "Whole runs, default settings",
            &["engine", "command", "s", "million physics steps"],
            &program::table_of_runs(&self.program),
        );
        out += &page::table(
            "Diagnoses of arms of servos, logged at 100 Hz",
            &[
                "engine",
                "joints",
                "rows",
                "candidates",
                "the real arm lacks",
                "named",
                "first table, s",
                "s",
            ],
            &diagnosis::table(&self.diagnosis),
        );
        out += &page::table(
            "Start-up",
            &["command", "least, ms", "median, ms"],
            &program::table_of_starts(&self.start),
        );
        out
    }
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bench: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Measures and writes the results. Checks first that the folder can be written to.
fn run(arguments: &Arguments) -> Result<()> {
    let part = if arguments.peers { "peers" } else { "bench" };
    let page = arguments
        .markdown
        .as_deref()
        .map(|path| page::Page::read(path, part))
        .transpose()?;
    let out = arguments.out()?;
    let folder = match out.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    tempfile::tempfile_in(folder)
        .with_context(|| format!("cannot write into {}", folder.display()))?;
    let (json, text) = match &arguments.python {
        Some(python) => against(python, arguments.quick)?,
        None => alone(arguments)?,
    };
    print!("{text}");
    std::fs::write(&out, json + "\n").with_context(|| format!("cannot write {}", out.display()))?;
    if let (Some(page), Some(path)) = (page, &arguments.markdown) {
        page.write(path, &text)?;
    }
    println!("{}", out.display());
    Ok(())
}

/// Measures against the engines' own loops; returns the JSON file and the page.
fn alone(arguments: &Arguments) -> Result<(String, String)> {
    let engines: Vec<String> = match &arguments.engine {
        Some(name) => vec![find::<BackendEntry>(name)?.name.to_owned()],
        None => all::<BackendEntry>()
            .iter()
            .map(|e| e.name.to_owned())
            .collect(),
    };
    let results = measure(arguments, &engines)?;
    Ok((serde_json::to_string_pretty(&results)?, results.markdown()))
}

/// Measures against Python; returns the JSON file and the page.
#[cfg(feature = "peers")]
fn against(python: &Path, quick: bool) -> Result<(String, String)> {
    let results = peers::measure(python, quick)?;
    Ok((serde_json::to_string_pretty(&results)?, results.markdown()))
}

#[cfg(not(feature = "peers"))]
fn against(_: &Path, _: bool) -> Result<(String, String)> {
    anyhow::bail!("built without the feature `peers`; call `cargo xtask bench --peers`")
}

fn measure(arguments: &Arguments, engines: &[String]) -> Result<Results> {
    let task = (find::<TaskEntry>(TASK)?.make)()?;
    let effort = if arguments.quick {
        physics::Effort {
            rounds: 1,
            frames: 30,
        }
    } else {
        physics::Effort {
            rounds: 3,
            frames: usize::MAX,
        }
    };
    let cores = machine::cores();
    let threads: &[usize] = if cores > 1 { &[1, cores] } else { &[1] };
    let mut versions = Vec::new();
    for name in engines {
        let backend = (find::<BackendEntry>(name)?.make)()?;
        versions.push((name.clone(), backend.version()));
    }
    let mut results = Results {
        schema: SCHEMA,
        task: TASK,
        circumstances: Circumstances::now(command(), &versions),
        physics: Vec::new(),
        plugin: Vec::new(),
        fisher: Vec::new(),
        program: Vec::new(),
        diagnosis: Vec::new(),
        start: Vec::new(),
    };
    for name in engines {
        let backend = (find::<BackendEntry>(name)?.make)()?;
        let model = backend.load(task.scene())?;
        if arguments.wants(Part::Physics) {
            let rows = physics::rows(name, &*task, &*model, threads, effort)?;
            results.physics.extend(rows);
        }
        if arguments.wants(Part::Plugin) {
            let library = plugin::library(name)?;
            let rows = plugin::rows(name, &*task, &*model, &library, threads, effort.rounds)?;
            results.plugin.extend(rows);
        }
        if arguments.wants(Part::Fisher) {
            let rows = fisher::rows(&*backend, &*task, &*model, threads, effort.rounds)?;
            results.fisher.extend(rows);
        }
        if arguments.wants(Part::Program) {
            let rows = program::runs(&program::find()?, TASK, name)?;
            results.program.extend(rows);
        }
        if arguments.wants(Part::Diagnosis) {
            let rows = diagnosis::rows(&program::find()?, name, &*backend)?;
            results.diagnosis.extend(rows);
        }
    }
    if arguments.wants(Part::Start) {
        results.start = program::starts(&program::find()?)?;
    }
    Ok(results)
}

/// The command line as typed, without the Python argument that xtask adds.
fn command() -> String {
    let arguments = std::env::args()
        .skip(1)
        .filter(|argument| !argument.starts_with("--python="));
    let words: Vec<String> = ["cargo".into(), "xtask".into(), "bench".into()]
        .into_iter()
        .chain(arguments)
        .collect();
    words.join(" ")
}
