//! Datasets of LeRobot, version 2.1 and 3: a folder with `meta/info.json` and tables in `data/`.
//!
//! `info.json` states the rate and the names of each feature's entries. Version 3 packs many
//! episodes into a file, version 2.1 has a file for each; in both, the column `episode_index` tells
//! a row's episode. A row has the observation at its time and the action that followed it, like a
//! row of the project's own logs.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::Value as Json;

use crate::parquet_file;
use crate::raw::RawLog;
use crate::series::Series;

/// Columns that number rows and are not readings.
const INDICES: [&str; 5] = [
    "index",
    "episode_index",
    "frame_index",
    "task_index",
    "timestamp",
];
/// Largest difference, in frames, of a stamp from its frame's time for the latter to count.
///
/// Files hold stamps in single precision.
const ROUNDED: f64 = 0.02;

/// The required part of `meta/info.json`.
#[derive(Debug, Deserialize)]
struct Info {
    codebase_version: String,
    fps: f64,
    features: BTreeMap<String, Feature>,
}

#[derive(Debug, Deserialize)]
struct Feature {
    #[serde(default)]
    names: Names,
}

/// Names of a feature's entries: a list, or lists under headings, in the order of the document.
#[derive(Debug, Default)]
enum Names {
    /// Neither.
    #[default]
    None,
    /// Each entry's name; `None` where it is no text.
    List(Vec<Option<String>>),
    /// Headings with what is under each.
    Headings(Vec<(String, Self)>),
}

impl<'de> Deserialize<'de> for Names {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Any;
        impl<'de> Visitor<'de> for Any {
            type Value = Names;

            fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
                out.write_str("names of a feature")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut all: A) -> Result<Names, A::Error> {
                let mut list = Vec::new();
                while let Some(entry) = all.next_element::<Json>()? {
                    list.push(entry.as_str().map(str::to_owned));
                }
                Ok(Names::List(list))
            }

            // A map of JSON values would be in the order of the alphabet.
            fn visit_map<A: MapAccess<'de>>(self, mut all: A) -> Result<Names, A::Error> {
                let mut headings = Vec::new();
                while let Some(heading) = all.next_entry()? {
                    headings.push(heading);
                }
                Ok(Names::Headings(headings))
            }

            fn visit_unit<E>(self) -> Result<Names, E> {
                Ok(Names::None)
            }

            fn visit_str<E>(self, _: &str) -> Result<Names, E> {
                Ok(Names::None)
            }

            fn visit_bool<E>(self, _: bool) -> Result<Names, E> {
                Ok(Names::None)
            }

            fn visit_i64<E>(self, _: i64) -> Result<Names, E> {
                Ok(Names::None)
            }

            fn visit_u64<E>(self, _: u64) -> Result<Names, E> {
                Ok(Names::None)
            }

            fn visit_f64<E>(self, _: f64) -> Result<Names, E> {
                Ok(Names::None)
            }
        }
        deserializer.deserialize_any(Any)
    }
}

impl Names {
    /// The name of each entry, in order.
    ///
    /// Entries of one name are told apart by their headings. Where that does not help, and where an
    /// entry has no text, it has no name.
    fn of_entries(&self) -> Vec<Option<String>> {
        let plain = self.flat(false);
        let repeats = |all: &[Option<String>], name: &Option<String>| {
            name.is_some() && all.iter().filter(|n| *n == name).count() > 1
        };
        let chosen = if plain.iter().any(|name| repeats(&plain, name)) {
            self.flat(true)
        } else {
            plain
        };
        let told_apart = |name: &Option<String>| name.clone().filter(|_| !repeats(&chosen, name));
        chosen.iter().map(told_apart).collect()
    }

    fn flat(&self, with_headings: bool) -> Vec<Option<String>> {
        match self {
            Self::None => Vec::new(),
            Self::List(list) => list.clone(),
            Self::Headings(headings) => {
                let under = |(heading, names): &(String, Self)| {
                    let name = |name: Option<String>| match name {
                        Some(name) if with_headings => Some(format!("{heading}.{name}")),
                        other => other,
                    };
                    let names = names.flat(with_headings).into_iter();
                    names.map(name).collect::<Vec<_>>()
                };
                headings.iter().flat_map(under).collect()
            }
        }
    }
}

/// Reads all episodes of a dataset, in order, each with its number.
///
/// # Errors
/// When a file is missing or damaged, or the dataset has another version.
pub fn read(path: &Path) -> Result<Vec<(usize, RawLog)>, String> {
    let text = std::fs::read_to_string(path.join("meta/info.json"));
    let text = text.map_err(|e| format!("meta/info.json: {e}"))?;
    let info: Info = serde_json::from_str(&text).map_err(|e| format!("meta/info.json: {e}"))?;
    if !["v2", "v3"]
        .iter()
        .any(|v| info.codebase_version.starts_with(v))
    {
        return Err(format!(
            "meta/info.json: a dataset of version {}; versions 2 and 3 are read",
            info.codebase_version
        ));
    }
    if !(info.fps.is_finite() && info.fps > 0.0) {
        return Err(format!("meta/info.json: fps = {} is no rate", info.fps));
    }
    let mut files = Vec::new();
    tables(&path.join("data"), 0, &mut files)?;
    files.sort();
    let mut episodes: BTreeMap<usize, RawLog> = BTreeMap::new();
    for file in files {
        let shown = file
            .strip_prefix(path)
            .unwrap_or(&file)
            .display()
            .to_string();
        let columns = parquet_file::columns(&file, true).map_err(|e| format!("{shown}: {e}"))?;
        add(&mut episodes, &columns, &info).map_err(|e| format!("{shown}: {e}"))?;
    }
    if episodes.is_empty() {
        return Err("has no episodes in data/".into());
    }
    Ok(episodes.into_iter().collect())
}

