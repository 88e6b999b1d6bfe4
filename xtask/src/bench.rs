//! `cargo xtask bench`: builds the program and its benchmark with every engine, and runs the
//! benchmark.
//!
//! The crate `asid-bench` measures, since this crate links no engine. With `--peers` it measures
//! against Python instead, if the packages are available.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::library::{MUJOCO, TORCH};
use crate::peers;
use crate::setup;
use crate::stage::Stages;

/// Build arguments of the comparison with the engines' own loops.
const BUILD: [&str; 7] = [
    "build",
    "--release",
    "--package=asid",
    "--package=asid-bench",
    "--package=asid-mujoco-plugin",
    "--package=asid-rapier-plugin",
    "--features=asid/mujoco,asid-bench/mujoco",
];

/// Build arguments of the comparison with Python.
const BUILD_PEERS: [&str; 4] = [
    "build",
    "--release",
    "--package=asid-bench",
    "--features=asid-bench/peers",
];

/// Sets up the libraries, builds in release and passes `arguments` on.
pub fn run(arguments: &[String]) -> Result<bool> {
    let own = std::env::current_exe().context("cannot tell where this program lies")?;
    let target = own.ancestors().nth(2).context("no target folder")?;
    if arguments.iter().any(|a| a == "--peers") {
        return against(target, arguments);
    }
    setup::run(&[&MUJOCO])?;
    Ok(Stages::default().cargo("build", &BUILD, &[])? && measure(target, arguments, None)?)
}

/// Measures against Python. Without its packages it reports this and measures nothing.
fn against(target: &Path, arguments: &[String]) -> Result<bool> {
    setup::run(&[&MUJOCO, &TORCH])?;
    let python = match peers::environment(&target.join("peers")) {
        Ok(python) => python,
        Err(error) => {
            println!("{:<8}left out: {error:#}", "peers");
            return Ok(true);
        }
    };
    let built = Stages::default().cargo("build", &BUILD_PEERS, &[])?;
    Ok(built && measure(target, arguments, Some(python))?)
}

fn measure(target: &Path, arguments: &[String], python: Option<PathBuf>) -> Result<bool> {
    let name = format!("asid-bench{}", std::env::consts::EXE_SUFFIX);
    let program = target.join("release").join(name);
    let mut command = Command::new(&program);
    command.args(arguments);
    if let Some(python) = python {
        command.arg(format!("--python={}", python.display()));
    }
    let status = command
        .status()
        .with_context(|| format!("cannot start {}", program.display()))?;
    Ok(status.success())
}
