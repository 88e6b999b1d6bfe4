//! `asid compare`: methods head to head, over conditions and seeds.

use std::io::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::Result;
use asid_core::Error;
use asid_core::pipeline::{self, Method};
use asid_core::registry::{ExplorerEntry, IdentifierEntry, SolverEntry, TaskEntry, find};
use asid_core::task::Condition;

use super::config::{ASID, check_condition};
use super::figure;
use super::options::{Algorithms, Common, Worlds};
use super::output::{OutFolder, write_json, write_text};
use super::result::Versions;
use super::session::Session;
use table::{CompareResult, Run, RunParameter};

mod page;
pub(super) mod statistics;
mod table;

/// Arguments of `compare`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Tasks [default: all]
    tasks: Vec<String>,
    /// Method: asid, random, dr (repeatable) [default: these], or oracle, whose solver knows the truth
    #[arg(long, value_name = "M")]
    method: Vec<String>,
    /// Condition of the task, such as left (repeatable) [default: all], or prior, whose truths are
    /// drawn from the whole prior
    #[arg(long, value_name = "NAME")]
    condition: Vec<String>,
    /// Runs of each method and condition
    #[arg(long, value_name = "N", default_value_t = 10)]
    seeds: u64,
    /// Draws a figure of the paper instead: patches, displacement, laptop, distractors or
    /// generalization; --explorer chooses whose episodes, --episodes how many
    #[arg(long, value_name = "NAME")]
    figure: Option<String>,
    /// Episodes of each explorer in a figure, or of each square of its map
    #[arg(long, value_name = "N", requires = "figure")]
    episodes: Option<u64>,
    /// Puts finished comparisons together instead, such as those of several machines
    #[arg(long, value_name = "DIR", num_args = 1..)]
    merge: Vec<PathBuf>,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    algorithms: Algorithms,
    #[command(flatten)]
    worlds: Worlds,
}

/// A method: explorer (where it explores), identifier and solver.
struct MethodEntry {
    name: &'static str,
    explorer: Option<&'static str>,
    identifies: bool,
    knows: bool,
}

/// Methods that need not be named: all but the oracle, which shows what the task allows.
const BY_DEFAULT: usize = 3;

const METHODS: [MethodEntry; 4] = [
    MethodEntry {
        name: "asid",
        explorer: Some(ASID.explorer),
        identifies: true,
        knows: false,
    },
    MethodEntry {
        name: "random",
        explorer: Some("random"),
        identifies: true,
        knows: false,
    },
    MethodEntry {
        name: "dr",
        explorer: None,
        identifies: false,
        knows: false,
    },
    MethodEntry {
        name: "oracle",
        explorer: None,
        identifies: false,
        knows: true,
    },
];

/// Runs the comparison and writes its folder.
pub fn compare(arguments: &Arguments) -> Result<()> {
    if let Some(name) = &arguments.figure {
        return figure::figure(
            name,
            &figure::Request {
                common: &arguments.common,
                episodes: arguments.episodes,
                explorers: arguments.algorithms.explorer.iter().cloned().collect(),
                quick: false,
            },
        );
    }
    if !arguments.merge.is_empty() {
        return merge(arguments);
    }
    let tasks: Vec<String> = if arguments.tasks.is_empty() {
        asid_core::registry::all::<TaskEntry>()
            .iter()
            .map(|t| t.name.to_owned())
            .collect()
    } else {
        arguments.tasks.clone()
    };
    let methods = chosen_methods(&arguments.method)?;
    if arguments.seeds == 0 {
        return Err(Error::Config {
            key: "--seeds".into(),
            message: "must be at least 1".into(),
        }
        .into());
    }
    let mut plan = Vec::new();
    for task in &tasks {
        let made = (find::<TaskEntry>(task)?.make)()?;
        for condition in chosen_conditions(&made.conditions(), &arguments.condition)? {
            plan.push((task.clone(), condition));
        }
    }
    let out = OutFolder::claim(arguments.common.out.as_deref(), "compare")?;
    let mut runs = Vec::new();
    let mut made_by = None;
    let total = plan.len() as u64 * methods.len() as u64 * arguments.seeds;
    let clock = Instant::now();
    for (task, condition) in &plan {
        for method in &methods {
            for k in 0..arguments.seeds {
                let session = open(arguments, task, condition, method, k)?;
                runs.push(one(&session, condition, method)?);
                if made_by.is_none() {
                    let config = toml::to_string_pretty(&session.config)?;
                    made_by = Some((serde_json::to_value(Versions::of(&session))?, config));
                }
                if !arguments.common.quiet {
                    let done = runs.len() as u64;
                    let left = clock.elapsed().as_secs_f64() / done as f64 * (total - done) as f64;
                    let _ = write!(
                        std::io::stderr(),
                        "\r{done}/{total} runs, {left:.0} s left ({task}, {condition}, {})      ",
                        method.name
                    );
                }
            }
        }
    }
    if !arguments.common.quiet {
        let _ = writeln!(std::io::stderr());
    }
    let Some((versions, config)) = made_by else {
        return Err(Error::Failed("there is nothing to compare".into()).into());
    };
    write(arguments, &out, runs, versions, &config)
}

