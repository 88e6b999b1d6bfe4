//! The folder of a result: written whole or not at all.
//!
//! Nothing is written before the work is done. Then the files go into a folder
//! beside the wanted one, which takes its name when all are there.

use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::Error;

/// Where results go when `--out` is not given.
const RUNS: &str = "runs";

/// A place for a result that was free and writable when it was claimed.
pub struct OutFolder {
    path: PathBuf,
}

fn file(path: &Path, message: impl Into<String>) -> anyhow::Error {
    Error::File {
        path: path.to_owned(),
        message: message.into(),
    }
    .into()
}

impl OutFolder {
    /// Checks that a result can be written to `out`, or to the next free folder
    /// `runs/<stem>-<n>` where none is given.
    pub fn claim(out: Option<&Path>, stem: &str) -> Result<Self> {
        let path = match out {
            Some(path) => path.to_owned(),
            None => (1..)
                .map(|n| Path::new(RUNS).join(format!("{stem}-{n}")))
                .find(|p| !p.exists())
                .unwrap_or_default(),
        };
        if path.is_file() {
            return Err(file(&path, "is a file; --out needs a folder"));
        }
        if path.is_dir() {
            let mut entries = std::fs::read_dir(&path).map_err(|e| file(&path, e.to_string()))?;
            if entries.next().is_some() {
                let what = if path.join("result.json").exists() { "already holds another run" } else { "is not empty" };
                return Err(file(&path, format!("{what}; choose another --out")));
            }
        }
        let folder = Self { path };
        // The nearest folder that exists must take new entries.
        let base = folder
            .path
            .ancestors()
            .skip(1)
            .map(|p| if p.as_os_str().is_empty() { Path::new(".") } else { p })
            .find(|p| p.exists())
            .unwrap_or(Path::new("."));
        let probe = base.join(format!(".asid-{}", std::process::id()));
        std::fs::create_dir(&probe).map_err(|e| file(&folder.path, format!("cannot be written: {e}")))?;
        std::fs::remove_dir(&probe).map_err(|e| file(&probe, e.to_string()))?;
        Ok(folder)
    }

    /// Writes the result: `fill` gets a fresh folder; it takes its name when all went well.
    pub fn write(&self, fill: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
        let parent = self.path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        std::fs::create_dir_all(parent).map_err(|e| file(parent, e.to_string()))?;
        let name = self.path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let staging = parent.join(format!(".{name}.{}", std::process::id()));
        std::fs::create_dir(&staging).map_err(|e| file(&staging, e.to_string()))?;
        let filled = fill(&staging).and_then(|()| {
            // A rename onto an empty folder replaces it, onto anything else it fails.
            std::fs::rename(&staging, &self.path).map_err(|e| file(&self.path, e.to_string()))
        });
        if filled.is_err() {
            let _ = std::fs::remove_dir_all(&staging);
        }
        filled
    }

    /// Where it will be.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// Writes a text file.
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    std::fs::write(path, text).map_err(|e| file(path, e.to_string()))
}

/// Writes a value as indented JSON.
pub fn write_json(path: &Path, value: &impl serde::Serialize) -> Result<()> {
    write_text(path, &(serde_json::to_string_pretty(value)? + "\n"))
}
