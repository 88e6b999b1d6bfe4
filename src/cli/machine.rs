//! Commands on any machine: a study or a model file in place of a task.

pub mod explore;
pub mod export;
pub mod identify;
pub mod motion_config;
mod motion_page;
pub mod sensors;
pub mod setup;
mod subject;

use std::path::Path;

use anyhow::Result;
use asid_core::registry::{TaskEntry, find};

pub use subject::{Subject, is_study, no_study};

/// The path that an argument names; `None` for a registered task.
///
/// # Errors
/// When it is neither; the message is that of an unknown task, with similar names.
pub fn path_of(argument: &str) -> Result<Option<&Path>> {
    let unknown = match find::<TaskEntry>(argument) {
        Ok(_) => return Ok(None),
        Err(unknown) => unknown,
    };
    let path = Path::new(argument);
    // Treat what looks like a path as one, so that a missing file is reported as such.
    let looks = argument.contains(['/', '\\']) || path.extension().is_some();
    if looks || path.exists() {
        return Ok(Some(path));
    }
    Err(unknown.into())
}
