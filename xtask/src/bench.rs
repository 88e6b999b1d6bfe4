//! `cargo xtask bench`: builds the program and its benchmark with every engine, and measures.
//!
//! The measuring itself is in the crate `asid-bench`, since this one links no engine.

use std::process::Command;

use anyhow::{Context, Result};

use crate::library::MUJOCO;
use crate::setup;
use crate::stage::Stages;

/// Sets MuJoCo up, builds in release and passes `arguments` on.
pub fn run(arguments: &[String]) -> Result<bool> {
    setup::run(&[&MUJOCO])?;
    let build = [
        "build",
        "--release",
        "--package=asid",
        "--package=asid-bench",
        "--package=asid-mujoco-plugin",
        "--package=asid-rapier-plugin",
        "--features=asid/mujoco,asid-bench/mujoco",
    ];
    if !Stages::default().cargo("build", &build, &[])? {
        return Ok(false);
    }
    let own = std::env::current_exe().context("cannot tell where this program lies")?;
    let target = own.ancestors().nth(2).context("no target folder")?;
    let name = format!("asid-bench{}", std::env::consts::EXE_SUFFIX);
    let program = target.join("release").join(name);
    let status = Command::new(&program)
        .args(arguments)
        .status()
        .with_context(|| format!("cannot start {}", program.display()))?;
    Ok(status.success())
}
