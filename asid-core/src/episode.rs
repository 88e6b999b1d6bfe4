//! Logs of episodes: one CSV file each.
//!
//! A row holds the time (s), the command of each actuator from that time on (`ctrl.<actuator>`),
//! and each sensor's reading of the state at that time, before the row's command acts (`<sensor>`,
//! or `<sensor>.0`, `<sensor>.1`…). An empty cell is a missing reading and is NaN here.

use std::path::Path;

use crate::error::{Error, Result};
use crate::layout::Layout;

/// A sensor's columns.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelColumns {
    /// Name of the sensor.
    pub name: String,
    /// Number of columns.
    pub len: usize,
}

/// One episode: commands and readings over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Episode {
    /// Times, s, strictly increasing; `rows`.
    pub time: Vec<f64>,
    /// Names of the actuators.
    pub actuators: Vec<String>,
    /// Commands, `rows x actuators`.
    pub ctrl: Vec<f64>,
    /// Sensors, in the order of a reading's row.
    pub channels: Vec<ChannelColumns>,
    /// Readings, `rows x width`; NaN where missing.
    pub readings: Vec<f64>,
    /// State at the first row, if the log has it.
    pub initial: Option<InitialState>,
}

/// State at the first row of a log; NaN for unknown entries.
#[derive(Clone, Debug, PartialEq)]
pub struct InitialState {
    /// Positions, `nq`.
    pub qpos: Vec<f64>,
    /// Velocities, `nv`.
    pub qvel: Vec<f64>,
}

impl InitialState {
    /// Whether all entries are known.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.qpos.iter().chain(&self.qvel).all(|x| x.is_finite())
    }

    /// Names of columns and values of the known entries.
    fn columns(&self, layout: &Layout) -> Vec<(String, f64)> {
        let mut all = Vec::new();
        for joint in &layout.joints {
            for (prefix, values, first, len) in [
                ("qpos", &self.qpos, joint.qpos, joint.kind.qpos_len()),
                ("qvel", &self.qvel, joint.qvel, joint.kind.qvel_len()),
            ] {
                let own = values.iter().skip(first).take(len).enumerate();
                for (i, value) in own.filter(|(_, x)| x.is_finite()) {
                    let name = match len {
                        1 => format!("{prefix}.{}", joint.name),
                        _ => format!("{prefix}.{}.{i}", joint.name),
                    };
                    all.push((name, *value));
                }
            }
        }
        all
    }
}

impl Episode {
    /// A log of commands only, `frames x nu`: a row every `period` seconds from 0, the last command
    /// held.
    #[must_use]
    pub fn of_commands(layout: &Layout, ctrl: Vec<f64>, period: f64) -> Self {
        let mut episode = Self {
            actuators: layout.actuators.iter().map(|a| a.name.clone()).collect(),
            ctrl,
            ..Self::default()
        };
        episode.close(period);
        episode
    }

    /// Completes a log of commands.
    ///
    /// It gets the times (s) of its start and of the ends of its frames, without rounding noise of
    /// products. Its last row gets the last command.
    pub fn close(&mut self, period: f64) {
        let nu = self.actuators.len();
        self.ctrl.extend_from_within(self.ctrl.len() - nu..);
        let at = |k| (k as f64 * period * 1e9).round() / 1e9;
        self.time = (0..self.ctrl.len() / nu).map(at).collect();
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.time.len()
    }

    /// Number of entries in a row of readings.
    #[must_use]
    pub fn width(&self) -> usize {
        self.channels.iter().map(|c| c.len).sum()
    }

    /// Row `i` of the readings.
    #[must_use]
    pub fn reading(&self, i: usize) -> &[f64] {
        let w = self.width();
        &self.readings[i * w..(i + 1) * w]
    }

    /// Some consecutive rows as a log of their own. Its initial state is unknown unless it starts
    /// at this log's first row.
    #[must_use]
    pub fn part(&self, rows: std::ops::Range<usize>) -> Self {
        let (nu, width) = (self.actuators.len(), self.width());
        let initial = self.initial.clone().filter(|_| rows.start == 0);
        Self {
            time: self.time[rows.clone()].to_vec(),
            actuators: self.actuators.clone(),
            ctrl: self.ctrl[rows.start * nu..rows.end * nu].to_vec(),
            channels: self.channels.clone(),
            readings: self.readings[rows.start * width..rows.end * width].to_vec(),
            initial,
        }
    }

    /// Range of a channel in a row of readings.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<std::ops::Range<usize>> {
        let mut start = 0;
        for c in &self.channels {
            if c.name == name {
                return Some(start..start + c.len);
            }
            start += c.len;
        }
        None
    }

    /// Readings of the channels `names` only, `rows x their width`; NaN for a channel that is not
    /// in the log.
    #[must_use]
    pub fn select(&self, layout: &Layout, names: &[String]) -> Vec<f64> {
        let picks: Vec<(Option<std::ops::Range<usize>>, usize)> = names
            .iter()
            .map(|n| {
                let len = layout.sensor(n).map_or(1, |s| s.len);
                (self.channel(n), len)
            })
            .collect();
        let mut out = Vec::new();
        for i in 0..self.rows() {
            let row = self.reading(i);
            for (range, len) in &picks {
                match range {
                    Some(r) => out.extend_from_slice(&row[r.clone()]),
                    None => out.extend(std::iter::repeat_n(f64::NAN, *len)),
                }
            }
        }
        out
    }

    /// Writes the log.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<()> {
        self.write_beside(path, &[])
    }

    /// Writes the log with the known part of its initial state, as `qpos.JOINT` and `qvel.JOINT` in
    /// the first row.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write_csv_with_start(&self, path: &Path, layout: &Layout) -> Result<()> {
        let start = self.initial.as_ref().map(|state| state.columns(layout));
        self.write_beside(path, &start.unwrap_or_default())
    }

    /// Writes the log, with further columns that have a number in the first row only.
    fn write_beside(&self, path: &Path, start: &[(String, f64)]) -> Result<()> {
        let mut header = vec!["time".to_owned()];
        header.extend(self.actuators.iter().map(|a| format!("ctrl.{a}")));
        for c in &self.channels {
            if c.len == 1 {
                header.push(c.name.clone());
            } else {
                header.extend((0..c.len).map(|i| format!("{}.{i}", c.name)));
            }
        }
        header.extend(start.iter().map(|(name, _)| name.clone()));
        let header: Vec<String> = header.iter().map(|name| quoted(name)).collect();
        let mut text = header.join(",");
        text.push('\n');
        let (nu, width) = (self.actuators.len(), self.width());
        for i in 0..self.rows() {
            text += &cell(self.time[i]);
            for x in self.ctrl[i * nu..(i + 1) * nu]
                .iter()
                .chain(&self.readings[i * width..(i + 1) * width])
            {
                text.push(',');
                if x.is_finite() {
                    text += &cell(*x);
                }
            }
            for (_, x) in start {
                text.push(',');
                if i == 0 {
                    text += &cell(*x);
                }
            }
            text.push('\n');
        }
        std::fs::write(path, text).map_err(|e| Error::File {
            path: path.to_owned(),
            message: e.to_string(),
        })
    }
}

/// A text cell, quoted where CSV requires it (RFC 4180).
fn quoted(text: &str) -> String {
    if text.contains(['"', ',', '\n', '\r']) || text.trim() != text {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// The shortest text that parses to the same number.
fn cell(x: f64) -> String {
    if x != 0.0 && (x.abs() < 1e-4 || x.abs() >= 1e15) {
        format!("{x:e}")
    } else {
        format!("{x}")
    }
}
