//! Shared libraries, opened once and never closed.
//!
//! What a library hands out (tables, names, functions) is used until the process
//! ends, by any thread; closing one could only go wrong.

use std::path::Path;

use asid_core::{Error, Result};

use crate::crash::{self, Action};

/// An open library.
pub type Library = libloading::Library;

/// Opens a library. Opening runs the library's own initialisers.
///
/// # Errors
/// [`Error::Plugin`] where there is no such file, or it is no library that this
/// process can load; the message is the system's, in one line.
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
        // SAFETY: the library's initialisers run. That a file named as a plugin is
        // meant to be run is the user's decision, as with any program.
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

/// The system's own words, without the path that the message begins with anyway.
fn why(error: &libloading::Error, path: &Path) -> String {
    let source = std::error::Error::source(error).map_or(error.to_string(), ToString::to_string);
    let text = source.replace(&format!("{}: ", path.display()), "");
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
