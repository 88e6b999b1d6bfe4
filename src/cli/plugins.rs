//! Plugins of a call: those that are named, and those that are found.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::Result;
use asid_core::registry::{Entry, Origin, find};
use asid_plugin::search;

/// A plugin that was found in a folder and cannot be used.
#[derive(Clone, Debug)]
pub struct Refused {
    /// Its file, or the place that cannot be searched.
    pub path: PathBuf,
    /// Why, in one line that names it.
    pub why: String,
}

/// Files that were named in this call, without links in their paths, in order.
static GIVEN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Loads the plugins that are named, then those of the folders that are searched.
///
/// # Errors
/// When one that is named cannot be used. Those found in folders are handed back.
pub fn load(named: &[PathBuf]) -> Result<Vec<Refused>> {
    for path in named {
        let loaded = asid_plugin::load(path)?;
        let mut given = GIVEN.lock().unwrap_or_else(PoisonError::into_inner);
        if !given.iter().any(|p| p == loaded.file) {
            given.push(loaded.file.to_owned());
        }
    }
    let mut refused = Vec::new();
    for place in search::places() {
        let files = search::files(&place).unwrap_or_else(|error| {
            refused.push(Refused {
                path: place.path.clone(),
                why: error.to_string(),
            });
            Vec::new()
        });
        for path in files {
            if let Err(error) = asid_plugin::load(&path) {
                let why = error.to_string();
                refused.push(Refused { path, why });
            }
        }
    }
    Ok(refused)
}

/// Plugins that a configuration names.
///
/// # Errors
/// When the file cannot be read or its `plugins` are no list of files.
pub fn of_config(path: Option<&Path>) -> Result<Vec<PathBuf>> {
    path.map_or_else(|| Ok(Vec::new()), super::settings::plugins)
}

/// Files that were named in this call, and those that registered what it uses.
pub fn used(parts: &[Option<&'static Path>]) -> Vec<PathBuf> {
    let mut files = GIVEN.lock().unwrap_or_else(PoisonError::into_inner).clone();
    for file in parts.iter().flatten() {
        if !files.iter().any(|f| f == file) {
            files.push(file.to_path_buf());
        }
    }
    files
}

/// File of the plugin that registered a name, where one did.
pub fn file_of<E: Entry>(name: &str) -> Option<&'static Path> {
    match find::<E>(name).ok()?.origin() {
        Origin::Loaded(file) => Some(file),
        Origin::Linked(_) => None,
    }
}
