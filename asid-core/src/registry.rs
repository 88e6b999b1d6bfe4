//! Finds backends, tasks, explorers, identifiers and solvers by name.
//!
//! What is linked in registers itself through [`inventory`]: one
//! `inventory::submit!` in the author's crate, no list to edit. Lists come out
//! sorted by name, so that nothing depends on the order of linking.

use crate::backend::Backend;
use crate::error::{Error, Result};

/// A backend that is linked in.
pub struct BackendEntry {
    /// Name on the command line.
    pub name: &'static str,
    /// One line for `asid list`.
    pub about: &'static str,
    /// Makes it; an error says why it is missing on this machine.
    pub make: fn() -> Result<Box<dyn Backend>>,
}

inventory::collect!(BackendEntry);

/// Everything registered under a type of entry, sorted by name.
pub fn backends() -> Vec<&'static BackendEntry> {
    let mut all: Vec<_> = inventory::iter::<BackendEntry>().collect();
    all.sort_by_key(|e| e.name);
    all
}

/// Makes the backend of this name.
///
/// # Errors
/// When no backend has the name, or it is missing on this machine.
pub fn backend(name: &str) -> Result<Box<dyn Backend>> {
    let all = backends();
    let entry = all
        .iter()
        .find(|e| e.name == name)
        .ok_or_else(|| Error::unknown("backend", name, all.iter().map(|e| e.name)))?;
    (entry.make)()
}
