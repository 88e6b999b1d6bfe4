//! Readings that come late: a pure delay, and a first-order low pass.
//!
//! Both see the recorded rows of a rollout and interpolate between them, so that a row's period may
//! be long compared with the delay. Before the first row the reading is taken as constant.

use std::collections::VecDeque;

use crate::{Acting, Acts, Confusion, Effect, EffectParameter, Native, Site};
use asid_core::Result;
use asid_mjcf::Plant;
use asid_mjcf::native::NativeModel;

use super::sensor::sensors;
use super::{at_least, values};

crate::register!(EffectEntry {
    name: "sensor-delay",
    about: "a reading is old",
    make: || Box::new(Delay),
});

crate::register!(EffectEntry {
    name: "sensor-filter",
    about: "a reading is smoothed by a first-order low pass",
    make: || Box::new(Filter),
});

/// Longest delay of the search, s.
const LONGEST: f64 = 0.5;

/// Number of rows that a value is interpolated from: four define a cubic.
const POINTS: usize = 4;

/// A row: time, then the reading, of at most three entries.
type Row = [f64; 4];

/// `r(t - delay)`, from the cubic through the four rows around that time.
///
/// Near the end it uses the last four rows. The cubic follows a motion of 5 Hz to a thousandth from
/// rows of 10 ms.
struct Delay;

struct DelayAt {
    delay: f64,
    /// Rows in order of time.
    past: VecDeque<Row>,
}

impl DelayAt {
    /// Appends a row, and drops the rows that are older than any delay needs.
    fn remember(&mut self, time: f64, reading: &[f64]) {
        let mut row = [time, 0.0, 0.0, 0.0];
        for (to, from) in row[1..].iter_mut().zip(reading) {
            *to = *from;
        }
        while self.past.back().is_some_and(|last| last[0] >= time) {
            self.past.pop_back();
        }
        self.past.push_back(row);
        let horizon = time - self.delay.max(LONGEST);
        while self.past.len() > POINTS && self.past[POINTS / 2][0] < horizon {
            self.past.pop_front();
        }
    }

    /// Entry `entry` of the reading at a time between the first and the last row.
    fn at(&self, time: f64, entry: usize) -> f64 {
        let rows = &self.past;
        let after = rows.partition_point(|row| row[0] < time);
        let count = POINTS.min(rows.len());
        let first = after.saturating_sub(POINTS / 2).min(rows.len() - count);
        let mut sum = 0.0;
        for i in first..first + count {
            let mut weight = 1.0;
            for j in (first..first + count).filter(|&j| j != i) {
                weight *= (time - rows[j][0]) / (rows[i][0] - rows[j][0]);
            }
            sum += weight * rows[i][1 + entry];
        }
        sum
    }
}

impl Acting for DelayAt {
    fn read(&mut self, time: f64, reading: &mut [f64]) {
        self.remember(time, reading);
        let wanted = time - self.delay;
        for (entry, value) in reading.iter_mut().enumerate().take(3) {
            *value = match self.past.front() {
                Some(first) if wanted <= first[0] => first[1 + entry],
                _ => self.at(wanted, entry),
            };
        }
    }

    fn restart(&mut self) {
        self.past.clear();
    }

    fn save(&self, memory: &mut Vec<f64>) {
        self.past.iter().for_each(|row| memory.extend(row));
    }

    fn load(&mut self, memory: &[f64]) {
        self.past.clear();
        let rows = memory.chunks_exact(4);
        self.past.extend(rows.map(|r| [r[0], r[1], r[2], r[3]]));
    }
}

impl Effect for Delay {
    fn delays(&self) -> bool {
        true
    }

    fn mistaken_for(&self) -> &'static [Confusion] {
        &[Confusion {
            with: &["actuator-lag", "sensor-filter"],
            told_apart_by: "a chirp tells more: a delay keeps the gain, a lag loses it",
        }]
    }

    fn acts(&self) -> Acts {
        Acts::Measurement
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const { &[EffectParameter::new("delay", "s", [0.0, LONGEST], 0.0)] }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        sensors(plant)
    }

    fn native(&self, site: &Site<'_>, document: &mut NativeModel<'_>) -> Result<Native> {
        let [delay] = values(site)?;
        document.delay_sensor(site.name, delay)?;
        Ok(Native::Nearly(
            "begins with a history of zero readings; mj_initSensorHistory sets it".into(),
        ))
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [delay] = values(site)?;
        Ok(Box::new(DelayAt {
            delay: at_least(site, "delay", delay, 0.0)?,
            past: VecDeque::new(),
        }))
    }
}

/// `T dy/dt = r - y`, solved exactly for a reading that is linear in time between two rows.
///
/// `y1 = r1 - m T + (y0 - r0 + m T) e^(-h/T)` with the slope `m = (r1 - r0) / h`.
struct Filter;

struct FilterAt {
    time_constant: f64,
    /// Time, reading and output of the last two rows, the older one first.
    rows: Option<[[f64; 7]; 2]>,
}

impl Acting for FilterAt {
    fn read(&mut self, time: f64, reading: &mut [f64]) {
        let row = |reading: &[f64], output: &[f64]| {
            let mut row = [time, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
            row[1..=reading.len()].copy_from_slice(reading);
            row[4..4 + output.len()].copy_from_slice(output);
            row
        };
        // A row that is read again replaces itself.
        let before = match self.rows {
            Some([_, last]) if last[0] < time => last,
            Some([before, _]) if before[0] < time => before,
            _ => {
                let first = row(reading, reading);
                self.rows = Some([first, first]);
                return;
            }
        };
        let (h, t) = (time - before[0], self.time_constant);
        let decay = (-h / t).exp();
        let mut output = [0.0; 3];
        for (i, &r) in reading.iter().enumerate().take(3) {
            let lag = (r - before[1 + i]) / h * t;
            output[i] = r - lag + (before[4 + i] - before[1 + i] + lag) * decay;
        }
        let output = &output[..reading.len()];
        self.rows = Some([before, row(reading, output)]);
        reading.copy_from_slice(output);
    }

    fn restart(&mut self) {
        self.rows = None;
    }

    fn save(&self, memory: &mut Vec<f64>) {
        self.rows.iter().flatten().for_each(|r| memory.extend(r));
    }

    fn load(&mut self, memory: &[f64]) {
        let mut rows = [[0.0; 7]; 2];
        self.rows = (memory.len() == 14).then(|| {
            rows.as_flattened_mut().copy_from_slice(memory);
            rows
        });
    }
}

impl Effect for Filter {
    /// Every reading is delayed by its transport; whether readings are filtered is usually known.
    ///
    /// Where the two cannot be told apart, a delay is likelier.
    fn unusual_at(&self, _plant: &Plant, _site: &str) -> bool {
        true
    }

    fn acts(&self) -> Acts {
        Acts::Measurement
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const { &[EffectParameter::new("time_constant", "s", [0.0, 0.5], 0.0)] }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        sensors(plant)
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [time_constant] = values(site)?;
        Ok(Box::new(FilterAt {
            time_constant: at_least(site, "time_constant", time_constant, 0.0)?,
            rows: None,
        }))
    }
}
