//! Opens a log of any kind.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use asid_core::{Error, Result};

use crate::csv_file;
use crate::format::{LogFormat, LogSettings};
use crate::raw::RawLog;

/// Separates a dataset's path from the number of an episode: `dataset#3`.
const EPISODE: char = '#';

/// Opens logs; a dataset of many episodes is read once.
#[derive(Debug, Default)]
pub struct Opener {
    /// Datasets already read: their episodes with numbers.
    datasets: HashMap<PathBuf, Vec<(usize, RawLog)>>,
}

impl Opener {
    /// The logs at a path: one log, or all episodes of a dataset; `dataset#3` is one episode.
    ///
    /// # Errors
    /// When the file cannot be read; the message names it.
    pub fn open(&mut self, path: &Path, settings: &LogSettings) -> Result<Vec<RawLog>> {
        let (file, episode) = split(path);
        let failed = |message: String| Error::Log {
            path: path.to_owned(),
            message,
        };
        if !file.exists() {
            return Err(failed("no such file or folder".into()));
        }
        let name = name_of(&file);
        let stamps = settings.stamps.as_deref();
        match settings.kind_of(&file) {
            LogFormat::Csv => Ok(vec![csv_file::read(&file, &name, stamps).map_err(failed)?]),
            LogFormat::Parquet => Ok(vec![parquet(&file, &name, stamps).map_err(failed)?]),
            kind @ (LogFormat::Mcap | LogFormat::Rosbag2) => {
                let log = ros(&file, kind, &settings.topics, &name);
                Ok(vec![log.map_err(failed)?])
            }
            LogFormat::Lerobot => self.episodes(&file, episode, &name).map_err(failed),
        }
    }

    fn episodes(
        &mut self,
        file: &Path,
        episode: Option<usize>,
        name: &str,
    ) -> Result<Vec<RawLog>, String> {
        if !self.datasets.contains_key(file) {
            self.datasets.insert(file.to_owned(), lerobot(file)?);
        }
        let all = self.datasets.get(file).map_or(&[][..], Vec::as_slice);
        let chosen = all.iter().filter(|(n, _)| episode.is_none_or(|e| e == *n));
        let chosen: Vec<RawLog> = chosen
            .map(|(n, log)| RawLog {
                name: format!("{name}{EPISODE}{n}"),
                ..log.clone()
            })
            .collect();
        match episode {
            Some(number) if chosen.is_empty() => Err(format!(
                "the dataset has no episode {number}; it has {} of them",
                all.len()
            )),
            _ => Ok(chosen),
        }
    }
}

/// Splits a path into a file and the number of an episode; an existing path has no number.
#[must_use]
pub fn split(path: &Path) -> (PathBuf, Option<usize>) {
    let text = path.to_string_lossy();
    match text.rsplit_once(EPISODE) {
        Some((file, number)) if !path.exists() => match number.parse() {
            Ok(number) => (PathBuf::from(file), Some(number)),
            Err(_) => (path.to_owned(), None),
        },
        _ => (path.to_owned(), None),
    }
}

fn name_of(file: &Path) -> String {
    let name = if file.is_dir() {
        file.file_name()
    } else {
        file.file_stem()
    };
    name.map_or_else(|| "log".into(), |n| n.to_string_lossy().into_owned())
}

/// The error of a build without a reader.
#[cfg(not(all(feature = "parquet", feature = "ros")))]
fn lacking(what: &str) -> String {
    format!("is {what}, which this build cannot read: build with `--features logs`")
}

#[cfg(feature = "parquet")]
fn parquet(file: &Path, name: &str, stamps: Option<&str>) -> Result<RawLog, String> {
    crate::parquet_file::read(file, name, stamps)
}

#[cfg(not(feature = "parquet"))]
fn parquet(_: &Path, _: &str, _: Option<&str>) -> Result<RawLog, String> {
    Err(lacking("a Parquet file"))
}

#[cfg(feature = "parquet")]
fn lerobot(file: &Path) -> Result<Vec<(usize, RawLog)>, String> {
    crate::lerobot::read(file)
}

#[cfg(not(feature = "parquet"))]
fn lerobot(_: &Path) -> Result<Vec<(usize, RawLog)>, String> {
    Err(lacking("a LeRobot dataset"))
}

#[cfg(feature = "ros")]
fn ros(file: &Path, kind: LogFormat, chosen: &[String], name: &str) -> Result<RawLog, String> {
    let mut topics = crate::ros::topics::Topics::new(chosen);
    match kind {
        LogFormat::Mcap => crate::mcap_file::read(file, &mut topics)?,
        _ => crate::bag::read(file, &mut topics)?,
    }
    topics.finish(name)
}

#[cfg(not(feature = "ros"))]
fn ros(_: &Path, _: LogFormat, _: &[String], _: &str) -> Result<RawLog, String> {
    Err(lacking("a recording of ROS 2"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_episode_of_a_dataset_is_named_by_its_number() {
        assert_eq!(
            split(Path::new("no/set#12")),
            (PathBuf::from("no/set"), Some(12))
        );
        assert_eq!(split(Path::new("no/set#a")).1, None);
        let folder = tempfile::tempdir().unwrap();
        let odd = folder.path().join("run#1");
        std::fs::write(&odd, "").unwrap();
        assert_eq!(split(&odd), (odd.clone(), None));
    }

    #[test]
    fn what_is_not_there_is_one_line() {
        let mut opener = Opener::default();
        let error = opener.open(Path::new("nowhere.mcap"), &LogSettings::default());
        let said = error.unwrap_err().to_string();
        assert!(said.contains("nowhere.mcap") && said.lines().count() == 1);
    }
}