/// Collects the Parquet files in `data/` and its folders of chunks.
fn tables(folder: &Path, depth: usize, files: &mut Vec<PathBuf>) -> Result<(), String> {
    let said = |e: std::io::Error| format!("{}: {e}", folder.display());
    for entry in std::fs::read_dir(folder).map_err(said)? {
        let path = entry.map_err(said)?.path();
        if path.is_dir() && depth == 0 {
            tables(&path, 1, files)?;
        } else if path.extension().is_some_and(|e| e == "parquet") {
            files.push(path);
        }
    }
    Ok(())
}

/// Adds the rows of a file to their episodes.
fn add(
    episodes: &mut BTreeMap<usize, RawLog>,
    columns: &[(String, Vec<f64>)],
    info: &Info,
) -> Result<(), String> {
    let column = |name: &str| columns.iter().find(|(n, _)| n == name).map(|(_, v)| v);
    let episode = column("episode_index").ok_or("has no column `episode_index`")?;
    let frame = column("frame_index");
    let timestamp = column("timestamp");
    for (name, values) in columns {
        if INDICES.contains(&&**name) {
            continue;
        }
        let named = feature_name(name, info);
        for (row, x) in values.iter().enumerate().filter(|(_, x)| x.is_finite()) {
            let number = episode[row];
            if number.is_nan() || number < 0.0 {
                return Err(format!(
                    "row {}: the number of its episode is missing",
                    row + 1
                ));
            }
            let by_rate = frame.map(|f| f[row] / info.fps);
            let stamp = timestamp.map(|t| t[row]);
            let time = match (by_rate, stamp) {
                (Some(a), Some(b)) if (a - b).abs() * info.fps > ROUNDED => b,
                (Some(a), _) => a,
                (None, Some(b)) => b,
                (None, None) => return Err("has no column `timestamp` or `frame_index`".into()),
            };
            let log = episodes.entry(number as usize).or_default();
            let at = match log.series.iter().position(|s| s.name == named) {
                Some(at) => at,
                None => {
                    log.series.push(Series {
                        name: named.clone(),
                        ..Series::default()
                    });
                    log.series.len() - 1
                }
            };
            log.series[at].time.push(time);
            log.series[at].values.push(*x);
        }
    }
    Ok(())
}

/// Name of a column; for an entry of a feature, the names of both.
fn feature_name(column: &str, info: &Info) -> String {
    let Some((feature, entry)) = column.rsplit_once('.') else {
        return column.to_owned();
    };
    let name = info.features.get(feature).and_then(|f| {
        let entry: usize = entry.parse().ok()?;
        f.names.of_entries().get(entry).cloned().flatten()
    });
    name.map_or_else(|| column.to_owned(), |name| format!("{feature}.{name}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info() -> Info {
        serde_json::from_str(
            r#"{"codebase_version": "v3.0", "fps": 50, "features": {
                "action": {"dtype": "float32", "names": ["pan.pos", "gripper.pos"]},
                "observation.state": {"dtype": "float32", "names": {"motors": ["pan", "gripper"]}},
                "timestamp": {"dtype": "float32", "names": null}}}"#,
        )
        .unwrap()
    }

    #[test]
    fn entries_are_named_as_the_dataset_says() {
        let info = info();
        assert_eq!(feature_name("action.1", &info), "action.gripper.pos");
        assert_eq!(
            feature_name("observation.state.0", &info),
            "observation.state.pan"
        );
        assert_eq!(feature_name("action.7", &info), "action.7");
        assert_eq!(feature_name("next.reward", &info), "next.reward");
    }

    /// Symptom: two columns were exchanged, or were one.
    ///
    /// Cause: headings were in the order of the alphabet, and equal names were one name.
    #[test]
    fn entries_are_in_the_order_of_the_document_and_told_apart() {
        let names = |text: &str| {
            let names: Names = serde_json::from_str(text).unwrap();
            let named = names.of_entries().into_iter();
            named.map(Option::unwrap_or_default).collect::<Vec<_>>()
        };
        assert_eq!(
            names(r#"{"right": ["pan.pos"], "left": ["gripper.pos"]}"#),
            ["pan.pos", "gripper.pos"]
        );
        assert_eq!(
            names(r#"{"right": ["pos"], "left": ["pos"]}"#),
            ["right.pos", "left.pos"]
        );
        assert_eq!(names(r#"["pos", "pos", "grip", 3]"#), ["", "", "grip", ""]);
        for text in ["null", "3", "-2.5", "true", "\"a\"", "[]"] {
            assert!(names(text).is_empty(), "{text}");
        }
    }

    #[test]
    fn rows_go_to_their_episodes_at_the_times_of_the_rate() {
        let column = |name: &str, values: &[f64]| (name.to_owned(), values.to_vec());
        let single = f64::from(0.02_f32);
        let columns = [
            column("action.0", &[1.0, 2.0, 3.0]),
            column("episode_index", &[0.0, 0.0, 1.0]),
            column("frame_index", &[0.0, 1.0, 0.0]),
            column("timestamp", &[0.0, single, 0.0]),
        ];
        let mut episodes = BTreeMap::new();
        add(&mut episodes, &columns, &info()).unwrap();
        assert_eq!(episodes[&0].series[0].time, [0.0, 0.02]);
        assert_eq!(episodes[&1].series[0].values, [3.0]);
        assert!(add(&mut episodes, &columns[..1], &info()).is_err());
    }
}
