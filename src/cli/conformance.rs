//! `asid conformance`: every check against every engine, as a table.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use anyhow::Result;
use asid_conformance::{Event, run_checks, table};
use asid_core::registry::{self, BackendEntry, Origin};
use asid_core::{Backend, Error, Progress as _};
use serde::Serialize;

use super::output::{OutFolder, write_json, write_text};
use super::progress::Bars;
use super::result::Program;
use super::settings;
use super::{failure, plugins, session};
use result::{ConformanceResult, Count, Engine, sentence, verdict};

mod cell;
mod choice;
mod page;
mod result;

/// Arguments of `conformance`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Check this engine (repeatable) [default: those of the plugins that are named, else all]
    #[arg(long, value_name = "NAME")]
    backend: Vec<String>,
    /// Run only checks whose name holds this text, such as friction/ (repeatable) [default: all]
    #[arg(long, value_name = "TEXT")]
    check: Vec<String>,
    /// List the checks, what each needs and where its tolerance comes from, and run none
    #[arg(long, conflicts_with = "scene")]
    list: bool,
    /// Print the MJCF documents that the checks give the first engine, instead of their rows
    #[arg(long, requires = "check")]
    scene: bool,
    /// Run this many checks at a time; results do not depend on it [default: one a core]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = super::options::threads)]
    threads: Option<usize>,
    /// Take engines and checks from a file, such as the config.toml of an earlier `asid
    /// conformance`
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// Write the results and their report into this folder [default: none is written]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Show no progress on standard error
    #[arg(long)]
    quiet: bool,
    /// Print the rows as JSON, and nothing else, on standard output
    #[arg(long)]
    json: bool,
}

/// An engine that is checked.
struct Asked {
    entry: &'static BackendEntry,
    backend: Box<dyn Backend>,
}

/// `config.toml`.
#[derive(Serialize)]
struct Resolved {
    backend: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    check: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    plugins: Vec<PathBuf>,
}

/// Runs the checks, prints the table and writes the folder.
pub fn conformance(arguments: &Arguments) -> Result<()> {
    let (backends, patterns) = wanted(arguments)?;
    let chosen = choice::chosen(&patterns)?;
    if arguments.list {
        return choice::list(&chosen, arguments.json);
    }
    let engines = asked(&backends)?;
    if arguments.scene {
        return choice::scenes(&chosen, &*engines[0].backend);
    }
    let out = (arguments.out.as_deref())
        .map(|out| OutFolder::claim(Some(out), "conformance"))
        .transpose()?;
    let threads = arguments
        .threads
        .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));

    let bars = Bars::new(arguments.quiet);
    bars.begin("conformance", (engines.len() * chosen.len()) as u64);
    let mut rows = Vec::new();
    let mut said = Vec::new();
    for asked in &engines {
        let mut own = run_checks(
            &*asked.backend,
            &chosen,
            threads,
            &told(&bars, asked.entry.name),
        );
        // An engine that is registered twice has two names, but itself knows only one.
        own.iter_mut()
            .for_each(|row| row.engine = asked.entry.name.to_owned());
        said.push(Engine {
            name: asked.entry.name.to_owned(),
            version: asked.backend.version(),
            origin: asked.entry.origin.to_string(),
            claims: names(asked.backend.capabilities()),
            lacks: names(!asked.backend.capabilities()),
            count: Count::of(own.iter()),
        });
        rows.extend(own);
    }
    bars.end();

    let result = ConformanceResult {
        schema: 1,
        rows,
        engines: said,
        versions: Program::THIS,
    };
    if let Some(out) = &out {
        write(out, &result, &engines, patterns)?;
    }
    print(arguments, &result, out.map(|out| out.path()).as_deref())?;
    verdict(&result)
}

/// Names of capabilities, in the order of their bits.
fn names(capabilities: asid_core::Capabilities) -> Vec<&'static str> {
    capabilities.iter_names().map(|(name, _)| name).collect()
}

