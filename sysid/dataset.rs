//! Logs made ready for comparison with replays of them.

use std::collections::BTreeMap;

use asid_core::episode::InitialState;
use asid_core::error::{Error, Result};
use asid_core::signal::Signal;
use asid_core::simulator::{BatchConfig, Simulator};
use asid_core::{Episode, Model, Parameter};
use asid_mjcf::Plant;
use asid_readings::SignalSet;
use asid_readings::noise::ThirdDifferences;
use asid_readings::replay::Replay;

use crate::{columns, start, targets};

/// Smallest noise of a sensor, as a share of the spread of its readings: a simulated log has none at all.
const LEAST_NOISE: f64 = 1e-5;

/// One episode.
#[derive(Clone, Debug)]
pub struct Trial {
    /// File name.
    pub name: String,
    /// The log.
    pub episode: Episode,
    /// Readings of the compared sensors, `rows x width`, NaN where missing.
    pub readings: Vec<f64>,
    /// Where it begins.
    pub start: InitialState,
    /// Coordinates of the start that the log leaves open.
    pub open: Vec<usize>,
    replay: Replay,
}

/// Episodes of one machine, and what of them is compared.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// Sensors that some log has, with their noise.
    pub signals: Vec<Signal>,
    /// Episodes.
    pub trials: Vec<Trial>,
    differences: SignalSet,
}

impl Dataset {
    /// Prepares logs. The noise of a sensor that `noise` does not give is estimated from the logs.
    ///
    /// # Errors
    /// When no log has a sensor of the scene.
    pub fn new(
        plant: &Plant,
        logs: &[(String, Episode)],
        noise: &BTreeMap<String, f64>,
    ) -> Result<Self> {
        let layout = &plant.layout;
        let logged = |name: &str| logs.iter().any(|(_, e)| e.channel(name).is_some());
        let signals: Vec<Signal> = layout
            .sensors
            .iter()
            .filter(|s| logged(&s.name))
            .map(|s| Signal {
                noise: noise
                    .get(&s.name)
                    .copied()
                    .unwrap_or_else(|| noise_of(&s.name, logs)),
                sensor: s.name.clone(),
            })
            .collect();
        if signals.is_empty() {
            return Err(Error::Config {
                key: "train".into(),
                message: "no log has a column of a sensor of the model".into(),
            });
        }
        let names: Vec<String> = signals.iter().map(|s| s.sensor.clone()).collect();
        let trials = logs
            .iter()
            .map(|(name, episode)| {
                let (start, open) = start::start_of(plant, episode);
                Ok(Trial {
                    name: name.clone(),
                    readings: episode.select(layout, &names),
                    replay: Replay::new(layout, episode, &names)?,
                    episode: episode.clone(),
                    start,
                    open,
                })
            })
            .collect::<Result<_>>()?;
        Ok(Self {
            differences: SignalSet::new(layout, &signals)?,
            signals,
            trials,
        })
    }

    /// Compared numbers of a row.
    #[must_use]
    pub fn entries(&self) -> usize {
        self.differences.whitened_len()
    }

    /// Residuals `(logged - predicted) / noise` of an episode, `rows x entries`; NaN where a reading is missing.
    #[must_use]
    pub fn residuals(&self, trial: &Trial, predicted: &[f64]) -> Vec<f64> {
        let (width, entries) = (self.differences.width(), self.entries());
        let mut out = vec![0.0; trial.episode.rows() * entries];
        let rows = trial
            .readings
            .chunks_exact(width)
            .zip(predicted.chunks_exact(width));
        for ((logged, predicted), row) in rows.zip(out.chunks_exact_mut(entries)) {
            self.differences.difference(logged, predicted, row);
        }
        out
    }
}

