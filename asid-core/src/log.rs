//! Reads logs: one file an episode, CSV or (with the feature `parquet`) Parquet, with the same columns.
//!
//! A log is checked as it is read: whatever is wrong is told with its file, row and column.
//! The first row of data is row 2, as a spreadsheet of the CSV file counts it; a Parquet file's
//! rows are counted the same way.

mod csv;
#[cfg(feature = "parquet")]
mod parquet;

use std::path::Path;

use crate::episode::{ChannelColumns, Episode, InitialState};
use crate::error::{Error, Result};
use crate::layout::Layout;

impl Episode {
    /// Reads a log of a scene with this layout; a name that ends in `.parquet` is a Parquet
    /// file, any other CSV. Columns may come in any order and sensors may be missing; columns
    /// `qpos.*` and `qvel.*` hold the state at the first row.
    ///
    /// # Errors
    /// When the file cannot be read or a row or column is wrong; the message names both.
    pub fn read(path: &Path, layout: &Layout) -> Result<Self> {
        let ending = path.extension().map(|e| e.to_ascii_lowercase());
        let read = |path: &Path| {
            match ending.as_deref().and_then(|e| e.to_str()) {
            #[cfg(feature = "parquet")]
            Some("parquet") => parquet::read(path, layout),
            #[cfg(not(feature = "parquet"))]
            Some("parquet") => Err(
                "is a Parquet file, which this build cannot read: build with `--features parquet`, \
                 or convert it to CSV"
                    .to_owned(),
            ),
            _ => csv::read(path, layout),
        }
        };
        read(path).map_err(|message| Error::Log {
            path: path.to_owned(),
            message,
        })
    }
}

/// A log that is being read, row by row.
struct Reader<'a> {
    layout: &'a Layout,
    header: Vec<String>,
    time: usize,
    ctrl: Vec<usize>,
    readings: Vec<usize>,
    /// Column, whether it is a velocity, and its place in `qpos` or `qvel`.
    state: Vec<(usize, bool, usize)>,
    episode: Episode,
}

impl<'a> Reader<'a> {
    /// Finds what each column holds.
    fn new(layout: &'a Layout, header: Vec<String>) -> Result<Self, String> {
        let column = |name: &str| header.iter().position(|h| h == name);
        let time = column("time").ok_or("has no column `time`")?;
        let mut ctrl = Vec::with_capacity(layout.nu());
        for a in &layout.actuators {
            let name = format!("ctrl.{}", a.name);
            let missing = || format!("has no column `{name}`, the command of an actuator");
            ctrl.push(column(&name).ok_or_else(missing)?);
        }
        let mut channels = Vec::new();
        let mut readings = Vec::new();
        for s in &layout.sensors {
            let names: Vec<String> = if s.len == 1 {
                vec![s.name.clone()]
            } else {
                (0..s.len).map(|i| format!("{}.{i}", s.name)).collect()
            };
            let found: Vec<usize> = names.iter().filter_map(|n| column(n)).collect();
            if found.is_empty() {
                continue;
            }
            if found.len() < names.len() {
                let missing = names.iter().find(|n| column(n).is_none());
                return Err(format!(
                    "sensor `{}` has {} entries but column `{}` is missing",
                    s.name,
                    s.len,
                    missing.map_or("", String::as_str)
                ));
            }
            channels.push(ChannelColumns {
                name: s.name.clone(),
                len: s.len,
            });
            readings.extend(found);
        }
        let state = state_columns(layout, &header)?;
        for (i, name) in header.iter().enumerate() {
            let known = i == time
                || ctrl.contains(&i)
                || readings.contains(&i)
                || state.iter().any(|(c, _, _)| *c == i);
            if !known {
                let known = layout.sensors.iter().map(|s| &*s.name);
                return Err(format!(
                    "column `{name}` is no sensor or actuator of the scene; {}",
                    Error::unknown("sensor", name, known)
                ));
            }
        }
        if channels.is_empty() {
            return Err("has no column of a sensor of the scene".into());
        }
        Ok(Self {
            layout,
            time,
            ctrl,
            readings,
            state,
            episode: Episode {
                actuators: layout.actuators.iter().map(|a| a.name.clone()).collect(),
                channels,
                ..Episode::default()
            },
            header,
        })
    }

    /// Takes the next row. `cell` gives the number in a column, NaN where it is empty, or else
    /// what stands there.
    fn row(&mut self, cell: impl Fn(usize) -> Result<f64, String>) -> Result<(), String> {
        let episode = &mut self.episode;
        let row = episode.rows() + 2;
        let header = &self.header;
        let number = |c: usize| -> Result<f64, String> {
            cell(c).map_err(|text| {
                let name = &header[c];
                format!("row {row}, column `{name}`: `{text}` is not a finite number")
            })
        };
        let time = number(self.time)?;
        if time.is_nan() {
            return Err(format!("row {row}: the time is missing"));
        }
        if let Some(&last) = episode.time.last()
            && time <= last
        {
            return Err(format!("row {row}: time {time} does not come after {last}"));
        }
        if episode.time.is_empty() && !self.state.is_empty() {
            let mut state = InitialState {
                qpos: vec![f64::NAN; self.layout.nq],
                qvel: vec![f64::NAN; self.layout.nv],
            };
            for &(c, velocity, at) in &self.state {
                let part = if velocity {
                    &mut state.qvel
                } else {
                    &mut state.qpos
                };
                part[at] = number(c)?;
            }
            episode.initial = Some(state);
        }
        episode.time.push(time);
        for &c in &self.ctrl {
            let x = number(c)?;
            if x.is_nan() {
                let name = &header[c];
                return Err(format!("row {row}, column `{name}`: a command is missing"));
            }
            episode.ctrl.push(x);
        }
        for &c in &self.readings {
            episode.readings.push(number(c)?);
        }
        Ok(())
    }

    /// The episode.
    fn finish(self) -> Result<Episode, String> {
        let episode = self.episode;
        if episode.rows() < 2 {
            return Err(format!(
                "has {} rows of data; at least 2 are needed",
                episode.rows()
            ));
        }
        if episode.readings.iter().all(|x| x.is_nan()) {
            return Err("every reading is missing".into());
        }
        Ok(episode)
    }
}

/// Columns of the state at the first row: column, whether it is a velocity, and its place in
/// `qpos` or `qvel`.
fn state_columns(layout: &Layout, header: &[String]) -> Result<Vec<(usize, bool, usize)>, String> {
    let mut found = Vec::new();
    for (i, name) in header.iter().enumerate() {
        let (rest, velocity) = match (name.strip_prefix("qpos."), name.strip_prefix("qvel.")) {
            (Some(rest), _) => (rest, false),
            (_, Some(rest)) => (rest, true),
            _ => continue,
        };
        let place = layout.joints.iter().find_map(|j| {
            let (first, len) = if velocity {
                (j.qvel, j.kind.qvel_len())
            } else {
                (j.qpos, j.kind.qpos_len())
            };
            match rest.strip_prefix(&*j.name)? {
                "" if len == 1 => Some(first),
                entry => {
                    let entry: usize = entry.strip_prefix('.')?.parse().ok()?;
                    (entry < len).then_some(first + entry)
                }
            }
        });
        let place = place
            .ok_or_else(|| format!("column `{name}` is no coordinate of a joint of the scene"))?;
        found.push((i, velocity, place));
    }
    Ok(found)
}
