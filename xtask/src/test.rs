//! `cargo xtask test`: set-up, lints, dependencies, every test, the pure Rust build, a real Slurm,
//! Miri, and the Python package, with one summary.
//!
//! CI runs this.

use anyhow::Result;

use crate::lint::stages_of_lint;
use crate::stage::{SHARED, Stages};
use crate::{binaries, deny, library, miri, python, setup, slurm};

/// Tests of the pure build: every stage of the pipeline by the command line, and what such a build
/// refuses. The other tests have run with all features.
const PURE: [&str; 6] = [
    "--test=cli_run",
    "--test=cli_refusals",
    "--",
    "the_stages_lead_from_one_to_the_next",
    "left_out",
    "needs_torch",
];

/// Runs all stages; without the native libraries the other stages cannot be built.
pub fn run() -> Result<bool> {
    let mut stages = Stages::default();
    stages.run("setup", || setup::run(&library::ALL).map(|()| true))?;
    stages_of_lint(&mut stages)?;
    deny::stage(&mut stages)?;
    stages.run("tests", binaries::run)?;
    // The program that the tests have built. A separate build would have other features of its
    // dependencies.
    let program = library::target()?.join("debug/asid");
    slurm::stage(&mut stages, Some(&program))?;
    // This stage replaces the program that the tests have built, so it comes after the stages that
    // call it.
    let pure = ["test", "--package=asid", SHARED, "--no-fail-fast"];
    stages.cargo("tests, default features", &[&pure[..], &PURE].concat(), &[])?;
    miri::stage(&mut stages)?;
    python::stage(&mut stages, python::Profile::Dev)?;
    Ok(stages.finish())
}
