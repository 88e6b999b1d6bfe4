//! `cargo xtask test`: set-up, lints, every test, and Miri, with one summary. CI runs this.

use anyhow::Result;

use crate::lint::stages_of_lint;
use crate::stage::{ALL_FEATURES, Stages};
use crate::{library, miri, setup};

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
    miri::stage(&mut stages)?;
    Ok(stages.finish())
}
