//! The logs of an import, as recorded.

use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::Error;
use asid_logs::{LogFormat, LogSettings, Opener, RawLog};

/// Path and log, and whether it is held out.
pub(super) type Opened = (PathBuf, RawLog, bool);

/// Opens the logs of `fitted` and `held_out` under some settings, and returns these with their kind.
///
/// Each log comes with its path and whether it is held out. Without `held_out` the last third is
/// held out.
///
/// # Errors
/// When a log cannot be read, is named twice, or is of another kind than the others.
pub(super) fn open(
    fitted: &[PathBuf],
    held_out: &[PathBuf],
    mut settings: LogSettings,
) -> Result<(Vec<Opened>, LogSettings)> {
    let mut opener = Opener::default();
    let mut all: Vec<Opened> = Vec::new();
    let (fitted, held_out) = (tables_of(fitted), tables_of(held_out));
    let each = fitted.iter().map(|p| (p, false));
    for (path, test) in each.chain(held_out.iter().map(|p| (p, true))) {
        if path.to_str().is_none() {
            let message = "its name is not UTF-8, and study.toml could not hold it: rename it";
            return Err(failed(path, message));
        }
        let (file, episode) = asid_logs::open::split(path);
        let kind = LogFormat::of(&file);
        if *settings.kind.get_or_insert(kind) != kind {
            return Err(failed(
                path,
                "is of another kind than the log before: one import takes one kind",
            ));
        }
        for log in opener.open(path, &settings)? {
            // Episodes of a dataset are named by their number.
            let own = match (kind, episode) {
                (LogFormat::Lerobot, None) => match log.name.rsplit_once('#') {
                    Some((_, number)) => PathBuf::from(format!("{}#{number}", file.display())),
                    None => path.clone(),
                },
                _ => path.clone(),
            };
            refuse_twice(&all, &own, test)?;
            all.push((own, log, test));
        }
    }
    if held_out.is_empty() && all.len() > 1 {
        let held = (all.len() / 3).max(1);
        let first = all.len() - held;
        all[first..].iter_mut().for_each(|(.., test)| *test = true);
    }
    Ok((all, settings))
}

/// The logs at some paths, in order. A folder of tables, which is no log of its own, stands for
/// them, by name.
fn tables_of(paths: &[PathBuf]) -> Vec<PathBuf> {
    let of = |path: &PathBuf| {
        let tables = tables_in(path).filter(|tables| !tables.is_empty());
        tables.unwrap_or_else(|| vec![path.clone()])
    };
    paths.iter().flat_map(of).collect()
}

/// The tables in a folder, sorted by name; `None` if it is a log itself, or no folder.
fn tables_in(path: &Path) -> Option<Vec<PathBuf>> {
    if !path.is_dir() || LogFormat::is_named(path) {
        return None;
    }
    let entries = std::fs::read_dir(path).ok()?;
    let files = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let files: Vec<PathBuf> = files.filter(|file| file.is_file()).collect();
    let is_log = |file: &&PathBuf| LogFormat::is_named(file);
    let mut tables: Vec<PathBuf> = files.iter().filter(is_log).cloned().collect();
    tables.sort();
    let all = tables.iter().all(|file| LogFormat::of(file).is_table());
    all.then_some(tables)
}

/// Refuses a log that is already in the list, whatever path names it. It would be both fitted and
/// held out, or counted twice.
fn refuse_twice(all: &[Opened], own: &Path, test: bool) -> Result<()> {
    let place = place(own);
    match all.iter().find(|(path, ..)| self::place(path) == place) {
        None => Ok(()),
        Some((_, _, before)) if *before == test => Err(failed(own, "is named twice: name it once")),
        Some(_) => Err(failed(
            own,
            "is to be fitted and to be held out: name it once, before --test or after it",
        )),
    }
}

/// Identity of a log: its canonical file, and the episode in it.
fn place(path: &Path) -> (PathBuf, Option<usize>) {
    let (file, episode) = asid_logs::open::split(path);
    (file.canonicalize().unwrap_or(file), episode)
}

fn failed(path: &Path, message: &str) -> anyhow::Error {
    let error = Error::Log {
        path: path.to_owned(),
        message: message.to_owned(),
    };
    error.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: `asid import logs` of a folder of CSV files said "is a folder without meta/info.json".
    #[test]
    fn a_folder_of_tables_stands_for_them_and_a_bag_for_itself() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for name in ["b.csv", "a.csv", "notes.txt"] {
            std::fs::write(path(name), "").unwrap();
        }
        let whole = folder.path().to_owned();
        let found = tables_of(&[whole.clone(), path("c.csv")]);
        assert_eq!(found, [path("a.csv"), path("b.csv"), path("c.csv")]);
        std::fs::write(path("metadata.yaml"), "").unwrap();
        assert_eq!(tables_of(std::slice::from_ref(&whole)), [whole]);
    }
}
