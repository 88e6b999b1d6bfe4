//! Kills commands while they work. No partial result may have its final name, and the same command
//! must succeed afterwards.
//!
//! Half of the kills come at any time between start and end. The other half come in the short time
//! in which files are written: after a staging folder has appeared.

mod commands;
mod left;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use asid_core::rng::Streams;
use rand::Rng as _;

use commands::{COMMANDS, Case};

/// Maximum time between the appearance of a staging folder and the kill: writing takes some
/// milliseconds.
const WRITING: Duration = Duration::from_millis(20);

/// Arguments of `kill`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Commands [default: all]
    commands: Vec<String>,
    /// Kills of each command
    #[arg(long, value_name = "N", default_value_t = 100)]
    times: u64,
    /// Seed of the moments
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// The program [default: asid beside this one]
    #[arg(long, value_name = "FILE")]
    asid: Option<PathBuf>,
}

/// Counts of one command.
#[derive(Default)]
struct Count {
    kills: u64,
    /// Kills while files were being written.
    writing: u64,
    /// Kills that came after the command had ended.
    late: u64,
    faults: Vec<String>,
}

/// Kills commands; true if nothing was found.
///
/// # Errors
/// If a command is not known, cannot be started, or fails without a kill.
pub fn kill(arguments: &Arguments) -> Result<bool> {
    let asid = match &arguments.asid {
        Some(asid) => std::path::absolute(asid)?,
        None => {
            std::env::current_exe()?.with_file_name(format!("asid{}", std::env::consts::EXE_SUFFIX))
        }
    };
    ensure!(
        asid.exists(),
        "no {}: build it with the same profile",
        asid.display()
    );
    for name in &arguments.commands {
        if !COMMANDS.iter().any(|c| c.name == name) {
            let known: Vec<&str> = COMMANDS.iter().map(|c| c.name).collect();
            bail!("unknown command `{name}`; known: {}", known.join(", "));
        }
    }
    let chosen =
        |c: &&Case| arguments.commands.is_empty() || arguments.commands.iter().any(|n| n == c.name);
    println!("| command | kills | while writing | too late | faults |\n|---|--:|--:|--:|--:|");
    let mut clean = true;
    for case in COMMANDS.iter().filter(chosen) {
        let count = try_case(case, &asid, arguments)?;
        let faults = count.faults.len();
        println!(
            "| `asid {}` | {} | {} | {} | {faults} |",
            case.name, count.kills, count.writing, count.late
        );
        count
            .faults
            .iter()
            .for_each(|f| eprintln!("{}: {f}", case.name));
        clean &= faults == 0;
    }
    Ok(clean)
}

fn try_case(case: &Case, asid: &Path, arguments: &Arguments) -> Result<Count> {
    let folder = tempfile::tempdir().context("cannot make a temporary folder")?;
    let start = Instant::now();
    let whole = folder.path().join("whole");
    std::fs::create_dir(&whole)?;
    (case.prepare)(&whole, asid)?;
    let prepared = start.elapsed();
    run(case, asid, &whole)?;
    let takes = start.elapsed() - prepared;
    let wanted = left::files(&whole.join(case.out))?;
    let streams = Streams::new(arguments.seed).child(case.name);
    let mut count = Count::default();
    for k in 0..arguments.times {
        let mut rng = streams.indexed("moment", k);
        let place = folder.path().join(format!("{k}"));
        std::fs::create_dir(&place)?;
        (case.prepare)(&place, asid)?;
        // A folder that already exists is filled in another way than a new one.
        if case.folder && k % 4 >= 2 {
            std::fs::create_dir_all(place.join(case.out))?;
        }
        let mut child = command(case, asid, &place)
            .spawn()
            .context("cannot start asid")?;
        let killed = if k % 2 == 0 {
            wait(&mut child, takes.mul_f64(rng.random()))?
        } else {
            let seen = wait_for_staging(&mut child, &place)?;
            count.writing += u64::from(seen);
            seen && wait(&mut child, WRITING.mul_f64(rng.random()))?
        };
        // SIGKILL, so that the process cannot clean up.
        let _ = child.kill();
        child.wait()?;
        count.kills += u64::from(killed);
        count.late += u64::from(!killed);
        if let Err(fault) = look(case, asid, &place, &wanted) {
            count.faults.push(format!("kill {k}: {fault:#}"));
        }
        std::fs::remove_dir_all(&place)?;
        eprint!("\r{}: {} of {}", case.name, k + 1, arguments.times);
    }
    eprintln!();
    Ok(count)
}

/// Checks what is left, and a second call.
fn look(case: &Case, asid: &Path, place: &Path, wanted: &[String]) -> Result<()> {
    let out = place.join(case.out);
    left::check_files(&out)?;
    // If the result is complete, there is nothing more to do.
    if left::files(&out)? == wanted && !case.repeats {
        return Ok(());
    }
    run(case, asid, place).context("the second call")?;
    left::check_files(&out)?;
    let found = left::files(&out)?;
    ensure!(
        found == wanted,
        "after the second call there are {found:?}, not {wanted:?}"
    );
    let mut hidden = left::hidden(place)?;
    hidden.retain(|n| n.starts_with(".asid-"));
    ensure!(hidden.is_empty(), "the second call leaves {hidden:?}");
    Ok(())
}

fn command(case: &Case, asid: &Path, place: &Path) -> Command {
    let mut command = Command::new(asid);
    command
        .args(case.call())
        .current_dir(place)
        .env_remove("ASID_PLUGIN_PATH")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command
}

/// Calls the command and waits for its end.
fn run(case: &Case, asid: &Path, place: &Path) -> Result<()> {
    let output = command(case, asid, place)
        .stderr(Stdio::piped())
        .output()
        .context("cannot start asid")?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(
        output.status.success(),
        "`asid {}`: {}",
        case.call().join(" "),
        said.trim()
    );
    Ok(())
}

/// Waits for a while; false if the process ends before.
fn wait(child: &mut Child, time: Duration) -> Result<bool> {
    std::thread::sleep(time);
    Ok(child.try_wait()?.is_none())
}

/// Waits until files are being written; false if the process ends before that.
fn wait_for_staging(child: &mut Child, place: &Path) -> Result<bool> {
    loop {
        if !left::hidden(place)?.is_empty() {
            return Ok(true);
        }
        if child.try_wait()?.is_some() {
            return Ok(false);
        }
        std::thread::yield_now();
    }
}
