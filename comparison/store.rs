//! The folder of a comparison: one file per cell, written atomically.
//!
//! ```text
//! config.toml            the plan and the settings that were given
//! cells/STEM.json        one cell
//! failures/STEM.json     why a cell is not there
//! settings/HASH.toml     the settings that a hash stands for
//! times/STEM.json        seconds that a cell took
//! policies/NAME/         what was trained
//! ```
//!
//! A file is written under a unique temporary name and then renamed. Whenever the writer is
//! stopped, a reader finds the file complete or not at all. Several machines may write into one
//! folder: equal cells have equal bytes, so it does not matter whose file is kept.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use asid_core::{Error, Result};
use serde::{Deserialize, Serialize};

use crate::cell::{Cell, CellKey, Failure};

/// Held while a file is written, so that code that ends the process can wait for it.
static WRITING: Mutex<()> = Mutex::new(());

/// Waits until no file is being written, and blocks all writers while the guard lives.
pub fn no_writer() -> MutexGuard<'static, ()> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Writes a file atomically.
///
/// # Errors
/// [`Error::Failed`], which names the file.
pub fn write(path: &Path, text: &str) -> Result<()> {
    let _held = no_writer();
    let failed =
        |e: std::io::Error| Error::Failed(format!("{}: cannot be written: {e}", path.display()));
    let folder = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder).map_err(failed)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let beside = folder.join(format!(".{name}.{}", unique()));
    let written = fs::File::create(&beside).and_then(|mut file| {
        file.write_all(text.as_bytes())?;
        // The data must be on disk before the name is.
        file.sync_all()?;
        fs::rename(&beside, path)
    });
    written.map_err(|e| {
        let _ = fs::remove_file(&beside);
        failed(e)
    })
}

/// Part of a name that no other process or thread on any machine uses at this time.
#[must_use]
pub fn unique() -> String {
    use std::hash::{BuildHasher as _, RandomState};
    let random = RandomState::new().hash_one(std::thread::current().id());
    format!("{}-{random:016x}", std::process::id())
}

/// Run time of a cell, stored separately from the cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellTime {
    /// Key of the cell.
    #[serde(flatten)]
    pub key: CellKey,
    /// Wall-clock time on one thread, s.
    pub wall_s: f64,
}

/// The folder of a comparison.
#[derive(Clone, Debug)]
pub struct Store {
    root: PathBuf,
}

impl Store {
    /// The store in this folder, which may not exist yet.
    #[must_use]
    pub fn new(root: &Path) -> Self {
        Self {
            root: root.to_owned(),
        }
    }

    /// The folder's path.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Whether the folder holds a comparison.
    #[must_use]
    pub fn is_begun(&self) -> bool {
        self.config().is_file()
    }

    /// Path of the plan's file.
    #[must_use]
    pub fn config(&self) -> PathBuf {
        self.root.join("config.toml")
    }

    /// Path of the trained policies.
    #[must_use]
    pub fn policies(&self) -> PathBuf {
        self.root.join("policies")
    }

    /// Path of a cell's file, whether it exists or not.
    #[must_use]
    pub fn place(&self, key: &CellKey) -> PathBuf {
        self.file("cells", &key.stem())
    }

    fn file(&self, folder: &str, stem: &str) -> PathBuf {
        self.root.join(folder).join(format!("{stem}.json"))
    }

    /// Reads a cell; `None` where it does not exist yet.
    ///
    /// # Errors
    /// When its file cannot be read or holds another cell.
    pub fn cell(&self, key: &CellKey) -> Result<Option<Cell>> {
        let path = self.place(key);
        let cell: Option<Cell> = read(&path)?;
        match &cell {
            Some(found) if found.key != *key => Err(Error::File {
                path,
                message: format!("holds another cell: {}", found.key.words()),
            }),
            _ => Ok(cell),
        }
    }

