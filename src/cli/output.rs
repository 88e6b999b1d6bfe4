//! The folder of a result: written whole or not at all.
//!
//! Nothing is written before the work is done. The files then go into a temporary folder, which is
//! renamed to its final name when it is complete. A folder that already exists may be the root of a
//! volume, onto which nothing can be renamed. It gets the files one by one, `result.json` last.
//!
//! The next call with the same `--out` removes what a killed call left behind.

use std::cell::RefCell;
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::Error;
use serde::Serialize;

use super::interrupt;
use staging::Staging;

pub mod staging;

/// Parent folder of results when `--out` is not given.
const RUNS: &str = "runs";

/// The file whose presence marks a folder as a result.
const RESULT: &str = "result.json";

/// A place for a result that was free and writable when it was claimed.
pub struct OutFolder {
    path: RefCell<PathBuf>,
    /// Stem of the folder's name, where the next free name is taken.
    stem: Option<String>,
}

fn file(path: &Path, message: impl Into<String>) -> anyhow::Error {
    Error::File {
        path: path.to_owned(),
        message: message.into(),
    }
    .into()
}

/// An error of writing after the work: the work failed, the call was not wrong.
fn failed(path: &Path, error: &std::io::Error) -> anyhow::Error {
    Error::Failed(format!("{}: cannot be written: {error}", path.display())).into()
}

fn next_free(stem: &str) -> PathBuf {
    (1..)
        .map(|n| Path::new(RUNS).join(format!("{stem}-{n}")))
        .find(|p| !p.exists())
        .unwrap_or_default()
}

impl OutFolder {
    /// Checks that a result can be written to `out`, or to the next free folder
    /// `runs/<stem>-<n>` where none is given.
    pub fn claim(out: Option<&Path>, stem: &str) -> Result<Self> {
        Self::claim_but_for(out, stem, None)
    }

    /// As [`OutFolder::claim`], for a result that also keeps a folder `kept` while the work goes
    /// on.
    ///
    /// If `kept` is there already, the work continues from it.
    pub fn claim_with(out: Option<&Path>, stem: &str, kept: &str) -> Result<Self> {
        let mut claimed = Self::claim_but_for(out, stem, Some(kept))?;
        // The name is fixed when the first file is written.
        claimed.stem = None;
        Ok(claimed)
    }

    fn claim_but_for(out: Option<&Path>, stem: &str, kept: Option<&str>) -> Result<Self> {
        let (path, stem) = match out {
            Some(path) => (path.to_owned(), None),
            None => (next_free(stem), Some(stem.to_owned())),
        };
        if path.as_os_str().is_empty() {
            return Err(file(Path::new("--out"), "names no folder"));
        }
        if path.is_dir() {
            staging::clear(&path);
            let entries = std::fs::read_dir(&path).map_err(|e| file(&path, e.to_string()))?;
            let mut names = entries.filter_map(|e| Some(e.ok()?.file_name()));
            if names.any(|n| kept.is_none_or(|kept| n != kept)) {
                let what = if path.join(RESULT).exists() {
                    "already holds another run"
                } else {
                    "is not empty"
                };
                return Err(file(&path, format!("{what}; choose another --out")));
            }
        } else if path.exists() || path.file_name().is_none() {
            return Err(file(&path, "is no folder; --out needs one, new or empty"));
        }
        // The nearest existing parent folder must allow new entries.
        let base = path
            .ancestors()
            .map(|p| {
                if p.as_os_str().is_empty() {
                    Path::new(".")
                } else {
                    p
                }
            })
            .find(|p| p.exists())
            .unwrap_or(Path::new("."));
        staging::clear(base);
        Staging::new_in(base).map_err(|e| file(&path, format!("cannot be written: {e}")))?;
        Ok(Self {
            path: RefCell::new(path),
            stem,
        })
    }

    /// Prints the result on standard output: as JSON alone, or as `lines` and its path.
    pub fn tell(&self, json: bool, result: &impl Serialize, lines: &[String]) -> Result<()> {
        let mut stdout = std::io::stdout().lock();
        if json {
            writeln!(stdout, "{}", serde_json::to_string_pretty(result)?)?;
            return Ok(());
        }
        for line in lines {
            writeln!(stdout, "{line}")?;
        }
        Ok(writeln!(stdout, "results: {}", self.path().display())?)
    }