/// Puts the runs of finished comparisons together.
fn merge(arguments: &Arguments) -> Result<()> {
    let out = OutFolder::claim(arguments.common.out.as_deref(), "compare")?;
    let mut runs: Vec<Run> = Vec::new();
    let mut made_by = None;
    for folder in &arguments.merge {
        let read = |name: &str| {
            let path = folder.join(name);
            std::fs::read_to_string(&path).map_err(|e| Error::File {
                path,
                message: format!("{e}; is this the folder of a finished comparison?"),
            })
        };
        let wrong = |name: &str, e: serde_json::Error| Error::File {
            path: folder.join(name),
            message: e.to_string(),
        };
        let more: Vec<Run> =
            serde_json::from_str(&read("runs.json")?).map_err(|e| wrong("runs.json", e))?;
        let result: serde_json::Value =
            serde_json::from_str(&read("result.json")?).map_err(|e| wrong("result.json", e))?;
        for run in more {
            if runs.iter().any(|r| r.same_as(&run)) {
                return Err(Error::File {
                    path: folder.join("runs.json"),
                    message: format!(
                        "{} {} {} on {}, seed {}, is in more than one folder",
                        run.task, run.condition, run.method, run.backend, run.seed
                    ),
                }
                .into());
            }
            runs.push(run);
        }
        if made_by.is_none() {
            made_by = Some((result["versions"].clone(), read("config.toml")?));
        }
    }
    let (versions, config) = made_by.unwrap_or_default();
    write(arguments, &out, runs, versions, &config)
}

/// Writes the folder and prints the table.
fn write(
    arguments: &Arguments,
    out: &OutFolder,
    runs: Vec<Run>,
    versions: serde_json::Value,
    config: &str,
) -> Result<()> {
    let result = CompareResult {
        schema: 1,
        rows: table::rows(&runs),
        versions,
    };
    let markdown = table::markdown(&result.rows);
    let command = super::run::command_line();
    out.write(|folder| {
        write_json(&folder.join("result.json"), &result)?;
        write_json(&folder.join("runs.json"), &runs)?;
        write_text(&folder.join("config.toml"), config)?;
        write_text(
            &folder.join("table.md"),
            &format!("{markdown}\n`{command}`\n"),
        )?;
        write_text(
            &folder.join("report.html"),
            &page::html(&result, &runs, &command),
        )
    })?;
    let mut stdout = std::io::stdout().lock();
    if arguments.common.json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(&result)?)?;
    } else {
        writeln!(
            stdout,
            "{markdown}\nreport: {}",
            out.path().join("report.html").display()
        )?;
    }
    Ok(())
}

fn chosen_methods(names: &[String]) -> Result<Vec<&'static MethodEntry>> {
    if names.is_empty() {
        return Ok(METHODS[..BY_DEFAULT].iter().collect());
    }
    names
        .iter()
        .map(|name| {
            let found = METHODS.iter().find(|m| m.name == name);
            found.ok_or_else(|| {
                Error::unknown("method", name, METHODS.iter().map(|m| m.name)).into()
            })
        })
        .collect()
}

fn chosen_conditions(all: &[Condition], names: &[String]) -> Result<Vec<String>> {
    if names.is_empty() {
        return Ok(all.iter().map(|c| c.name.clone()).collect());
    }
    for name in names {
        check_condition(all, name)?;
    }
    Ok(names.to_vec())
}

fn open(
    arguments: &Arguments,
    task: &str,
    condition: &str,
    method: &MethodEntry,
    k: u64,
) -> Result<Session> {
    let mut common = arguments.common.clone();
    common.seed = Some(common.seed.unwrap_or(0) + k);
    common.quiet = true;
    let mut algorithms = arguments.algorithms.clone();
    if method.explorer != Some(ASID.explorer) {
        algorithms.explorer = method.explorer.map(str::to_owned);
        common.set.retain(|s| !s.starts_with("explorer."));
    }
    common.set.push(format!("condition={condition:?}"));
    Session::open(task, &common, &algorithms, &arguments.worlds)
}

/// One run of a method under a condition.
fn one(session: &Session, condition: &str, method: &MethodEntry) -> Result<Run> {
    let clock = Instant::now();
    let config = &session.config;
    let explorer = (find::<ExplorerEntry>(&config.explorer.name)?.make)(&config.explorer.settings)?;
    let identifier =
        (find::<IdentifierEntry>(&config.identifier.name)?.make)(&config.identifier.settings)?;
    let solver = (find::<SolverEntry>(&config.solver.name)?.make)(&config.solver.settings)?;
    let truth = session.truth();
    let problem = session.problem();
    let mut world = session.world(&truth)?;
    let chosen = Method {
        explorer: method.explorer.map(|_| &*explorer),
        identifier: method.identifies.then_some(&*identifier),
        solver: &*solver,
        known: method.knows.then_some(&*truth),
    };
    let outcome = pipeline::run(&problem, chosen, &mut world)?;
    let expected = outcome.information.expected_std.last();
    Ok(Run {
        task: config.task.clone(),
        condition: condition.to_owned(),
        method: method.name.to_owned(),
        backend: config.backend.clone(),
        seed: config.seed,
        parameters: outcome
            .belief
            .marginals
            .iter()
            .enumerate()
            .map(|(i, m)| RunParameter {
                name: m.name.clone(),
                unit: m.unit.clone(),
                truth: truth[i],
                estimate: m.estimate,
                std: m.std,
                interval95: m.interval95,
                expected_std: expected.map(|e| e[i]),
            })
            .collect(),
        residual: outcome.identified.as_ref().map(|f| f.residual),
        contact_fraction: outcome.real.as_ref().map(|r| r.contact_fraction),
        metric: session.task.downstream().metric.clone(),
        value: outcome.attempt.outcome.value,
        success: outcome.attempt.outcome.success,
        wall_s: clock.elapsed().as_secs_f64(),
    })
}
