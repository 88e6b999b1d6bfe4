//! Logs prepared for replays: corrected if the label states a wiring fault, of bounded length, and
//! with the noise of their readings.

use std::collections::BTreeMap;

use asid_core::signal::Signal;
use asid_core::{Episode, Error, Layout, Result};
use asid_readings::SignalSet;
use asid_readings::replay::Replay;

use super::study::Study;
use crate::answer::Answer;
use crate::label::{Label, WiringTruth};

/// Physics steps of all logs of a kind together; a fit of about twenty replays then takes seconds
/// on one core.
pub const MOST_STEPS: f64 = 24_000.0;
/// Share of a log to which a missing initial state is fitted; this part is then not scored.
pub const HEAD: f64 = 0.1;
/// Smallest number of rows that a log keeps, if it has as many.
const FEWEST_ROWS: usize = 12;

/// One log.
pub struct Log {
    /// Its episode.
    pub episode: Episode,
    /// How it is replayed.
    pub replay: Replay,
    /// Readings, `rows x width`; NaN where missing.
    pub readings: Vec<f64>,
}

/// Logs of one machine.
pub struct Logs {
    /// The logs.
    pub logs: Vec<Log>,
    /// Names of the compared sensors.
    pub sensors: Vec<String>,
    /// Noise of each entry of a residual, in the sensor's unit; an orientation has three entries.
    pub noise: Vec<f64>,
    /// Differences of readings in units of the noise.
    pub signals: SignalSet,
}

/// Noise of the sensors in the logs: from the label, else from the study, else from the answer.
fn noise(study: &Study, label: &Label, answer: Option<&Answer>) -> Result<Vec<Signal>> {
    let said: BTreeMap<&str, f64> = answer
        .into_iter()
        .flat_map(|a| a.gap.signals.iter().map(|s| (&*s.signal, s.noise)))
        .collect();
    let logged = |name: &str| {
        let mut all = study.train.iter().chain(&study.test);
        all.any(|e| e.channel(name).is_some())
    };
    let sensors = study.plant.layout.sensors.iter();
    sensors
        .filter(|s| logged(&s.name))
        .map(|s| {
            let known = label
                .noise
                .get(&s.name)
                .or_else(|| study.noise.get(&s.name));
            let noise = known.copied().or_else(|| said.get(&*s.name).copied());
            noise
                .filter(|n| *n > 0.0)
                .map(|noise| Signal {
                    sensor: s.name.clone(),
                    noise,
                })
                .ok_or_else(|| Error::Failed(format!("nobody says what noise `{}` has", s.name)))
        })
        .collect()
}

/// Corrects a wiring fault in a log.
fn mend(episode: &mut Episode, fault: &WiringTruth) -> Result<()> {
    let at: Option<Vec<usize>> = fault
        .columns
        .iter()
        .map(|c| episode.channel(c).map(|range| range.start))
        .collect();
    let wrong = || Error::Failed(format!("a fault `{}` cannot be mended", fault.fault));
    let at = at.ok_or_else(wrong)?;
    let width = episode.width();
    let rows = episode.readings.chunks_exact_mut(width);
    match (&*fault.fault, &at[..]) {
        ("wiring-swapped", &[a, b]) => rows.for_each(|r| r.swap(a, b)),
        ("wiring-offset", &[a]) => rows.for_each(|r| r[a] -= fault.value),
        ("wiring-sign" | "wiring-unit", &[a]) if fault.value != 0.0 => {
            rows.for_each(|r| r[a] /= fault.value);
        }
        // Readings at other times than their commands would need another replay.
        _ => return Err(wrong()),
    }
    Ok(())
}

/// The first rows of each log, so that a replay of all takes at most `steps` physics steps.
#[must_use]
pub fn within(episodes: &[Episode], timestep: f64, steps: f64) -> Vec<Episode> {
    let length = |e: &Episode| (e.time[e.rows() - 1] - e.time[0]) / timestep;
    let share = (steps / episodes.iter().map(length).sum::<f64>()).min(1.0);
    let cut = |e: &Episode| {
        let rows = (share * e.rows() as f64).ceil() as usize;
        e.part(0..rows.max(FEWEST_ROWS).min(e.rows()))
    };
    episodes.iter().map(cut).collect()
}

