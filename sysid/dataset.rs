//! Logs prepared for comparison with their replays.

use std::collections::BTreeMap;
use std::ops::Range;

use asid_core::episode::InitialState;
use asid_core::error::{Error, Result};
use asid_core::signal::{Signal, rotation_difference};
use asid_core::simulator::{BatchConfig, Simulator};
use asid_core::{Episode, Model, Parameter};
use asid_mjcf::Plant;
use asid_readings::SignalSet;
use asid_readings::noise::ThirdDifferences;
use asid_readings::replay::Replay;

use crate::{columns, start, targets};

/// Smallest noise of a sensor, as a share of the spread of its readings.
///
/// A simulated log has no noise at all.
const LEAST_NOISE: f64 = 1e-5;

/// Entries of an orientation, `w x y z`.
const QUATERNION: usize = 4;

/// Most memory for the recorded replays of a batch, bytes: 256 MiB.
///
/// Readings at irregular times are interpolated between records of every physics step. For 256
/// replays of a minute these would take several gigabytes. Larger batches keep more cores busy.
const RECORDS: usize = 256 << 20;

/// One episode.
#[derive(Clone, Debug)]
pub struct Trial {
    /// File name.
    pub name: String,
    /// The log.
    pub episode: Episode,
    /// Readings of the compared sensors, `rows x width`, NaN where missing.
    pub readings: Vec<f64>,
    /// Initial state of the replay.
    pub start: InitialState,
    /// Coordinates of the initial state that the log leaves open.
    pub open: Vec<usize>,
    replay: Replay,
}

/// Episodes of one machine, and the sensors that are compared.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// Sensors that at least one log has, with their noise.
    pub signals: Vec<Signal>,
    /// Episodes.
    pub trials: Vec<Trial>,
    differences: SignalSet,
}

impl Dataset {
    /// The noise of each sensor, so that other logs are compared in the same units.
    #[must_use]
    pub fn noise(&self) -> BTreeMap<String, f64> {
        let each = self.signals.iter();
        each.map(|s| (s.sensor.clone(), s.noise)).collect()
    }

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

    /// Number of residuals of a row.
    #[must_use]
    pub fn entries(&self) -> usize {
        self.differences.whitened_len()
    }

    /// Number of an episode's residuals for which a reading is present.
    pub(crate) fn present(&self, trial: &Trial) -> usize {
        let itself = self.residuals(trial, &trial.readings);
        itself.iter().filter(|x| x.is_finite()).count()
    }

    /// Residuals `(logged - predicted) / noise` of an episode, `rows x entries`.
    ///
    /// NaN where a reading is missing.
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

/// A present reading, or an angle computed from it: row, time (s) and value.
type Point = (usize, f64, f64);

/// Estimates the noise of a sensor from the high-frequency part of its readings.
///
/// The noise is that of each number, or of each rotation angle (rad) of an orientation. Readings
/// that come in steps have at least the standard deviation of a step, `step / sqrt(12)`.
fn noise_of(sensor: &str, logs: &[(String, Episode)]) -> f64 {
    let mut rough = ThirdDifferences::default();
    let mut step = f64::INFINITY;
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    // A small rotation changes a quaternion by half of its angle.
    let mut unit = 1.0;
    for (_, episode) in logs {
        let Some(range) = episode.channel(sensor) else {
            continue;
        };
        for column in range.clone() {
            let series = numbers(episode, column);
            for (.., x) in &series {
                (low, high) = (low.min(*x), high.max(*x));
            }
            let steps = series.windows(2).map(|w| (w[1].2 - w[0].2).abs());
            step = steps.filter(|d| *d > 0.0).fold(step, f64::min);
            if range.len() != QUATERNION {
                rough.add(&series);
            }
        }
        if range.len() == QUATERNION {
            unit = 2.0;
            for series in turns(episode, &range) {
                rough.add(&series);
            }
        }
    }
    let least = (LEAST_NOISE * unit * (high - low)).max(f64::MIN_POSITIVE.sqrt());
    let least = if least.is_finite() { least } else { 1.0 };
    let step = if step.is_finite() {
        unit * step / 12.0_f64.sqrt()
    } else {
        0.0
    };
    rough.noise().deviation.max(least).max(step)
}

/// The present readings of a column, without repeats.
///
/// A reading that only repeats the one before, as of an encoder at rest, has no noise of its own.
fn numbers(episode: &Episode, column: usize) -> Vec<Point> {
    let reading = |k: usize| episode.reading(k)[column];
    (0..episode.rows())
        .filter(|&k| reading(k).is_finite() && (k == 0 || reading(k) != reading(k - 1)))
        .map(|k| (k, episode.time[k], reading(k)))
        .collect()
}

/// The angles (rad) about the world's three axes by which an orientation has turned since the
/// start.
///
/// They are sums of the turns between readings, which are small however far it turns in all. The
/// sign of a quaternion does not matter.
fn turns(episode: &Episode, columns: &Range<usize>) -> [Vec<Point>; 3] {
    let mut series: [Vec<Point>; 3] = Default::default();
    let mut angles = [0.0; 3];
    let mut before: Option<&[f64]> = None;
    for k in 0..episode.rows() {
        let now = &episode.reading(k)[columns.clone()];
        if before == Some(now) {
            continue;
        }
        let turn = rotation_difference(now, before.unwrap_or(now));
        if turn.iter().any(|x| !x.is_finite()) {
            continue;
        }
        for ((angle, by), series) in angles.iter_mut().zip(turn).zip(&mut series) {
            *angle += by;
            series.push((k, episode.time[k], *angle));
        }
        before = Some(now);
    }
    series
}

/// Replays episodes at many parameter values at once.
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

