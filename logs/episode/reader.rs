//! Builds an episode from rows of cells: finds the columns, and repairs common faults.

use asid_core::episode::{ChannelColumns, Episode, InitialState};
use asid_core::layout::Layout;
use asid_core::{Error, Result};

use super::mapping::{ColumnMapping, Source};
use super::notes::LogNotes;
use super::turns::Angle;
use super::{clock, delay, orientations};

/// Largest size of a number in a log.
///
/// Stamps in ns since 1970 are 1.8e18, more than any reading in any unit. Programs write the largest
/// number of their type (3.4e38, 1.8e308) where they have none.
const LARGEST: f64 = 1e20;

/// A column of the log, and the conversion of its numbers to a quantity.
#[derive(Clone, Copy, Debug)]
struct Column {
    place: usize,
    factor: f64,
    offset: f64,
    delay: f64,
}

/// A log while it is read, row by row.
pub(super) struct Reader<'a> {
    layout: &'a Layout,
    angles: &'a [Angle],
    header: Vec<String>,
    time: usize,
    /// Factor of the stamps to seconds, if the study states their unit.
    pub(super) time_factor: Option<f64>,
    ctrl: Vec<Column>,
    readings: Vec<Column>,
    /// Column, whether it is a velocity, and its index in `qpos` or `qvel`.
    state: Vec<(usize, bool, usize)>,
    /// Number of each row in messages.
    numbers: Vec<usize>,
    episode: Episode,
    notes: LogNotes,
}

/// Notes of the skipped columns, and of sensors whose names they nearly match.
fn noted(layout: &Layout, channels: &[ChannelColumns], passed_over: Vec<String>) -> LogNotes {
    let mut notes = LogNotes {
        passed_over,
        ..LogNotes::default()
    };
    for (i, s) in layout.sensors.iter().enumerate() {
        if channels.iter().any(|c| c.name == s.name) {
            continue;
        }
        if s.name == format!("sensor{i}") {
            notes.nameless.push(s.name.clone());
        }
        let stems = notes
            .passed_over
            .iter()
            .map(|name| match name.strip_suffix(".0") {
                Some(stem) if s.len > 1 => stem,
                _ => name,
            });
        if let Some(near) = Error::nearest(&s.name, stems) {
            notes.misspelt.push((near, s.name.clone()));
        }
    }
    notes
}

