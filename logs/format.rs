//! Kinds of log files, and `[log]` of a study, which states the kind and the topics.
//!
//! A recording of another stack needs a reader in this crate, a [`LogFormat`] here, and an arm in
//! `open.rs`. [`crate::episode`] reads the project's own tables; a new format of these needs a file
//! and an arm there.

use std::path::Path;

use serde::{Deserialize, Serialize};

/// Kind of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LogFormat {
    /// A text table, with one row for each stamp.
    Csv,
    /// The same table as a Parquet file.
    Parquet,
    /// [MCAP](https://mcap.dev) with messages of ROS 2 (CDR) or JSON.
    Mcap,
    /// A bag of ROS 2: a folder with `metadata.yaml` and files of SQLite or MCAP, or one file of
    /// SQLite.
    Rosbag2,
    /// A dataset of [LeRobot](https://github.com/huggingface/lerobot), version 2.1 or 3.
    ///
    /// A folder with `meta/info.json`.
    Lerobot,
}

impl LogFormat {
    /// The kind of a path, by its name and contents; a text table by default.
    #[must_use]
    pub fn of(path: &Path) -> Self {
        if path.is_dir() {
            return if path.join("meta/info.json").is_file() {
                Self::Lerobot
            } else {
                Self::Rosbag2
            };
        }
        let ending = path.extension().map(|e| e.to_ascii_lowercase());
        match ending.as_deref().and_then(|e| e.to_str()) {
            Some("mcap") => Self::Mcap,
            Some("db3") => Self::Rosbag2,
            Some("parquet") => Self::Parquet,
            _ => Self::Csv,
        }
    }

    /// Whether the name or the contents of a path say that it is a log, and of no other kind of
    /// file.
    #[must_use]
    pub fn is_named(path: &Path) -> bool {
        if path.is_dir() {
            let marks = ["meta/info.json", "metadata.yaml"];
            return marks.iter().any(|mark| path.join(mark).is_file());
        }
        let ending = path.extension().is_some_and(|e| {
            let known = ["csv", "tsv"];
            known.iter().any(|k| e.eq_ignore_ascii_case(k))
        });
        ending || Self::of(path) != Self::Csv
    }

    /// Whether rows of one table hold all columns, as in the project's own logs.
    #[must_use]
    pub fn is_table(self) -> bool {
        matches!(self, Self::Csv | Self::Parquet)
    }

    /// Its name in a study.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
            Self::Mcap => "mcap",
            Self::Rosbag2 => "rosbag2",
            Self::Lerobot => "lerobot",
        }
    }
}

/// `[log]` of a study.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LogSettings {
    /// Kind of the files; detected where it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<LogFormat>,
    /// Topics to read; all if empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub topics: Vec<String>,
    /// Column of a table's stamps, for an import; a study names it by `[[column]] name = "time"`.
    #[serde(skip)]
    pub stamps: Option<String>,
}

impl LogSettings {
    /// The kind of a file.
    #[must_use]
    pub fn kind_of(&self, path: &Path) -> LogFormat {
        self.kind.unwrap_or_else(|| LogFormat::of(path))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_are_told_by_their_looks() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("meta")).unwrap();
        assert_eq!(LogFormat::of(folder.path()), LogFormat::Rosbag2);
        std::fs::write(folder.path().join("meta/info.json"), "{}").unwrap();
        assert_eq!(LogFormat::of(folder.path()), LogFormat::Lerobot);
        for (name, kind) in [
            ("a.MCAP", LogFormat::Mcap),
            ("a.db3", LogFormat::Rosbag2),
            ("a.parquet", LogFormat::Parquet),
            ("a.log", LogFormat::Csv),
        ] {
            assert_eq!(LogFormat::of(Path::new(name)), kind);
        }
        for (name, is) in [("a.CSV", true), ("a.mcap", true), ("a.toml", false)] {
            assert_eq!(LogFormat::is_named(Path::new(name)), is, "{name}");
        }
        assert!(LogFormat::is_named(folder.path()));
    }
}
