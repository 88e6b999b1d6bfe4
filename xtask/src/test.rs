//! `cargo xtask test`: set-up, lints, every test, a real Slurm, Miri, and the Python package, with one summary. CI runs this.

use anyhow::Result;

use crate::lint::stages_of_lint;
use crate::stage::{ALL_FEATURES, Stages};
use crate::{library, miri, python, setup, slurm};

/// Runs everything; without the native libraries nothing else can be built.
pub fn run() -> Result<bool> {
    let mut stages = Stages::default();
    stages.run("setup", || setup::run(&library::ALL).map(|()| true))?;
    stages_of_lint(&mut stages)?;
    stages.cargo(
        "tests",
        &["test", "--workspace", "--no-fail-fast", ALL_FEATURES],
        &[],
    )?;
    // The program that the tests have built: alone it would be built anew, with other features of its dependencies.
    let program = library::target()?.join("debug/asid");
    slurm::stage(&mut stages, Some(&program))?;
    miri::stage(&mut stages)?;
    python::stage(&mut stages, python::Profile::Dev)?;
    Ok(stages.finish())
}
