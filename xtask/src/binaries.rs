//! Runs the workspace's tests, two binaries at a time.
//!
//! `cargo test` runs one binary after the other, and the other cores wait for the slowest test of
//! each. Here one call of cargo builds the binaries, and two of them run at any time. The output of
//! a binary is shown when it has ended.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::Mutex;
use std::thread;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::library::repository;
use crate::stage::ALL_FEATURES;

/// Binaries that run at a time.
///
/// Each has as many threads as there are cores, so two fill each other's gaps. A third would only
/// take time from tests that have a time limit.
const AT_A_TIME: usize = 2;

/// Tells tests of plugins that the plugins are already built.
///
/// Otherwise each test would call cargo, which removes the libraries from their places for a moment
/// while another test loads them.
const PLUGINS_ARE_BUILT: &str = "ASID_TESTS_PLUGINS_ARE_BUILT";

/// A test binary of the workspace.
#[derive(Debug, PartialEq)]
struct Binary {
    /// Package and target, such as `asid-core simulator`.
    name: String,
    executable: PathBuf,
    /// The package's folder, where cargo runs its tests.
    folder: PathBuf,
}

/// Builds all tests and runs them, documentation tests last; returns whether all pass.
///
/// # Errors
/// If cargo or a binary cannot be started.
pub fn run() -> Result<bool> {
    let Some(binaries) = build()? else {
        return Ok(false);
    };
    if binaries.is_empty() {
        bail!("cargo named no test binary");
    }
    let failed = run_all(&binaries)?;
    let documented = cargo()
        .args(["test", "--workspace", "--doc", "--no-fail-fast"])
        .arg(ALL_FEATURES)
        .status()
        .context("cannot start cargo")?;
    for name in &failed {
        eprintln!("tests: FAILED: {name}");
    }
    Ok(failed.is_empty() && documented.success())
}

fn cargo() -> Command {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(repository());
    cargo
}

/// Builds the test binaries, then the plugins that they load.
///
/// `None` if a build fails; cargo has then printed the reason.
fn build() -> Result<Option<Vec<Binary>>> {
    let built = cargo()
        .args(["test", "--workspace", "--no-run", ALL_FEATURES])
        .arg("--message-format=json-render-diagnostics")
        .stderr(Stdio::inherit())
        .output()
        .context("cannot start cargo")?;
    if !built.status.success() {
        return Ok(None);
    }
    let plugins = cargo()
        .args(["build", "--workspace", ALL_FEATURES])
        .status()
        .context("cannot start cargo")?;
    if !plugins.success() {
        return Ok(None);
    }
    let lines = String::from_utf8_lossy(&built.stdout);
    Ok(Some(lines.lines().filter_map(binary).collect()))
}

/// The test binary in a message of cargo, if the message is about one.
fn binary(message: &str) -> Option<Binary> {
    let message: Value = serde_json::from_str(message).ok()?;
    if message["profile"]["test"] != true {
        return None;
    }
    let executable = PathBuf::from(message["executable"].as_str()?);
    let folder = Path::new(message["manifest_path"].as_str()?).parent()?;
    let target = message["target"]["name"].as_str()?;
    let kind = message["target"]["kind"][0].as_str()?;
    let package = folder.strip_prefix(repository()).unwrap_or(folder);
    Some(Binary {
        name: format!("{}/ {kind} {target}", package.display()),
        executable,
        folder: folder.to_path_buf(),
    })
}

/// Runs the binaries and shows their output; returns the names of those that failed.
fn run_all(binaries: &[Binary]) -> Result<Vec<String>> {
    let queue = Mutex::new(binaries.iter());
    let failed = Mutex::new(Vec::new());
    let next = || queue.lock().ok()?.next();
    let work = || -> Result<()> {
        while let Some(binary) = next() {
            let start = Instant::now();
            let output = Command::new(&binary.executable)
                .current_dir(&binary.folder)
                .env("CARGO_MANIFEST_DIR", &binary.folder)
                .env(PLUGINS_ARE_BUILT, "1")
                .stdin(Stdio::null())
                .output()
                .with_context(|| format!("cannot start {}", binary.executable.display()))?;
            show(&binary.name, &output, start)?;
            if !output.status.success()
                && let Ok(mut failed) = failed.lock()
            {
                failed.push(format!("{}: {}", binary.name, output.status));
            }
        }
        Ok(())
    };
    thread::scope(|scope| {
        let workers: Vec<_> = (0..AT_A_TIME).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|w| match w.join() {
            Ok(ended) => ended,
            Err(_) => bail!("a thread that runs tests panicked"),
        })
    })?;
    Ok(failed.into_inner().unwrap_or_default())
}

/// Shows the output of a binary in one piece.
fn show(name: &str, output: &Output, start: Instant) -> Result<()> {
    let mut out = std::io::stdout().lock();
    let seconds = start.elapsed().as_secs_f64();
    writeln!(out, "     Running {name} ({seconds:.1} s)")?;
    out.write_all(&output.stdout)?;
    out.write_all(&output.stderr)?;
    Ok(out.flush()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_messages_of_test_binaries_count() {
        let manifest = repository().join("mjcf/Cargo.toml");
        let message = |test: bool, executable: Value| {
            serde_json::json!({
                "reason": "compiler-artifact",
                "manifest_path": manifest,
                "target": { "kind": ["lib"], "name": "asid_mjcf" },
                "profile": { "test": test },
                "executable": executable,
            })
            .to_string()
        };
        let found = binary(&message(true, "/t/asid_mjcf-1".into())).unwrap();
        assert_eq!(found.name, "mjcf/ lib asid_mjcf");
        assert_eq!(found.folder, repository().join("mjcf"));
        assert_eq!(binary(&message(false, "/t/asid".into())), None);
        assert_eq!(binary(&message(true, Value::Null)), None);
        assert_eq!(binary("Compiling asid"), None);
    }

    #[test]
    fn one_that_fails_is_named_and_the_others_run() {
        let folder = tempfile::tempdir().unwrap();
        let of = |name: &str, executable: &str| Binary {
            name: name.into(),
            executable: executable.into(),
            folder: folder.path().to_path_buf(),
        };
        let binaries = [of("a", "false"), of("b", "true"), of("c", "true")];
        let failed = run_all(&binaries).unwrap();
        assert_eq!(failed.len(), 1);
        assert!(failed[0].starts_with("a: "), "{failed:?}");
        assert!(run_all(&[of("none", "/no/such/program")]).is_err());
    }
}