/// Shows the progress of an engine, with the check that has run the longest.
fn told<'a>(bars: &'a Bars, engine: &'a str) -> impl Fn(Event<'_>) + Sync + 'a {
    let running = Mutex::new(Vec::<String>::new());
    move |event| {
        let Ok(mut running) = running.lock() else {
            return;
        };
        match event {
            Event::Begins(check) => running.push(check.name.to_owned()),
            Event::Ends(row) => {
                running.retain(|name| *name != row.check);
                bars.advance(1);
            }
        }
        bars.note(&match running.first() {
            Some(oldest) => format!("{engine} {oldest}"),
            None => engine.to_owned(),
        });
    }
}

/// Engines and parts of check names: from the options, else from the configuration.
fn wanted(arguments: &Arguments) -> Result<(Vec<String>, Vec<String>)> {
    let table = match &arguments.config {
        Some(path) => settings::read(path, &["backend", "check", "plugins"])?,
        None => toml::Table::new(),
    };
    let or_configured = |given: &Vec<String>, key: &str| {
        if given.is_empty() {
            settings::texts(&table, key)
        } else {
            Ok(given.clone())
        }
    };
    Ok((
        or_configured(&arguments.backend, "backend")?,
        or_configured(&arguments.check, "check")?,
    ))
}

/// The engines to check: those named, else those of named plugins, else all that work on this
/// machine.
fn asked(names: &[String]) -> Result<Vec<Asked>> {
    if !names.is_empty() {
        return names
            .iter()
            .map(|name| {
                let backend = session::backend(name)?;
                let entry = registry::find::<BackendEntry>(name)?;
                Ok(Asked { entry, backend })
            })
            .collect();
    }
    let given = plugins::used(&[]);
    let loaded = |entry: &BackendEntry| match entry.origin {
        Origin::Loaded(file) => given.iter().any(|g| g == file),
        Origin::Linked(_) => false,
    };
    let mut entries = registry::all::<BackendEntry>();
    if !given.is_empty() {
        entries.retain(|entry| loaded(entry));
        if entries.is_empty() {
            return Err(Error::Config {
                key: "--plugin".into(),
                message: "brings no engine; name engines with --backend".into(),
            }
            .into());
        }
    }
    let mut engines = Vec::new();
    for entry in entries {
        match (entry.make)() {
            Ok(backend) => engines.push(Asked { entry, backend }),
            Err(error) => failure::warn(&format!("engine `{}` is left out: {error}", entry.name)),
        }
    }
    if engines.is_empty() {
        return Err(
            Error::Failed("no engine works on this machine; see `asid doctor`".into()).into(),
        );
    }
    Ok(engines)
}

fn write(
    out: &OutFolder,
    result: &ConformanceResult,
    engines: &[Asked],
    check: Vec<String>,
) -> Result<()> {
    let resolved = Resolved {
        backend: engines.iter().map(|e| e.entry.name.to_owned()).collect(),
        check,
        plugins: plugins::recorded(plugins::used(
            &(engines.iter())
                .map(|e| plugins::file_of::<BackendEntry>(e.entry.name))
                .collect::<Vec<_>>(),
        )),
    };
    out.write(|folder| {
        write_json(&folder.join("result.json"), result)?;
        write_text(
            &folder.join("config.toml"),
            &toml::to_string_pretty(&resolved)?,
        )?;
        write_text(
            &folder.join("report.html"),
            &page::html(result, &super::run::command_line()),
        )
    })
}

fn print(arguments: &Arguments, result: &ConformanceResult, out: Option<&Path>) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    if arguments.json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(result)?)?;
        return Ok(());
    }
    writeln!(stdout, "{}", table(&result.rows))?;
    for engine in &result.engines {
        writeln!(stdout, "{}", sentence(engine))?;
    }
    if let Some(out) = out {
        writeln!(stdout, "report: {}", out.join("report.html").display())?;
    }
    Ok(())
}
