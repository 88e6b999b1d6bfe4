//! `asid compare`: methods head to head, over conditions and seeds.

use std::fmt::Write as _;
use std::io::Write as _;
use std::time::Instant;

use anyhow::Result;
use asid_core::Error;
use asid_core::pipeline::{self, Method};
use asid_core::registry::{ExplorerEntry, IdentifierEntry, SolverEntry, TaskEntry, find};
use asid_core::task::Condition;
use serde::Serialize;

use super::config::ASID;
use super::options::{Algorithms, Common, Real};
use super::output::{OutFolder, write_json, write_text};
use super::result::Versions;
use super::session::Session;
use statistics::{bootstrap, interquartile_mean, median};

mod statistics;

/// Arguments of `compare`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Tasks [default: all]
    tasks: Vec<String>,
    /// Method: asid, random, dr (repeatable) [default: all]
    #[arg(long, value_name = "M")]
    method: Vec<String>,
    /// Condition of the task, such as left (repeatable) [default: all]
    #[arg(long, value_name = "NAME")]
    condition: Vec<String>,
    /// Runs of each method and condition
    #[arg(long, value_name = "N", default_value_t = 10)]
    seeds: u64,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    algorithms: Algorithms,
}

/// A method: explorer (where it explores), identifier and solver.
struct MethodEntry {
    name: &'static str,
    explorer: Option<&'static str>,
    identifies: bool,
}

const METHODS: [MethodEntry; 3] = [
    MethodEntry {
        name: "asid",
        explorer: Some(ASID.explorer),
        identifies: true,
    },
    MethodEntry {
        name: "random",
        explorer: Some("random"),
        identifies: true,
    },
    MethodEntry {
        name: "dr",
        explorer: None,
        identifies: false,
    },
];

/// How well one unknown was identified over the runs of a row.
#[derive(Serialize)]
struct Identification {
    name: String,
    unit: String,
    median_abs_error: f64,
    coverage95: f64,
    median_width95: f64,
    median_expected_std: f64,
}

/// One row of the table.
#[derive(Serialize)]
struct Row {
    task: String,
    condition: String,
    method: String,
    backend: String,
    metric: String,
    n: usize,
    mean: f64,
    std: f64,
    iqm: f64,
    interval95: [f64; 2],
    success_rate: f64,
    values: Vec<f64>,
    paper: Option<f64>,
    identification: Vec<Identification>,
}

/// One run, for those who want to look closer.
#[derive(Serialize)]
struct Run {
    task: String,
    condition: String,
    method: String,
    seed: u64,
    truth: Vec<f64>,
    estimate: Vec<f64>,
    std: Vec<f64>,
    interval95: Vec<[f64; 2]>,
    expected_std: Vec<f64>,
    residual: f64,
    contact_fraction: f64,
    value: f64,
    success: bool,
    wall_s: f64,
}

#[derive(Serialize)]
struct CompareResult {
    schema: u32,
    rows: Vec<Row>,
    versions: Versions,
}

/// Runs the comparison and writes its folder.
pub fn compare(arguments: &Arguments) -> Result<()> {
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
    let mut rows = Vec::new();
    let mut runs = Vec::new();
    let mut versions = None;
    let mut config = None;
    let total = plan.len() as u64 * methods.len() as u64 * arguments.seeds;
    let clock = Instant::now();
    for (task, condition) in &plan {
        for method in &methods {
            let mut of_row = Vec::new();
            for k in 0..arguments.seeds {
                let session = open(arguments, task, condition, method, k)?;
                let run = one(&session, condition, method)?;
                of_row.push(run);
                versions.get_or_insert_with(|| Versions::of(&session));
                config.get_or_insert_with(|| toml::to_string_pretty(&session.config));
                let done = (runs.len() + of_row.len()) as u64;
                if !arguments.common.quiet {
                    let left = clock.elapsed().as_secs_f64() / done as f64 * (total - done) as f64;
                    let _ = write!(
                        std::io::stderr(),
                        "\r{done}/{total} runs, {left:.0} s left ({task}, {}, {})      ",
                        condition.name,
                        method.name
                    );
                }
            }
            rows.push(row(arguments, task, condition, method, &of_row)?);
            runs.extend(of_row);
        }
    }
    if !arguments.common.quiet {
        let _ = writeln!(std::io::stderr());
    }
    let (Some(versions), Some(config)) = (versions, config) else {
        return Err(Error::Failed("there is nothing to compare".into()).into());
    };
    let result = CompareResult {
        schema: 1,
        rows,
        versions,
    };
    let config = config?;
    let table = table(&result.rows);
    out.write(|folder| {
        write_json(&folder.join("result.json"), &result)?;
        write_json(&folder.join("runs.json"), &runs)?;
        write_text(&folder.join("config.toml"), &config)?;
        write_text(
            &folder.join("table.md"),
            &format!("{table}\n`{}`\n", super::run::command_line()),
        )
    })?;
    let mut stdout = std::io::stdout().lock();
    if arguments.common.json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(&result)?)?;
    } else {
        writeln!(stdout, "{table}\nresults: {}", out.path().display())?;
    }
    Ok(())
}

