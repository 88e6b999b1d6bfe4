//! `cargo xtask lint`: formatting, clippy and rustdoc, warnings as errors.

use anyhow::Result;

use crate::stage::{ALL_FEATURES, SHARED, Stages};

/// Runs all lints and prints the summary.
pub fn run() -> Result<bool> {
    let mut stages = Stages::default();
    stages_of_lint(&mut stages)?;
    Ok(stages.finish())
}

/// Adds the lint stages to a run; a failed stage does not stop the next one.
pub fn stages_of_lint(stages: &mut Stages) -> Result<()> {
    stages.cargo("format", &["fmt", "--all", "--check"], &[])?;
    let clippy = ["clippy", "--workspace", "--all-targets", ALL_FEATURES];
    let deny = ["--", "-D", "warnings"];
    stages.cargo("clippy", &[&clippy[..], &deny].concat(), &[])?;
    // The default features are pure Rust and must build by themselves.
    let pure = ["clippy", "--package=asid", SHARED, "--all-targets"];
    stages.cargo(
        "clippy, default features",
        &[&pure[..], &deny].concat(),
        &[],
    )?;
    let doc = ["doc", "--workspace", "--no-deps", ALL_FEATURES];
    stages.cargo("rustdoc", &doc, &[("RUSTDOCFLAGS", "-D warnings")])?;
    Ok(())
}
