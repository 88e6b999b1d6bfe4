//! Shared libraries, opened once and never closed.
//!
//! What a library provides (tables, names, functions) is used until the process ends, by any
//! thread, so closing it would be unsafe.

use std::path::Path;

use asid_core::{Error, Result};

use crate::crash::{self, Action};

/// An open library.
pub type Library = libloading::Library;

/// Opens a library, which runs the library's own initialisers.
///
/// # Errors
/// [`Error::Plugin`] when there is no such file, or this process cannot load it as a library; the
/// message is the system's, in one line.
pub fn open(path: &Path) -> Result<&'static Library> {
    let refuse = |message: String| Error::Plugin {
        path: path.to_path_buf(),
        message,
    };
    let found = std::fs::canonicalize(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => refuse("no such file".into()),
        _ => refuse(e.to_string()),
    })?;
    if found.is_dir() {
        return Err(refuse("is a folder, not a library".into()));
    }
    crash::watch();
    let opened = Action::new(path, "opening the file (is it cut short?)").run(|| {
        // SAFETY: the library's initialisers run. The user decides to run a file by naming it as a
        // plugin, as with any program.
        unsafe { Library::new(&found) }
    });
    let library = opened.map_err(|e| {
        refuse(format!(
            "is not a library that can be loaded: {}",
            why(&e, &found)
        ))
    })?;
    Ok(Box::leak(Box::new(library)))
}

/// The system's message, without the path with which it begins.
fn why(error: &libloading::Error, path: &Path) -> String {
    let source = std::error::Error::source(error).map_or(error.to_string(), ToString::to_string);
    let text = source.replace(&format!("{}: ", path.display()), "");
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