    /// Stores a cell with its run time, and removes its failure.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn keep(&self, cell: &Cell, wall_s: Option<f64>) -> Result<()> {
        let stem = cell.key.stem();
        // The cell is written last: where it exists, everything that belongs to it exists.
        if let Some(wall_s) = wall_s {
            let time = CellTime {
                key: cell.key.clone(),
                wall_s,
            };
            write(&self.file("times", &stem), &text(&time)?)?;
        }
        write(&self.place(&cell.key), &text(cell)?)?;
        let _ = fs::remove_file(self.file("failures", &stem));
        Ok(())
    }

    /// The failure of a cell; `None` where there is none.
    ///
    /// # Errors
    /// When its file cannot be read.
    pub fn failure(&self, key: &CellKey) -> Result<Option<Failure>> {
        read(&self.file("failures", &key.stem()))
    }

    /// Stores the failure of a cell.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn fail(&self, failure: &Failure) -> Result<()> {
        write(&self.file("failures", &failure.key.stem()), &text(failure)?)
    }

    /// Run time of a cell, where it is known.
    ///
    /// # Errors
    /// When its file cannot be read.
    pub fn time(&self, key: &CellKey) -> Result<Option<CellTime>> {
        read(&self.file("times", &key.stem()))
    }

    /// Reads all files of a kind, sorted by their names.
    ///
    /// # Errors
    /// When one cannot be read.
    pub fn all<T: serde::de::DeserializeOwned>(&self, folder: Kind) -> Result<Vec<T>> {
        let folder = self.root.join(folder.folder());
        let Ok(entries) = fs::read_dir(&folder) else {
            return Ok(Vec::new());
        };
        let mut paths: Vec<PathBuf> = entries
            .filter_map(|e| Some(e.ok()?.path()))
            .filter(|p| {
                let hidden = p
                    .file_name()
                    .is_some_and(|n| n.to_string_lossy().starts_with('.'));
                !hidden && p.extension().is_some_and(|e| e == "json")
            })
            .collect();
        paths.sort();
        let read_all = paths.iter().map(|p| read(p));
        Ok(read_all
            .collect::<Result<Vec<_>>>()?
            .into_iter()
            .flatten()
            .collect())
    }

    /// The settings with this hash; `None` where they are not stored.
    #[must_use]
    pub fn settings(&self, hash: &str) -> Option<toml::Table> {
        let path = self.root.join("settings").join(format!("{hash}.toml"));
        fs::read_to_string(path).ok()?.parse().ok()
    }

    /// Stores settings under their hash.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn keep_settings(&self, hash: &str, canonical: &str) -> Result<()> {
        let path = self.root.join("settings").join(format!("{hash}.toml"));
        if path.is_file() {
            return Ok(());
        }
        write(&path, canonical)
    }
}

/// Kinds of files with one file per cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// [`Cell`]s.
    Cells,
    /// [`Failure`]s.
    Failures,
    /// [`CellTime`]s.
    Times,
}

impl Kind {
    fn folder(self) -> &'static str {
        match self {
            Self::Cells => "cells",
            Self::Failures => "failures",
            Self::Times => "times",
        }
    }
}

fn text(value: &impl Serialize) -> Result<String> {
    serde_json::to_string_pretty(value)
        .map(|t| t + "\n")
        .map_err(|e| Error::Failed(e.to_string()))
}

fn read<T: serde::de::DeserializeOwned>(path: &Path) -> Result<Option<T>> {
    let wrong = |message: String| Error::File {
        path: path.to_owned(),
        message,
    };
    match fs::read_to_string(path) {
        Ok(text) => serde_json::from_str(&text)
            .map(Some)
            .map_err(|e| wrong(format!("{e}; delete the file, and it is made again"))),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(wrong(e.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::tests::{cell, key};

    #[test]
    fn a_cell_comes_back_as_it_was_and_takes_its_failure_away() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path());
        let wanted = key("t", "c", "asid", 3);
        assert!(store.cell(&wanted).unwrap().is_none());
        let failure = Failure {
            key: wanted.clone(),
            reason: "why".into(),
            of_all: false,
        };
        store.fail(&failure).unwrap();
        assert_eq!(store.failure(&wanted).unwrap(), Some(failure));
        let made = cell(wanted.clone(), 0.1 + 0.2, true);
        store.keep(&made, Some(1.5)).unwrap();
        let text = fs::read_to_string(store.place(&wanted)).unwrap();
        let again = store.cell(&wanted).unwrap().unwrap();
        store.keep(&again, Some(2.5)).unwrap();
        assert_eq!(fs::read_to_string(store.place(&wanted)).unwrap(), text);
        assert!(store.failure(&wanted).unwrap().is_none());
        assert_eq!(store.time(&wanted).unwrap().unwrap().wall_s, 2.5);
        assert_eq!(store.all::<Cell>(Kind::Cells).unwrap().len(), 1);
        // No temporary file is left.
        assert_eq!(
            fs::read_dir(folder.path().join("cells")).unwrap().count(),
            1
        );
    }

    #[test]
    fn a_damaged_or_misplaced_cell_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path());
        let [a, b] = [key("t", "c", "asid", 0), key("t", "c", "asid", 1)];
        store.keep(&cell(a.clone(), 1.0, true), None).unwrap();
        fs::copy(store.place(&a), store.place(&b)).unwrap();
        assert!(store.cell(&b).unwrap_err().to_string().contains("seed 0"));
        fs::write(store.place(&b), "{\"schema\":").unwrap();
        assert!(
            store
                .cell(&b)
                .unwrap_err()
                .to_string()
                .contains("delete the file")
        );
    }
}