    /// Writes the result: `fill` fills a fresh folder, which gets its final name on success.
    pub fn write(&self, fill: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
        let path = self.path();
        let exists = path.is_dir() && self.stem.is_none();
        let beside = if exists { Some(&*path) } else { path.parent() };
        let beside = beside
            .filter(|p| !p.as_os_str().is_empty())
            .unwrap_or(Path::new("."));
        let mut written = interrupt::writing();
        std::fs::create_dir_all(beside).map_err(|e| failed(beside, &e))?;
        let staging = Staging::new_in(beside).map_err(|e| failed(beside, &e))?;
        let content = staging.content();
        let done = fill(&content).and_then(|()| {
            if exists {
                move_into(&staging, &path)
            } else {
                self.name(&content)
            }
        });
        *written = done.is_ok();
        // Any error here comes after the work, so the call was not wrong.
        done.map_err(|e| Error::Failed(format!("{e:#}")).into())
    }

    /// Renames the filled folder to the wanted name, or to the next free one.
    fn name(&self, staging: &Path) -> Result<()> {
        loop {
            // A rename replaces an empty folder and fails on anything else.
            let renamed = std::fs::rename(staging, self.path());
            match (renamed, &self.stem) {
                (Ok(()), _) => return Ok(()),
                (Err(_), Some(stem)) if self.path().exists() => {
                    self.path.replace(next_free(stem));
                }
                (Err(e), _) => return Err(failed(&self.path(), &e)),
            }
        }
    }

    /// Final path of the result, whether written yet or not.
    pub fn path(&self) -> PathBuf {
        self.path.borrow().clone()
    }
}

/// Moves the files into a folder that existed before, `result.json` last.
fn move_into(staging: &Staging, to: &Path) -> Result<()> {
    let entries = std::fs::read_dir(staging.content()).map_err(|e| failed(to, &e))?;
    let names = entries.filter_map(|e| e.ok()?.file_name().into_string().ok());
    let mut names: Vec<String> = names.collect();
    names.sort_by_key(|n| n == RESULT);
    if let Some(taken) = names.iter().map(|n| to.join(n)).find(|p| p.exists()) {
        return Err(Error::Failed(format!(
            "{} exists by now; choose another --out",
            taken.display()
        ))
        .into());
    }
    staging.move_into(to, &names).map_err(|e| failed(to, &e))
}

/// Writes a text file.
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    std::fs::write(path, text).map_err(|e| failed(path, &e))
}

/// Writes a value as indented JSON.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    write_text(path, &(serde_json::to_string_pretty(value)? + "\n"))
}

/// The folder of a file.
fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

/// Writes a file whole or not at all, and replaces an existing one: `fill` writes it under another
/// name.
pub fn replace_file(path: &Path, fill: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let folder = folder_of(path);
    staging::clear(folder);
    let staging = Staging::new_in(folder).map_err(|e| failed(path, &e))?;
    let written = staging.content().join("file");
    fill(&written)?;
    std::fs::rename(&written, path).map_err(|e| failed(path, &e))
}

/// Writes a file that must not be there yet, whole or not at all.
pub fn create_text(path: &Path, text: &str) -> std::io::Result<()> {
    let folder = folder_of(path);
    staging::clear(folder);
    let staging = Staging::new_in(folder)?;
    let written = staging.content().join("text");
    std::fs::write(&written, text)?;
    // A link fails if the name is taken; a rename would overwrite the file.
    match std::fs::hard_link(&written, path) {
        Err(e) if e.kind() != ErrorKind::AlreadyExists && !path.exists() => {
            std::fs::rename(&written, path)
        }
        linked => linked,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: two simultaneous calls of `asid report` for one folder. One failed, or the page was
    /// a mixture of both. Cause: both wrote under the same temporary name before the rename.
    #[test]
    fn several_write_one_file_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let page = folder.path().join("report.html");
        let write = |text: &str| {
            for _ in 0..20 {
                replace_file(&page, |file| write_text(file, text)).unwrap();
            }
        };
        let texts = ["a".repeat(100_000), "b".repeat(200_000)];
        std::thread::scope(|scope| {
            for text in &texts {
                scope.spawn(move || write(text));
            }
        });
        assert!(texts.contains(&std::fs::read_to_string(&page).unwrap()));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
