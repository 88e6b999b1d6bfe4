//! The Python side of `cargo xtask bench --peers`: a virtual environment of its own.
//!
//! It lies in the target folder and is made from a list of pinned packages with
//! hashes. A stamp with that list, written last, makes the next call quick, and
//! an environment that was interrupted or whose pins have changed is made anew.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};

use crate::library::repository;
use crate::wheel::{pip_failure, python};

/// File in the environment that lists the pins it was made from.
const STAMP: &str = "pins.txt";

/// The Python of an environment in `folder` that has every pinned package.
///
/// # Errors
/// When there is no Python with pip, or a package cannot be had.
pub fn environment(folder: &Path) -> Result<PathBuf> {
    let list = repository().join("bench/peers/requirements.txt");
    let pins = fs::read_to_string(&list).with_context(|| list.display().to_string())?;
    let program = folder.join("bin/python");
    let stamp = folder.join(STAMP);
    if program.exists() && fs::read_to_string(&stamp).is_ok_and(|stamped| stamped == pins) {
        println!("{:<8}ready in {}", "peers", folder.display());
        return Ok(program);
    }
    println!(
        "{:<8}fetching Python packages into {} (2.3 GB; 4.2 GB laid out)",
        "peers",
        folder.display()
    );
    let make = ["-m", "venv", "--clear"].map(Into::into);
    call(Path::new(python()?), &make, &[folder])?;
    let install = [
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
    call(&program, &install.map(Into::into), &[&list])?;
    fs::write(&stamp, pins).with_context(|| stamp.display().to_string())?;
    Ok(program)
}

/// Runs Python; what it says is repeated where it fails.
fn call(program: &Path, arguments: &[String], paths: &[&Path]) -> Result<()> {
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
mod tests {
    use super::*;

    /// pip checks a hash only where every line has one, and `--no-deps` takes nothing but the list.
    #[test]
    fn every_package_is_pinned_with_a_hash_and_no_index_is_named() {
        let list = repository().join("bench/peers/requirements.txt");
        let text = fs::read_to_string(list).unwrap().replace("\\\n", " ");
        let lines: Vec<&str> = text.lines().filter(|l| !l.starts_with('#')).collect();
        for name in ["mujoco", "stable-baselines3", "torch"] {
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

    /// Both sides run the same engine.
    #[test]
    fn the_peer_has_the_version_of_mujoco_that_is_linked() {
        let list = repository().join("bench/peers/requirements.txt");
        let version = crate::library::MUJOCO.wheels[0].version;
        let text = fs::read_to_string(list).unwrap();
        assert!(text.contains(&format!("\nmujoco=={version} ")));
    }
}
