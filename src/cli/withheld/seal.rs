//! The seal of a set of cases: it shows whether a study or a label was changed since they were
//! made.

use std::path::Path;

use anyhow::Result;
#[cfg(feature = "mujoco")]
use asid_core::Error;

/// Checks studies and labels against their seal, where the studies have one.
#[cfg(feature = "mujoco")]
pub fn sealed(studies: &Path, labels: &Path) -> Result<()> {
    use asid_withheld::seal::{SEAL, verify};
    if !studies.join(SEAL).is_file() {
        return Ok(());
    }
    let wrong = verify(studies, labels).map_err(|e| Error::Failed(e.to_string()))?;
    match wrong.first() {
        None => Ok(()),
        Some(first) => Err(Error::Failed(format!(
            "{}: {first}: a broken seal scores nothing ({} in all)",
            studies.join(SEAL).display(),
            wrong.len()
        ))
        .into()),
    }
}

/// Only builds with MuJoCo have the generator, which knows the seal.
#[cfg(not(feature = "mujoco"))]
pub fn sealed(studies: &Path, _labels: &Path) -> Result<()> {
    if studies.join("seal.json").is_file() {
        crate::cli::failure::note(
            "the seal is not checked: that takes a build with --features mujoco",
        );
    }
    Ok(())
}