fn chosen_methods(names: &[String]) -> Result<Vec<&'static MethodEntry>> {
    if names.is_empty() {
        return Ok(METHODS.iter().collect());
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

fn chosen_conditions(all: &[Condition], names: &[String]) -> Result<Vec<Condition>> {
    if names.is_empty() {
        return Ok(all.to_vec());
    }
    names
        .iter()
        .map(|name| {
            let found = all.iter().find(|c| &c.name == name).cloned();
            found.ok_or_else(|| {
                Error::unknown("condition", name, all.iter().map(|c| &*c.name)).into()
            })
        })
        .collect()
}

fn open(
    arguments: &Arguments,
    task: &str,
    condition: &Condition,
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
    let real = Real {
        truth: condition
            .truth
            .iter()
            .map(|(n, v)| format!("{n}={v}"))
            .collect(),
        ..Real::default()
    };
    Session::open(task, &common, &algorithms, &real)
}

fn one(session: &Session, condition: &Condition, method: &MethodEntry) -> Result<Run> {
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
    };
    let outcome = pipeline::run(&problem, chosen, &mut world)?;
    Ok(Run {
        task: config.task.clone(),
        condition: condition.name.clone(),
        method: method.name.to_owned(),
        seed: config.seed,
        estimate: outcome.belief.mean(),
        std: outcome.belief.marginals.iter().map(|m| m.std).collect(),
        interval95: outcome
            .belief
            .marginals
            .iter()
            .map(|m| m.interval95)
            .collect(),
        expected_std: outcome
            .information
            .expected_std
            .last()
            .cloned()
            .unwrap_or_default(),
        residual: outcome.identified.as_ref().map_or(f64::NAN, |f| f.residual),
        contact_fraction: outcome.real.as_ref().map_or(0.0, |r| r.contact_fraction),
        value: outcome.attempt.outcome.value,
        success: outcome.attempt.outcome.success,
        wall_s: clock.elapsed().as_secs_f64(),
        truth,
    })
}

fn row(
    arguments: &Arguments,
    task: &str,
    condition: &Condition,
    method: &MethodEntry,
    runs: &[Run],
) -> Result<Row> {
    let session = open(arguments, task, condition, method, 0)?;
    let values: Vec<f64> = runs.iter().map(|r| r.value).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    let identification = session
        .parameters
        .iter()
        .enumerate()
        .filter(|_| method.identifies)
        .map(|(i, p)| Identification {
            name: p.name.clone(),
            unit: p.unit.clone(),
            median_abs_error: median(runs.iter().map(|r| (r.estimate[i] - r.truth[i]).abs())),
            coverage95: runs
                .iter()
                .filter(|r| r.interval95[i][0] <= r.truth[i] && r.truth[i] <= r.interval95[i][1])
                .count() as f64
                / n,
            median_width95: median(runs.iter().map(|r| r.interval95[i][1] - r.interval95[i][0])),
            median_expected_std: median(runs.iter().filter_map(|r| r.expected_std.get(i).copied())),
        })
        .collect();
    Ok(Row {
        task: task.to_owned(),
        condition: condition.name.clone(),
        method: method.name.to_owned(),
        backend: session.config.backend.clone(),
        metric: session.task.downstream().metric.clone(),
        n: values.len(),
        mean,
        std: variance.sqrt(),
        iqm: interquartile_mean(&values),
        interval95: bootstrap(&values),
        success_rate: runs.iter().filter(|r| r.success).count() as f64 / n,
        values,
        paper: None,
        identification,
    })
}

/// The table as Markdown.
fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| task | condition | method | n | metric | mean (95 %) | success | median error | coverage | width | expected std |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for r in rows {
        let _ = write!(
            text,
            "| {} | {} | {} | {} | {} | {:.2} ({:.2} to {:.2}) | {:.0} % |",
            r.task,
            r.condition,
            r.method,
            r.n,
            r.metric,
            r.mean,
            r.interval95[0],
            r.interval95[1],
            100.0 * r.success_rate
        );
        let list = |f: &dyn Fn(&Identification) -> String| {
            r.identification
                .iter()
                .map(f)
                .collect::<Vec<_>>()
                .join(", ")
        };
        let _ = writeln!(
            text,
            " {} | {} | {} | {} |",
            list(&|i| format!("{:.4} {}", i.median_abs_error, i.unit)),
            list(&|i| format!("{:.0} %", 100.0 * i.coverage95)),
            list(&|i| format!("{:.4} {}", i.median_width95, i.unit)),
            list(&|i| format!("{:.4} {}", i.median_expected_std, i.unit)),
        );
    }
    text
}
