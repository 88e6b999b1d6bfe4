//! The folder of a comparison: a file a cell, written whole or not at all.
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
//! A file is written beside its place under a name of its own and renamed, so that a reader finds
//! it whole or not at all whenever the writer is stopped, and several machines may write into one
//! folder: equal cells have equal bytes, and it does not matter whose is kept.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use asid_core::{Error, Result};
use serde::{Deserialize, Serialize};

use crate::cell::{Cell, CellKey, Failure};

/// Held while a file is written, so that whoever ends the process can wait for it.
static WRITING: Mutex<()> = Mutex::new(());

/// Waits until no file is being written, and holds all writers up from then on.
pub fn no_writer() -> MutexGuard<'static, ()> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Writes a file whole or not at all.
///
/// # Errors
/// [`Error::Failed`] naming the file.
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
        // The name may not be there before what it stands for.
        file.sync_all()?;
        fs::rename(&beside, path)
    });
    written.map_err(|e| {
        let _ = fs::remove_file(&beside);
        failed(e)
    })
}

/// Part of a name that no other process or thread of any machine uses at this time.
#[must_use]
pub fn unique() -> String {
    use std::hash::{BuildHasher as _, RandomState};
    let random = RandomState::new().hash_one(std::thread::current().id());
    format!("{}-{random:016x}", std::process::id())
}

/// Seconds that a cell took, kept apart from the cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellTime {
    /// Which one it is.
    #[serde(flatten)]
    pub key: CellKey,
    /// Wall-clock time on one thread, s.
    pub wall_s: f64,
}

/// The folder.
#[derive(Clone, Debug)]
pub struct Store {
    root: PathBuf,
}

impl Store {
    /// The store in this folder, which need not be there yet.
    #[must_use]
    pub fn new(root: &Path) -> Self {
        Self {
            root: root.to_owned(),
        }
    }

    /// Its folder.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Whether there is a comparison in the folder.
    #[must_use]
    pub fn is_begun(&self) -> bool {
        self.config().is_file()
    }

    /// The plan's file.
    #[must_use]
    pub fn config(&self) -> PathBuf {
        self.root.join("config.toml")
    }

    /// Where trained policies are.
    #[must_use]
    pub fn policies(&self) -> PathBuf {
        self.root.join("policies")
    }

    /// Where a cell is or would be.
    #[must_use]
    pub fn place(&self, key: &CellKey) -> PathBuf {
        self.file("cells", &key.stem())
    }

    fn file(&self, folder: &str, stem: &str) -> PathBuf {
        self.root.join(folder).join(format!("{stem}.json"))
    }

    /// A cell; none where it is not there yet.
    ///
    /// # Errors
    /// When its file cannot be read or is another cell's.
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

    /// Keeps a cell with the seconds that it took, and forgets that it failed.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn keep(&self, cell: &Cell, wall_s: Option<f64>) -> Result<()> {
        let stem = cell.key.stem();
        // The cell last: where it is, all of it is.
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

    /// Why a cell is not there; none where nothing is known.
    ///
    /// # Errors
    /// When its file cannot be read.
    pub fn failure(&self, key: &CellKey) -> Result<Option<Failure>> {
        read(&self.file("failures", &key.stem()))
    }

    /// Notes why a cell is not there.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn fail(&self, failure: &Failure) -> Result<()> {
        write(&self.file("failures", &failure.key.stem()), &text(failure)?)
    }

    /// Seconds that a cell took, where they are known.
    ///
    /// # Errors
    /// When its file cannot be read.
    pub fn time(&self, key: &CellKey) -> Result<Option<CellTime>> {
        read(&self.file("times", &key.stem()))
    }

    /// All cells of the folder, by the names of their files.
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

    /// The settings that a hash stands for; none where they were not kept.
    #[must_use]
    pub fn settings(&self, hash: &str) -> Option<toml::Table> {
        let path = self.root.join("settings").join(format!("{hash}.toml"));
        fs::read_to_string(path).ok()?.parse().ok()
    }

    /// Keeps the settings that a hash stands for.
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

/// Kinds of files of which there is one a cell.
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
        // No half of a file is left beside.
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
