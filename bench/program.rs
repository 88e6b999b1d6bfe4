//! The program itself: whole runs, identification alone, start-up time.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use serde::Serialize;

/// Number of starts of a command that are timed.
const STARTS: usize = 20;

/// Cost of one call of the program.
#[derive(Clone, Debug, Serialize)]
pub struct RunRow {
    engine: String,
    command: String,
    /// Time from the start of the process to its end.
    wall_s: f64,
    physics_steps: u64,
}

/// Run time of a command that computes nothing.
#[derive(Clone, Debug, Serialize)]
pub struct StartRow {
    command: String,
    starts: usize,
    least_s: f64,
    median_s: f64,
}

/// Path of the `asid` program beside this one.
///
/// # Errors
/// If it is missing.
pub fn find() -> Result<PathBuf> {
    let own = std::env::current_exe().context("cannot tell where this program lies")?;
    let asid = own.with_file_name(format!("asid{}", std::env::consts::EXE_SUFFIX));
    if !asid.exists() {
        bail!(
            "no {}: build it with the same profile and features, as `cargo xtask bench` does",
            asid.display()
        );
    }
    Ok(asid)
}

/// Times a whole run with the defaults, and identification alone from its log.
///
/// # Errors
/// If the program fails.
pub fn runs(asid: &Path, task: &str, engine: &str) -> Result<Vec<RunRow>> {
    let folder = tempfile::tempdir().context("cannot make a temporary folder")?;
    let whole = folder.path().join("run");
    let identified = folder.path().join("identify");
    let log = whole.join("real.csv");
    let text = |p: &Path| p.display().to_string();
    let common = ["--backend", engine, "--quiet"];
    eprintln!("program: {engine}, run {task}");
    let run = ["run", task, "--out", &text(&whole)];
    let run = call(asid, &[&run[..], &common].concat(), &whole)?;
    eprintln!("program: {engine}, identify {task}");
    let identify = [
        "identify",
        task,
        "--log",
        &text(&log),
        "--out",
        &text(&identified),
    ];
    let identify = call(asid, &[&identify[..], &common].concat(), &identified)?;
    let row = |name: &str, (wall_s, physics_steps)| RunRow {
        engine: engine.to_owned(),
        command: format!("asid {name} {task}"),
        wall_s,
        physics_steps,
    };
    Ok(vec![row("run", run), row("identify", identify)])
}

/// Calls the program; returns its wall-clock time and the physics steps in its `result.json`.
fn call(asid: &Path, arguments: &[&str], out: &Path) -> Result<(f64, u64)> {
    let start = Instant::now();
    let status = Command::new(asid)
        .args(arguments)
        .stdout(Stdio::null())
        .status()
        .context("cannot start asid")?;
    let wall_s = start.elapsed().as_secs_f64();
    if !status.success() {
        bail!("`asid {}` ended with {status}", arguments.join(" "));
    }
    let path = out.join("result.json");
    let result = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let result: serde_json::Value = serde_json::from_slice(&result)?;
    let steps = result["cost"]["physics_steps"]
        .as_u64()
        .context("result.json has no cost.physics_steps")?;
    Ok((wall_s, steps))
}

/// Times commands that only start and print.
///
/// # Errors
/// If the program fails.
pub fn starts(asid: &Path) -> Result<Vec<StartRow>> {
    [&["list"][..], &["run", "--help"]]
        .into_iter()
        .map(|arguments| {
            let command = format!("asid {}", arguments.join(" "));
            eprintln!("start: {command}");
            let mut seconds = Vec::with_capacity(STARTS);
            for _ in 0..STARTS {
                let start = Instant::now();
                let status = Command::new(asid)
                    .args(arguments)
                    .stdout(Stdio::null())
                    .status()
                    .context("cannot start asid")?;
                seconds.push(start.elapsed().as_secs_f64());
                if !status.success() {
                    bail!("`{command}` ended with {status}");
                }
            }
            seconds.sort_by(f64::total_cmp);
            Ok(StartRow {
                command,
                starts: STARTS,
                least_s: seconds[0],
                median_s: seconds[STARTS / 2],
            })
        })
        .collect()
}

/// The runs as a table.
pub fn table_of_runs(rows: &[RunRow]) -> Vec<Vec<String>> {
    rows.iter()
        .map(|r| {
            vec![
                r.engine.clone(),
                format!("`{}`", r.command),
                format!("{:.1}", r.wall_s),
                format!("{:.2}", r.physics_steps as f64 / 1e6),
            ]
        })
        .collect()
}

/// The start-up times as a table.
pub fn table_of_starts(rows: &[StartRow]) -> Vec<Vec<String>> {
    rows.iter()
        .map(|r| {
            vec![
                format!("`{}`", r.command),
                format!("{:.1}", 1e3 * r.least_s),
                format!("{:.1}", 1e3 * r.median_s),
            ]
        })
        .collect()
}
