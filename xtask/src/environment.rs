//! Virtual environments of Python in the target folder, each made from a list of pinned packages
//! with hashes.
//!
//! A stamp with that list is written last, so the next call is quick. An environment that was
//! interrupted, or whose pins have changed, is made again.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};

use crate::wheel::{pip_failure, python};

/// File in the environment that lists the pins from which it was made.
const STAMP: &str = "pins.txt";

/// Arguments of pip for a list of pins: it takes only the listed files and checks every hash.
const PINNED: [&str; 10] = [
    "-m",
    "pip",
    "install",
    "--quiet",
    "--disable-pip-version-check",
    "--no-input",
    "--no-deps",
    "--require-hashes",
    "--only-binary=:all:",
    "--requirement",
];

/// The Python of an environment in `folder` with every package of `list`.
///
/// `size` tells the user how much is fetched.
///
/// # Errors
/// If there is no Python with pip, or if a package is not available.
pub fn of(folder: &Path, list: &Path, size: &str) -> Result<PathBuf> {
    let pins = fs::read_to_string(list).with_context(|| list.display().to_string())?;
    let program = folder.join("bin/python");
    let stamp = folder.join(STAMP);
    if program.exists() && fs::read_to_string(&stamp).is_ok_and(|stamped| stamped == pins) {
        println!("{:<8}ready in {}", "python", folder.display());
        return Ok(program);
    }
    println!(
        "{:<8}fetching packages into {} ({size})",
        "python",
        folder.display()
    );
    let make = ["-m", "venv", "--clear"];
    call(Path::new(python()?), &make, &[folder])?;
    call(&program, &PINNED, &[list])?;
    fs::write(&stamp, pins).with_context(|| stamp.display().to_string())?;
    Ok(program)
}

/// Runs Python; repeats its output if it fails.
///
/// # Errors
/// If it cannot be started, or fails.
pub fn call(program: &Path, arguments: &[&str], paths: &[&Path]) -> Result<()> {
    let output = Command::new(program)
        .args(arguments)
        .args(paths)
        .stdin(Stdio::null())
        .output()
        .with_context(|| format!("cannot start {}", program.display()))?;
    if !output.status.success() {
        bail!("{}", pip_failure(&String::from_utf8_lossy(&output.stderr)));
    }
    Ok(())
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// Checks that every line has a hash, because pip checks hashes only then.
    ///
    /// With `--no-deps` pip takes nothing but the list.
    pub fn assert_pinned(list: &Path, names: &[&str]) {
        let text = fs::read_to_string(list).unwrap().replace("\\\n", " ");
        let lines: Vec<&str> = text.lines().filter(|l| !l.starts_with('#')).collect();
        for name in names {
            assert!(lines.iter().any(|l| l.starts_with(&format!("{name}=="))));
        }
        for line in lines {
            assert!(
                line.contains("==") && line.contains("--hash=sha256:"),
                "{line}"
            );
            assert!(!line.contains("://") && !line.contains("index"), "{line}");
        }
    }
}
