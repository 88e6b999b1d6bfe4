//! Logs of episodes: one CSV file each.
//!
//! A row holds the time (s), the command of each actuator from that time on
//! (`ctrl.<actuator>`), and each sensor's reading of the state at that time,
//! before the row's command acts (`<sensor>`, or `<sensor>.0`, `<sensor>.1`…).
//! An empty cell is a missing reading and is NaN here.

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
    /// State at the first row, where the log has it.
    pub initial: Option<InitialState>,
}

/// State at the first row of a log; NaN where the log does not say.
#[derive(Clone, Debug, PartialEq)]
pub struct InitialState {
    /// Positions, `nq`.
    pub qpos: Vec<f64>,
    /// Velocities, `nv`.
    pub qvel: Vec<f64>,
}

impl InitialState {
    /// True where nothing is left open.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.qpos.iter().chain(&self.qvel).all(|x| x.is_finite())
    }
}

impl Episode {
    /// Commands alone, `frames x nu`, as a log: a row every `period` seconds from 0, the last command held.
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

    /// Gives a log of commands the times (s) of its start and of the ends of its frames, without the dust of products,
    /// and its last row the last command.
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

    /// Entries of a reading's row.
    #[must_use]
    pub fn width(&self) -> usize {
        self.channels.iter().map(|c| c.len).sum()
    }

    /// Reading's row `i`.
    #[must_use]
    pub fn reading(&self, i: usize) -> &[f64] {
        let w = self.width();
        &self.readings[i * w..(i + 1) * w]
    }

    /// Some consecutive rows as a log of their own, whose start is not known unless it is this log's.
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

    /// Where a channel lies in a reading's row.
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

    /// Readings of the channels `names` only, `rows x their width`, NaN where a
    /// channel is not in the log.
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
        let mut header = vec!["time".to_owned()];
        header.extend(self.actuators.iter().map(|a| format!("ctrl.{a}")));
        for c in &self.channels {
            if c.len == 1 {
                header.push(c.name.clone());
            } else {
                header.extend((0..c.len).map(|i| format!("{}.{i}", c.name)));
            }
        }
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
            text.push('\n');
        }
        std::fs::write(path, text).map_err(|e| Error::File {
            path: path.to_owned(),
            message: e.to_string(),
        })
    }
}

/// A cell of text, in quotes where a CSV file needs them (RFC 4180).
fn quoted(text: &str) -> String {
    if text.contains(['"', ',', '\n', '\r']) || text.trim() != text {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// The shortest text that reads back as the same number.
fn cell(x: f64) -> String {
    if x != 0.0 && (x.abs() < 1e-4 || x.abs() >= 1e15) {
        format!("{x:e}")
    } else {
        format!("{x}")
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::layout::{Actuator, Sensor};

    /// A servo with its angle and the place of its tip.
    pub(crate) fn layout() -> Layout {
        Layout {
            timestep: 0.01,
            nq: 0,
            nv: 0,
            bodies: vec!["world".into()],
            geoms: vec![],
            joints: vec![],
            actuators: vec![Actuator {
                name: "servo".into(),
                ctrl_range: None,
            }],
            sensors: vec![
                Sensor {
                    name: "angle".into(),
                    kind: "jointpos".into(),
                    address: 0,
                    len: 1,
                },
                Sensor {
                    name: "tip".into(),
                    kind: "framepos".into(),
                    address: 1,
                    len: 3,
                },
            ],
            keyframes: vec![],
        }
    }

    fn read(text: &str) -> Result<Episode> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("log.csv");
        std::fs::write(&path, text).unwrap();
        Episode::read(&path, &layout())
    }

    #[test]
    fn logs_round_trip_to_the_bit() {
        let episode = Episode {
            time: vec![0.0, 0.1, 0.2],
            actuators: vec!["servo".into()],
            ctrl: vec![1.0 / 3.0, -2e-7, 1e20],
            channels: vec![
                ChannelColumns {
                    name: "angle".into(),
                    len: 1,
                },
                ChannelColumns {
                    name: "tip".into(),
                    len: 3,
                },
            ],
            readings: vec![
                0.1,
                1.0,
                f64::NAN,
                3.0,
                0.2,
                1.5,
                2.0,
                3.5,
                -0.3,
                1.0,
                2.0,
                std::f64::consts::PI,
            ],
            initial: None,
        };
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("log.csv");
        episode.write_csv(&path).unwrap();
        let back = Episode::read(&path, &layout()).unwrap();
        assert_eq!(back.time, episode.time);
        assert_eq!(back.ctrl, episode.ctrl);
        for (a, b) in back.readings.iter().zip(&episode.readings) {
            assert!(a == b || (a.is_nan() && b.is_nan()));
        }
    }

    #[test]
    fn names_with_commas_and_quotes_read_back() {
        let mut layout = layout();
        for (name, odd) in [("servo", "a, \"b\""), ("angle", "l,ed")] {
            for a in layout.actuators.iter_mut().filter(|a| a.name == name) {
                a.name = odd.into();
            }
            for s in layout.sensors.iter_mut().filter(|s| s.name == name) {
                s.name = odd.into();
            }
        }
        let actuators = vec![layout.actuators[0].name.clone()];
        let sensor = layout.sensors.iter().find(|s| s.len == 1).unwrap();
        let episode = Episode {
            time: vec![0.0, 0.1],
            actuators,
            ctrl: vec![1.0, 2.0],
            channels: vec![ChannelColumns {
                name: sensor.name.clone(),
                len: 1,
            }],
            readings: vec![0.5, 0.25],
            ..Episode::default()
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        episode.write_csv(&path).unwrap();
        let header = std::fs::read_to_string(&path).unwrap();
        assert!(
            header.starts_with("time,\"ctrl.a, \"\"b\"\"\","),
            "{header}"
        );
        let back = Episode::read(&path, &layout);
        assert_eq!(
            back.map(|b| b.readings).map_err(|e| e.to_string()),
            Ok(episode.readings)
        );
    }

    #[test]
    fn bad_logs_name_row_and_column() {
        let cases = [
            ("t,ctrl.servo,angle\n0,1,2\n", "no column `time`"),
            ("time,angle\n0,1\n", "`ctrl.servo`"),
            ("time,ctrl.servo,angel\n0,1,2\n1,1,2\n", "`angel`"),
            ("time,ctrl.servo,tip.0,tip.1\n0,1,2,3\n", "`tip.2`"),
            ("time,ctrl.servo,angle\n0,1,2\n0,1,2\n", "1 rows"),
            (
                "time,ctrl.servo,angle\n0,1,2\n1,1,abc\n",
                "row 3, column `angle`: `abc`",
            ),
            (
                "time,ctrl.servo,angle\n0,,2\n1,,2\n",
                "column `ctrl.servo`: every command is missing",
            ),
            ("time,ctrl.servo,angle\n0,1,2\n", "1 rows"),
            ("time,ctrl.servo,angle\n0,1,\n1,1,\n", "every reading"),
            ("time,ctrl.servo,angle\n0,1,2\n1,1\n", "row 3"),
        ];
        for (text, expected) in cases {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
