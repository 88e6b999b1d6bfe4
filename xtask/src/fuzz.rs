//! `cargo xtask fuzz` and `cargo xtask kill`: builds the program and its harness in pure Rust, and
//! calls the harness.
//!
//! The harness is the crate `asid-fuzz`, since this crate links no reader.

use std::process::Command;

use anyhow::{Context, Result};

use crate::stage::Stages;

/// Build arguments: a release build, because each reader gets 10^6 inputs.
const BUILD: [&str; 5] = [
    "build",
    "--release",
    "--package=asid",
    "--package=asid-fuzz",
    "--features=asid/logs,asid-fuzz/program",
];

/// Builds, then passes `arguments` on to a subcommand of the harness; false if it finds something.
pub fn run(subcommand: &str, arguments: &[String]) -> Result<bool> {
    let own = std::env::current_exe().context("cannot tell where this program lies")?;
    let target = own.ancestors().nth(2).context("no target folder")?;
    if !Stages::default().cargo("build", &BUILD, &[])? {
        return Ok(false);
    }
    let name = format!("asid-fuzz{}", std::env::consts::EXE_SUFFIX);
    let program = target.join("release").join(name);
    // `repeat READER FILE` is a subcommand of its own.
    let repeat = arguments.first().is_some_and(|a| a == "repeat");
    let mut command = Command::new(&program);
    if !repeat {
        command.arg(subcommand);
    }
    let status = command.args(arguments).status();
    let status = status.with_context(|| format!("cannot start {}", program.display()))?;
    Ok(status.success())
}