impl<'a> Reader<'a> {
    /// Finds the columns of all quantities.
    pub(super) fn new(
        layout: &'a Layout,
        (mappings, angles): (&[ColumnMapping], &'a [Angle]),
        header: Vec<String>,
    ) -> Result<Self, String> {
        let column = |name: &str| header.iter().position(|h| h == name);
        let find = |name: &str, entry: Option<usize>| -> (Option<Column>, String) {
            let source = Source::of(mappings, name, entry);
            let found = column(&source.column).map(|place| Column {
                place,
                factor: source.factor,
                offset: source.offset,
                delay: source.delay,
            });
            (found, source.column)
        };
        let stamps = Source::of(mappings, "time", None).column;
        let time = column(&stamps).ok_or_else(|| format!("has no column `{stamps}`"))?;
        let stated = mappings.iter().find(|m| m.name == "time");
        let time_factor = stated
            .filter(|m| m.unit.is_some() || m.scale != 1.0)
            .map(ColumnMapping::factor);
        let mut ctrl = Vec::with_capacity(layout.nu());
        for a in &layout.actuators {
            let (found, name) = find(&format!("ctrl.{}", a.name), None);
            let missing = || {
                let near = near_column(layout, mappings, &header, &name);
                let actuator = &a.name;
                format!("has no column `{name}`, the command of actuator `{actuator}`{near}")
            };
            ctrl.push(found.ok_or_else(missing)?);
        }
        let mut channels = Vec::new();
        let mut readings = Vec::new();
        let mut lacking = Vec::new();
        for s in &layout.sensors {
            let entry = |i: usize| (s.len > 1).then_some(i);
            let found: Vec<_> = (0..s.len).map(|i| find(&s.name, entry(i))).collect();
            if found.iter().all(|(c, _)| c.is_none()) {
                let mapped = mappings.iter().filter_map(|m| m.first_entry_of(s)).min();
                lacking.extend(mapped.map(|i| (s.name.clone(), found[i].1.clone())));
                continue;
            }
            if let Some((_, missing)) = found.iter().find(|(c, _)| c.is_none()) {
                return Err(format!(
                    "sensor `{}` has {} entries but column `{missing}` is missing",
                    s.name, s.len,
                ));
            }
            channels.push(ChannelColumns {
                name: s.name.clone(),
                len: s.len,
            });
            readings.extend(found.into_iter().filter_map(|(c, _)| c));
        }
        let state = state_columns(layout, &header);
        let known = |i: usize| {
            i == time
                || ctrl.iter().chain(&readings).any(|c| c.place == i)
                || state.iter().any(|(c, _, _)| *c == i)
        };
        let places = (0..header.len()).filter(|&i| !known(i));
        let mut notes = noted(
            layout,
            &channels,
            places.map(|i| header[i].clone()).collect(),
        );
        notes.lacking = lacking;
        if channels.is_empty() {
            return Err(notes.without_sensor());
        }
        Ok(Self {
            layout,
            angles,
            time,
            time_factor,
            ctrl,
            readings,
            state,
            episode: Episode {
                actuators: layout.actuators.iter().map(|a| a.name.clone()).collect(),
                channels,
                ..Episode::default()
            },
            numbers: Vec::new(),
            notes,
            header,
        })
    }

    /// Adds the next row, which messages name by its number.
    ///
    /// `cell` returns the number in a column, NaN where it is empty, and the cell's text as error.
    pub(super) fn row(
        &mut self,
        row: usize,
        cell: impl Fn(usize) -> Result<f64, String>,
    ) -> Result<(), String> {
        let episode = &mut self.episode;
        let header = &self.header;
        let number = |c: usize| -> Result<f64, String> {
            let name = &header[c];
            match cell(c) {
                Ok(x) if x.abs() > LARGEST => Err(format!(
                    "row {row}, column `{name}`: {x:e} is larger than any reading ({LARGEST:e}): leave the cell empty where nothing was read"
                )),
                Ok(x) => Ok(x),
                Err(text) => Err(format!(
                    "row {row}, column `{name}`: `{text}` is not a finite number"
                )),
            }
        };
        let time = number(self.time)?;
        if time.is_nan() {
            return Err(format!("row {row}: the time is missing"));
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
        self.numbers.push(row);
        episode.time.push(time);
        for c in &self.ctrl {
            episode.ctrl.push(c.factor * number(c.place)? + c.offset);
        }
        for c in &self.readings {
            episode
                .readings
                .push(c.factor * number(c.place)? + c.offset);
        }
        Ok(())
    }

    /// Completes the episode: stamps in seconds, sorted rows, held commands, shifted late columns.
    pub(super) fn finish(mut self) -> Result<(Episode, LogNotes), String> {
        let episode = &mut self.episode;
        clock::to_seconds(&mut episode.time, self.time_factor, &mut self.notes);
        let rows = clock::order(&episode.time, &self.numbers, &mut self.notes)?;
        if self.notes.doubled + self.notes.reordered > 0 {
            let (nu, width) = (episode.actuators.len(), episode.width());
            let gather = |values: &[f64], width: usize| -> Vec<f64> {
                let rows = rows
                    .iter()
                    .flat_map(|&k| &values[k * width..(k + 1) * width]);
                rows.copied().collect()
            };
            episode.time = gather(&episode.time, 1);
            episode.ctrl = gather(&episode.ctrl, nu);
            episode.readings = gather(&episode.readings, width);
        }
        if episode.rows() < 2 {
            return Err(format!(
                "rows of data at different times: {}, and at least 2 are needed",
                episode.rows()
            ));
        }
        let numbers: Vec<usize> = rows.iter().map(|&k| self.numbers[k]).collect();
        clock::check_duration(&episode.time, &numbers, self.layout.timestep)?;
        self.notes.lost = orientations::settle_all(episode, self.layout);
        if episode.readings.iter().all(|x| x.is_nan()) {
            return Err("every reading is missing".into());
        }
        let width = self.readings.len();
        for (j, column) in self.readings.iter().enumerate() {
            let mut cells = episode.readings.iter().skip(j).step_by(width);
            if cells.all(|x| x.is_nan()) {
                self.notes.empty.push(self.header[column.place].clone());
            }
        }
        for (a, column) in self.ctrl.iter().enumerate() {
            let held = hold(&mut episode.ctrl, self.ctrl.len(), a).ok_or_else(|| {
                let name = &self.header[column.place];
                format!("column `{name}`: every command is missing")
            })?;
            self.notes.held += held;
        }
        self.notes.turns = count_turns(episode, self.angles);
        let delays = |columns: &[Column]| columns.iter().map(|c| c.delay).collect::<Vec<_>>();
        delay::readings(episode, self.layout, &delays(&self.readings));
        delay::commands(episode, &delays(&self.ctrl));
        Ok((self.episode, self.notes))
    }
}

/// Counts the turns of angles that are reported within one, and returns the sensors with their jumps.
pub(super) fn count_turns(episode: &mut Episode, angles: &[Angle]) -> Vec<(String, usize)> {
    let width = episode.width();
    let mut found = Vec::new();
    let mut at = 0;
    for channel in &episode.channels {
        let place = at;
        at += channel.len;
        let Some(angle) = angles.iter().find(|a| a.sensor == channel.name) else {
            continue;
        };
        let column = episode.readings.iter().skip(place).step_by(width);
        let mut values: Vec<f64> = column.copied().collect();
        let jumps = angle.unwrap_readings(&mut values);
        if jumps > 0 {
            let cells = episode.readings.iter_mut().skip(place).step_by(width);
            cells.zip(values).for_each(|(cell, x)| *cell = x);
            found.push((channel.name.clone(), jumps));
        }
    }
    found
}

/// Fills in the missing commands of one actuator, and returns their number; `None` if all are
/// missing.
///
/// Each takes the command before it, or the first one where there is none.
fn hold(ctrl: &mut [f64], nu: usize, actuator: usize) -> Option<usize> {
    let column = || (actuator..ctrl.len()).step_by(nu);
    let mut last = ctrl[column().find(|&i| ctrl[i].is_finite())?];
    let mut held = 0;
    for i in column() {
        if ctrl[i].is_finite() {
            last = ctrl[i];
        } else {
            ctrl[i] = last;
            held += 1;
        }
    }
    Some(held)
}

/// The column with the most similar name, as a question for a message. A column of another quantity
/// is not meant.
fn near_column(
    layout: &Layout,
    mappings: &[ColumnMapping],
    header: &[String],
    name: &str,
) -> String {
    let taken = super::wanted(layout, mappings).concat();
    let stamps = Source::of(mappings, "time", None).column;
    let free = header
        .iter()
        .filter(|h| !h.is_empty() && **h != stamps && !taken.contains(h));
    let near = Error::nearest(name, free.map(|h| &**h));
    near.map_or_else(String::new, |near| format!("; is it `{near}`?"))
}

/// Columns of the initial state: column, whether it is a velocity, and its index in `qpos` or
/// `qvel`.
fn state_columns(layout: &Layout, header: &[String]) -> Vec<(usize, bool, usize)> {
    let columns = header.iter().enumerate();
    let of = |(i, name): (usize, &String)| {
        let (velocity, place) = state_place(layout, name)?;
        Some((i, velocity, place))
    };
    columns.filter_map(of).collect()
}

/// Whether a column of this name holds a coordinate of the initial state.
///
/// The names are `qpos.<joint>` and `qvel.<joint>`, with `.i` where a joint has several
/// coordinates.
#[must_use]
pub fn is_of_start(layout: &Layout, name: &str) -> bool {
    state_place(layout, name).is_some()
}

/// Whether a coordinate of the state is a velocity, and its index in `qpos` or `qvel`.
///
/// `None` for any other column.
fn state_place(layout: &Layout, name: &str) -> Option<(bool, usize)> {
    let (rest, velocity) = match (name.strip_prefix("qpos."), name.strip_prefix("qvel.")) {
        (Some(rest), _) => (rest, false),
        (_, rest) => (rest?, true),
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
    })?;
    Some((velocity, place))
}