    /// Residuals of one episode for pairs of parameter values and initial states.
    ///
    /// `None` where the simulation diverged.
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
        let size = batch(self.simulator.batch_size(), replay.bytes());
        for chunk in points.chunks(size) {
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

/// Number of replays to run at once, at most `most`, for records of `each` bytes.
fn batch(most: usize, each: usize) -> usize {
    (RECORDS / each.max(1)).clamp(1, most.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Streams;
    use asid_core::episode::ChannelColumns;
    use asid_core::scene::Scene;
    use nalgebra::{UnitQuaternion, Vector3};
    use rand::Rng as _;

    fn log(readings: Vec<f64>) -> (String, Episode) {
        log_of(1, readings)
    }

    /// Rows of `len` numbers, a row every 0.01 s.
    fn log_of(len: usize, readings: Vec<f64>) -> (String, Episode) {
        let rows = readings.len() / len;
        let episode = Episode {
            time: (0..rows).map(|k| 0.01 * k as f64).collect(),
            channels: vec![ChannelColumns {
                name: "q".into(),
                len,
            }],
            readings,
            ..Episode::default()
        };
        ("log".into(), episode)
    }

    /// Readings of a body that turns steadily, four turns in all.
    ///
    /// The noise is 0.01 rad in each rotation angle, and the quaternions come with either sign.
    fn turning(rows: usize) -> Vec<f64> {
        let mut rng = Streams::new(1).stream("t");
        let mut normal = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let mut readings = Vec::new();
        for k in 0..rows {
            let angle = 4.0 * std::f64::consts::TAU * k as f64 / rows as f64;
            let axis = Vector3::new(0.6, 0.0, 0.8);
            let noise = Vector3::from_fn(|_, _| 0.01 * normal());
            let read = UnitQuaternion::from_scaled_axis(noise)
                * UnitQuaternion::from_scaled_axis(angle * axis);
            let sign = if k % 3 == 0 { -1.0 } else { 1.0 };
            readings.extend([read.w, read.i, read.j, read.k].map(|x| sign * x));
        }
        readings
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

    /// Symptom: residuals of an orientation twice as large as those of any other sensor.
    ///
    /// Cause: the noise was that of a quaternion's numbers, each of which changes by half of a
    /// rotation angle at most.
    #[test]
    fn the_noise_of_an_orientation_is_that_of_its_angles() {
        let found = noise_of("q", &[log_of(4, turning(4000))]);
        assert!((found / 0.01 - 1.0).abs() < 0.1, "{found}");
    }

    #[test]
    fn an_orientation_without_noise_has_but_the_least() {
        let rows = (0..1000).flat_map(|k| {
            let half = 0.5 * (0.01 * f64::from(k)).sin();
            [half.cos(), 0.0, 0.0, half.sin()]
        });
        let found = noise_of("q", &[log_of(4, rows.collect())]);
        assert!(found < 1e-4, "{found}");
    }

    /// Symptom: a residual below one noise where a model explains the log as well as it can.
    ///
    /// Cause: an orientation counted as four readings, one for each number of its quaternion, but
    /// has three residuals.
    #[test]
    fn an_orientation_counts_as_three_readings() {
        let xml = r#"<mujoco><worldbody><body name="b"><freejoint/><geom size="0.1"/></body></worldbody>
            <sensor><framequat name="q" objtype="xbody" objname="b"/></sensor></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("s", xml, &[]).unwrap()).unwrap();
        let (name, mut episode) = log_of(4, turning(50));
        // An orientation with a missing number is no reading.
        episode.readings[4 * 7 + 2] = f64::NAN;
        let data = Dataset::new(&plant, &[(name, episode)], &BTreeMap::new()).unwrap();
        assert_eq!(data.present(&data.trials[0]), 3 * 49);
    }

    /// Symptom: a minute's log of irregular times took gigabytes.
    ///
    /// Cause: every replay of a batch of 256 was recorded at each physics step.
    #[test]
    fn a_batch_is_as_large_as_its_records_allow() {
        assert_eq!(batch(256, 8), 256);
        // A minute in steps of 1 ms, 20 numbers each.
        let each = 8 * 20 * 60_000;
        let size = batch(256, each);
        assert!((1..256).contains(&size) && size * each <= RECORDS);
        assert_eq!(batch(256, usize::MAX), 1);
    }
}
