//! `cargo xtask miri`: the engine ABI's unsafe code under Miri, where a toolchain has it.
//!
//! What runs is the crate's unit tests and its tests in one process: a Rust engine
//! out through its table and in again. Loading a library is beyond Miri.

use std::process::{Command, Stdio};

use anyhow::{Context, Result};

use crate::library::repository;
use crate::stage::Stages;

/// Toolchains that may have Miri: the one in use, then the nightly one.
const TOOLCHAINS: [&[&str]; 2] = [&[], &["+nightly"]];

/// Files are read, and arithmetic is compared to the bit.
const FLAGS: &str = "-Zmiri-disable-isolation -Zmiri-deterministic-floats";

/// Runs Miri; a machine without it is told so, and that is no failure.
pub fn run() -> Result<bool> {
    let mut stages = Stages::default();
    stage(&mut stages)?;
    Ok(stages.finish())
}

/// Adds the run to others.
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

/// Whether a toolchain has Miri, and can build the library it runs on.
fn is_ready(toolchain: &[&str]) -> bool {
    let status = cargo(toolchain)
        .args(["miri", "setup"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|s| s.success())
}

/// The `cargo` that picks toolchains, not the one that runs this program; in a
/// target folder of its own, for the two would rebuild each other's work.
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