impl Logs {
    /// The study's training logs and held-out logs.
    ///
    /// # Errors
    /// If the noise of a sensor is not known, or if the logs cannot be corrected.
    pub fn of(study: &Study, label: &Label, answer: Option<&Answer>) -> Result<[Self; 2]> {
        let signals = noise(study, label, answer)?;
        let make = |episodes: &[Episode]| -> Result<Self> {
            let mut cut = within(episodes, study.plant.layout.timestep, MOST_STEPS);
            for episode in &mut cut {
                label.wiring.iter().try_for_each(|w| mend(episode, w))?;
            }
            Self::new(&study.plant.layout, &signals, cut)
        };
        Ok([make(&study.train)?, make(&study.test)?])
    }

    /// Some episodes, compared by some signals.
    ///
    /// # Errors
    /// If the scene lacks a sensor.
    pub fn new(layout: &Layout, signals: &[Signal], episodes: Vec<Episode>) -> Result<Self> {
        let sensors: Vec<String> = signals.iter().map(|s| s.sensor.clone()).collect();
        let logs = episodes.into_iter().map(|episode| {
            Ok(Log {
                readings: episode.select(layout, &sensors),
                replay: Replay::new(layout, &episode, &sensors)?,
                episode,
            })
        });
        Ok(Self {
            logs: logs.collect::<Result<_>>()?,
            signals: SignalSet::new(layout, signals)?,
            noise: noise_by_entry(layout, signals)?,
            sensors,
        })
    }

    /// The first rows of each log, to which a missing initial state is fitted.
    ///
    /// # Errors
    /// As [`Logs::of`].
    pub fn heads(&self, layout: &Layout, share: f64) -> Result<Self> {
        self.cut(layout, |rows| head_rows(rows, share))
    }

    /// A copy of these logs.
    ///
    /// # Errors
    /// As [`Logs::of`].
    pub fn like(&self, layout: &Layout) -> Result<Self> {
        self.cut(layout, |rows| rows)
    }

    fn cut(&self, layout: &Layout, rows: impl Fn(usize) -> usize) -> Result<Self> {
        let logs = self.logs.iter().map(|log| {
            let episode = log.episode.part(0..rows(log.episode.rows()));
            Ok(Log {
                readings: episode.select(layout, &self.sensors),
                replay: Replay::new(layout, &episode, &self.sensors)?,
                episode,
            })
        });
        Ok(Self {
            logs: logs.collect::<Result<_>>()?,
            sensors: self.sensors.clone(),
            signals: self.signals.clone(),
            noise: self.noise.clone(),
        })
    }

    /// The same logs with other readings, one array per log; missing readings stay missing.
    #[must_use]
    pub fn with_readings(mut self, readings: &[Vec<f64>]) -> Self {
        for (log, new) in self.logs.iter_mut().zip(readings) {
            for (old, new) in log.readings.iter_mut().zip(new) {
                if old.is_finite() {
                    *old = *new;
                }
            }
        }
        self
    }

    /// Residuals of predicted readings (`rows x width`, one array per log), in units of the noise.
    ///
    /// They are NaN if a reading is missing or a simulation diverged.
    #[must_use]
    pub fn residuals(&self, predicted: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let (width, n) = (self.signals.width(), self.signals.whitened_len());
        let logs = self.logs.iter().zip(predicted);
        logs.map(|(log, predicted)| {
            let mut out = vec![0.0; log.episode.rows() * n];
            let rows = log
                .readings
                .chunks_exact(width)
                .zip(predicted.chunks_exact(width));
            for ((real, said), out) in rows.zip(out.chunks_exact_mut(n)) {
                self.signals.difference(real, said, out);
            }
            out
        })
        .collect()
    }
}

/// Noise of each entry of a residual.
fn noise_by_entry(layout: &Layout, signals: &[Signal]) -> Result<Vec<f64>> {
    let mut all = Vec::new();
    for signal in signals {
        let entries = match layout.sensor(&signal.sensor)?.len {
            4 => 3,
            len => len,
        };
        all.extend(std::iter::repeat_n(signal.noise, entries));
    }
    Ok(all)
}

/// Number of rows in the head of a log with `rows` rows.
#[must_use]
pub fn head_rows(rows: usize, share: f64) -> usize {
    let share = (share * rows as f64).ceil() as usize;
    share.max(FEWEST_ROWS).min(rows)
}
