//! `cargo xtask miri`: runs the engine ABI's unsafe code under Miri, if a toolchain has it.
//!
//! It runs the crate's unit tests and its tests in one process, in which a Rust engine goes out
//! through its table and comes in again. Miri cannot load a library.

use std::process::{Command, Stdio};

use anyhow::{Context, Result};

use crate::library::repository;
use crate::stage::Stages;

/// Toolchains that may have Miri: the one in use, then the nightly one.
const TOOLCHAINS: [&[&str]; 2] = [&[], &["+nightly"]];

/// Miri reads files, and arithmetic is compared to the bit.
const FLAGS: &str = "-Zmiri-disable-isolation -Zmiri-deterministic-floats";

/// Runs Miri. A machine without it gets a message; this is no failure.
pub fn run() -> Result<bool> {
    let mut stages = Stages::default();
    stage(&mut stages)?;
    Ok(stages.finish())
}

/// Adds the run to other stages.
pub fn stage(stages: &mut Stages) -> Result<()> {
    let Some(toolchain) = TOOLCHAINS.into_iter().find(|t| is_ready(t)) else {
        stages.leave_out(
            "miri",
            "no toolchain here has Miri; `rustup +nightly component add miri rust-src` brings it",
        );
        return Ok(());
    };
    stages.run("miri", || {
        let tests = ["--package=asid-abi", "--lib", "--test=in_process"];
        let status = cargo(toolchain)
            .args(["miri", "test"])
            .args(tests)
            .env("MIRIFLAGS", FLAGS)
            .status()
            .context("cannot start Miri")?;
        Ok(status.success())
    })?;
    Ok(())
}

/// Whether a toolchain has Miri and can build its standard library.
fn is_ready(toolchain: &[&str]) -> bool {
    let status = cargo(toolchain)
        .args(["miri", "setup"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|s| s.success())
}

/// The `cargo` that selects toolchains, not the one that runs this program.
///
/// It has a target folder of its own, because the two would rebuild each other's work.
fn cargo(toolchain: &[&str]) -> Command {
    let mut command = Command::new("cargo");
    for name in ["CARGO", "RUSTUP_TOOLCHAIN", "RUSTC", "RUSTDOC"] {
        command.env_remove(name);
    }
    command
        .args(toolchain)
        .env("CARGO_TARGET_DIR", repository().join("target/miri"))
        .current_dir(repository());
    command
}