/// The noise of a sensor from the rough part of its readings. Readings that come in steps have at least the deviation of a
/// step, `step / sqrt(12)`.
fn noise_of(sensor: &str, logs: &[(String, Episode)]) -> f64 {
    let mut rough = ThirdDifferences::default();
    let mut step = f64::INFINITY;
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for (_, episode) in logs {
        let Some(range) = episode.channel(sensor) else {
            continue;
        };
        for column in range {
            let reading = |k: usize| episode.reading(k)[column];
            // A reading that only repeats the one before, as of an encoder at rest, has no noise of its own.
            let series: Vec<(usize, f64, f64)> = (0..episode.rows())
                .filter(|&k| reading(k).is_finite() && (k == 0 || reading(k) != reading(k - 1)))
                .map(|k| (k, episode.time[k], reading(k)))
                .collect();
            for (.., x) in &series {
                (low, high) = (low.min(*x), high.max(*x));
            }
            let steps = series.windows(2).map(|w| (w[1].2 - w[0].2).abs());
            step = steps.filter(|d| *d > 0.0).fold(step, f64::min);
            rough.add(&series);
        }
    }
    let least = (LEAST_NOISE * (high - low)).max(f64::MIN_POSITIVE.sqrt());
    let least = if least.is_finite() { least } else { 1.0 };
    let step = if step.is_finite() {
        step / 12.0_f64.sqrt()
    } else {
        0.0
    };
    rough.noise().deviation.max(least).max(step)
}

/// Replays episodes at many values of the parameters at once.
pub struct Replayer {
    simulator: Box<dyn Simulator>,
    parameters: Vec<Parameter>,
}

impl Replayer {
    /// A batch of `size` simulations of a model.
    ///
    /// # Errors
    /// When the engine cannot set a target.
    pub fn new(
        model: &dyn Model,
        parameters: &[Parameter],
        size: usize,
        threads: usize,
    ) -> Result<Self> {
        Ok(Self {
            simulator: model.simulator(&BatchConfig {
                size,
                threads,
                targets: targets(parameters),
            })?,
            parameters: parameters.to_vec(),
        })
    }

    /// Physics steps so far.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.simulator.steps_taken()
    }

    /// Residuals of one episode for some values of the parameters and starts; `None` where the simulation diverged.
    ///
    /// # Errors
    /// When a value is not physical or the engine fails.
    pub fn residuals(
        &mut self,
        data: &Dataset,
        trial: &Trial,
        points: &[(&[f64], &InitialState)],
    ) -> Result<Vec<Option<Vec<f64>>>> {
        let mut replay = trial.replay.clone();
        let length = replay.rows() * replay.width();
        let mut all = Vec::with_capacity(points.len());
        for chunk in points.chunks(self.simulator.batch_size()) {
            let sims: Vec<usize> = (0..chunk.len()).collect();
            let values: Vec<f64> = chunk
                .iter()
                .flat_map(|(theta, _)| columns(&self.parameters, theta))
                .collect();
            let gather = |of: fn(&InitialState) -> &[f64]| -> Vec<f64> {
                chunk.iter().flat_map(|(_, s)| of(s).to_vec()).collect()
            };
            self.simulator.reset(&sims)?;
            self.simulator.set_parameters(&sims, &values)?;
            let (qpos, qvel) = (gather(|s| &s.qpos), gather(|s| &s.qvel));
            self.simulator.set_state(&sims, &qpos, &qvel)?;
            let mut out = vec![0.0; chunk.len() * length];
            replay.run(&mut *self.simulator, &sims, &mut out)?;
            let status = self.simulator.status();
            for (&sim, predicted) in sims.iter().zip(out.chunks_exact(length.max(1))) {
                let runs = status[sim].is_running();
                all.push(runs.then(|| data.residuals(trial, predicted)));
            }
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Streams;
    use asid_core::episode::ChannelColumns;
    use rand::Rng as _;

    fn log(readings: Vec<f64>) -> (String, Episode) {
        let episode = Episode {
            time: (0..readings.len()).map(|k| 0.01 * k as f64).collect(),
            channels: vec![ChannelColumns {
                name: "q".into(),
                len: 1,
            }],
            readings,
            ..Episode::default()
        };
        ("log".into(), episode)
    }

    #[test]
    fn noise_is_told_from_motion() {
        let mut rng = Streams::new(1).stream("t");
        let mut normal = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let readings = (0..4000).map(|k| (0.03 * f64::from(k)).sin() + 0.01 * normal());
        let found = noise_of("q", &[log(readings.collect())]);
        // The median of 4000 magnitudes is good to 2 %; neighbours overlap.
        assert!((found / 0.01 - 1.0).abs() < 0.1, "{found}");
    }

    #[test]
    fn readings_in_steps_are_as_noisy_as_a_step() {
        // It stands still most of the time, so that most differences are zero.
        let readings = (0..1000).map(|k| 0.5 * f64::from(k / 100));
        let found = noise_of("q", &[log(readings.collect())]);
        assert!((found - 0.5 / 12.0_f64.sqrt()).abs() < 1e-12, "{found}");
    }
}
