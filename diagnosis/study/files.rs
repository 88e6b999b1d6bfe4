//! The logs that a study names: file patterns, and how each file is read.

use std::path::{Path, PathBuf};

use asid_core::{Episode, Error, Result};
use asid_logs::episode::{Angle, ColumnMapping, LogNotes, angles, of_table, read_as, wanted};
use asid_logs::{LogSettings, Opener};
use asid_mjcf::Plant;

/// Reads the logs of a study.
pub(super) struct Logs<'a> {
    folder: &'a Path,
    plant: &'a Plant,
    columns: &'a [ColumnMapping],
    angles: Vec<Angle>,
    settings: &'a LogSettings,
    opener: Opener,
}

/// A log: its name, the episode, and what was skipped or repaired.
type Read = (String, Episode, LogNotes);

impl<'a> Logs<'a> {
    pub(super) fn new(
        folder: &'a Path,
        plant: &'a Plant,
        columns: &'a [ColumnMapping],
        settings: &'a LogSettings,
    ) -> Self {
        Self {
            folder,
            plant,
            columns,
            angles: angles(plant, columns),
            settings,
            opener: Opener::default(),
        }
    }

    /// Reads the logs that some patterns match, each once, sorted by name within a pattern.
    ///
    /// # Errors
    /// When a pattern matches nothing, or a log cannot be used.
    pub(super) fn read(&mut self, patterns: &[String], key: &str) -> Result<Vec<Read>> {
        let mut files: Vec<PathBuf> = Vec::new();
        for pattern in patterns {
            let found = matching(self.folder, pattern)?;
            if found.is_empty() {
                return Err(Error::Config {
                    key: key.into(),
                    message: format!("`{key}`: no file matches `{pattern}`"),
                });
            }
            for file in found {
                if !files.contains(&file) {
                    files.push(file);
                }
            }
        }
        if files.is_empty() && key == "train" {
            return Err(Error::Config {
                key: key.into(),
                message: "`train` names no logs".into(),
            });
        }
        let mut read = Vec::with_capacity(files.len());
        for file in &files {
            read.extend(self.file(file)?);
        }
        Ok(read)
    }

    /// Reads the logs of a file: one, or all episodes of a dataset.
    fn file(&mut self, file: &Path) -> Result<Vec<Read>> {
        let name = |path: &Path| {
            let short = path.strip_prefix(self.folder).unwrap_or(path);
            short.display().to_string()
        };
        // An episode of a dataset (`dataset#3`) is not a file of its own.
        let (at, _) = asid_logs::open::split(file);
        let layout = &self.plant.layout;
        let columns = (self.columns, &self.angles[..]);
        let kind = self.settings.kind_of(&at);
        if kind.is_table() {
            let (episode, notes) = read_as(kind, file, layout, columns)?;
            return Ok(vec![(name(file), episode, notes)]);
        }
        let logs = self.opener.open(file, self.settings)?;
        let [commands, readings] = wanted(layout, self.columns);
        let several = logs.len() > 1;
        let one = |log: asid_logs::RawLog| {
            let (table, streams) = log.table(&commands, &readings, &self.angles);
            let (episode, mut notes) = of_table(file, &table, layout, columns)?;
            notes.passed_over = streams.passed_over;
            notes.remarks = log.remarks;
            notes.turns.extend(streams.turns);
            let name = if several {
                let parent = file.parent().unwrap_or(Path::new(""));
                name(&parent.join(&log.name))
            } else {
                name(file)
            };
            Ok((name, episode, notes))
        };
        logs.into_iter().map(one).collect()
    }
}

/// Returns the files of a folder whose names match a pattern with `*` in its last part, sorted.
fn matching(folder: &Path, pattern: &str) -> Result<Vec<PathBuf>> {
    let path = folder.join(pattern);
    let (Some(parent), Some(last)) = (path.parent(), path.file_name()) else {
        return Ok(Vec::new());
    };
    let last = last.to_string_lossy();
    if !last.contains('*') {
        return Ok(vec![path.clone()]);
    }
    let entries = std::fs::read_dir(parent).map_err(|e| Error::File {
        path: parent.to_owned(),
        message: e.to_string(),
    })?;
    let mut found: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|p| {
            p.file_name()
                .is_some_and(|n| matches(&last, &n.to_string_lossy()))
        })
        .collect();
    found.sort();
    Ok(found)
}

/// Whether a name matches a pattern in which each `*` stands for any characters.
fn matches(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or_default();
    let Some(mut rest) = name.strip_prefix(first) else {
        return false;
    };
    let parts: Vec<&str> = parts.collect();
    let Some((last, middle)) = parts.split_last() else {
        return rest.is_empty();
    };
    for part in middle {
        match rest.find(part) {
            Some(at) => rest = &rest[at + part.len()..],
            None => return false,
        }
    }
    rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::matches;

    #[test]
    fn a_star_stands_for_any_characters() {
        for (pattern, name, expected) in [
            ("train_*.csv", "train_0.csv", true),
            ("train_*.csv", "test_0.csv", false),
            ("*.csv", "a.csv", true),
            ("a*b*c", "axxbyyc", true),
            ("a*b*c", "axxc", false),
            ("log.csv", "log.csv", true),
        ] {
            assert_eq!(matches(pattern, name), expected, "{pattern} {name}");
        }
    }
}
