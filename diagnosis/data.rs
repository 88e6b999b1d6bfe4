//! Logs prepared for comparison: entries, noise, and which readings count.

mod cut;
mod row_time;

use asid_core::layout::reads_forces;
use asid_core::signal::Signal;
use asid_core::{Episode, Result};
use asid_readings::SignalSet;
use asid_readings::replay::ReplayPlan;

pub use row_time::row_time;

/// One compared number of a row: a component of a sensor's reading, or of a rotation vector.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Name, `sensor` or `sensor.i`. For an orientation `i` is an axis of the rotation vector
    /// between two readings.
    pub label: String,
    /// Index of its sensor in [`Logs::sensors`].
    pub sensor: usize,
    /// Component of the sensor.
    pub component: usize,
}

/// A sensor whose readings the logs contain.
#[derive(Clone, Debug, PartialEq)]
pub struct LoggedSensor {
    /// Name in the scene.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Standard deviation of its noise, in its unit (rad for an orientation).
    pub noise: f64,
    /// Number of successive readings over which the noise is alike; 1 for white noise.
    ///
    /// The readings carry that much less information on slow changes.
    pub alike: f64,
    /// Whether it reads an orientation.
    pub rotation: bool,
    /// Whether it reads forces or accelerations, which jump where a command does.
    pub jumps: bool,
}

/// One log, prepared for comparison.
#[derive(Clone, Debug)]
pub struct LoggedEpisode {
    /// File name, for messages and tables.
    pub name: String,
    /// Number among all logs of the study, from 0: training logs first, then held-out logs.
    pub number: usize,
    /// The log.
    pub episode: Episode,
    /// Readings of the compared sensors, `rows x width`; NaN where missing.
    pub readings: Vec<f64>,
    /// Plan of its replay.
    pub plan: ReplayPlan,
}

/// Some logs of one machine.
#[derive(Clone, Debug)]
pub struct Logs {
    /// Sensors that at least one of the logs has, in the scene's order.
    pub sensors: Vec<LoggedSensor>,
    /// The numbers that are compared in each row.
    pub entries: Vec<Entry>,
    /// The episodes.
    pub episodes: Vec<LoggedEpisode>,
    differences: SignalSet,
}

/// Returns the unit of a sensor of this machine.
fn unit_of(plant: &asid_mjcf::Plant, sensor: usize) -> String {
    use asid_core::layout::JointKind;
    use asid_mjcf::plant::Reads;
    let s = &plant.layout.sensors[sensor];
    let slide =
        matches!(plant.sensors[sensor], Reads::Joint(j) if plant.joint_kind(j) == JointKind::Slide);
    match (s.kind.as_str(), slide) {
        ("jointpos", true) => "m".into(),
        ("jointpos", false) => "rad".into(),
        ("jointvel", true) => "m/s".into(),
        ("jointvel", false) => "rad/s".into(),
        ("framequat" | "ballquat", _) => "rad".into(),
        _ => s.unit().to_owned(),
    }
}

impl Logs {
    /// Prepares logs for a comparison of the named `sensors`.
    ///
    /// # Errors
    /// When the scene has no such sensor.
    pub fn new(
        plant: &asid_mjcf::Plant,
        sensors: &[String],
        episodes: Vec<(String, Episode)>,
    ) -> Result<Self> {
        let layout = &plant.layout;
        let mut logged = Vec::new();
        let mut entries = Vec::new();
        let mut signals = Vec::new();
        for name in sensors {
            let sensor = layout.sensor(name)?;
            let place = layout.sensors.iter().position(|s| s.name == *name);
            let rotation = sensor.len == 4;
            let len = if rotation { 3 } else { sensor.len };
            for component in 0..len {
                entries.push(Entry {
                    label: if len == 1 {
                        name.clone()
                    } else {
                        format!("{name}.{component}")
                    },
                    sensor: logged.len(),
                    component,
                });
            }
            logged.push(LoggedSensor {
                name: name.clone(),
                unit: place.map_or_else(String::new, |p| unit_of(plant, p)),
                noise: 1.0,
                alike: 1.0,
                rotation,
                jumps: reads_forces(&sensor.kind),
            });
            signals.push(Signal {
                sensor: name.clone(),
                noise: 1.0,
            });
        }
        let episodes = episodes
            .into_iter()
            .enumerate()
            .map(|(number, (name, episode))| LoggedEpisode {
                name,
                number,
                readings: episode.select(layout, sensors),
                plan: ReplayPlan::new(layout, &episode, episode.rows()),
                episode,
            })
            .collect();
        Ok(Self {
            differences: SignalSet::new(layout, &signals)?,
            sensors: logged,
            entries,
            episodes,
        })
    }

    /// Numbers the logs from `first` on.
    #[must_use]
    pub fn counted_from(mut self, first: usize) -> Self {
        for (i, e) in self.episodes.iter_mut().enumerate() {
            e.number = first + i;
        }
        self
    }

    /// Returns the duration of the longest log, s.
    #[must_use]
    pub fn longest(&self) -> f64 {
        let last = |e: &LoggedEpisode| e.episode.time[e.plan.rows() - 1] - e.episode.time[0];
        self.episodes.iter().map(last).fold(0.0, f64::max)
    }

    /// Returns the width of a row of readings.
    #[must_use]
    pub fn width(&self) -> usize {
        self.differences.width()
    }

    /// Returns the sensors with their places in a row of readings.
    pub fn places(&self) -> impl Iterator<Item = (&LoggedSensor, std::ops::Range<usize>)> {
        let mut next = 0;
        let lens = self.differences.lens();
        self.sensors.iter().zip(lens).map(move |(sensor, len)| {
            next += len;
            (sensor, next - len..next)
        })
    }

    /// Returns the names of the sensors, as channels of a recording.
    #[must_use]
    pub fn channels(&self) -> Vec<String> {
        self.sensors.iter().map(|s| s.name.clone()).collect()
    }

    /// Returns where the residuals of episode `i` begin in a residual vector.
    #[must_use]
    pub fn offset(&self, i: usize) -> usize {
        let before = self.episodes[..i].iter();
        before.map(|e| e.plan.rows()).sum::<usize>() * self.entries.len()
    }

    /// Returns the length of a residual vector.
    #[must_use]
    pub fn len(&self) -> usize {
        self.offset(self.episodes.len())
    }

    /// Whether there are no logs.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.episodes.is_empty()
    }

    /// Computes the differences `logged - predicted` of one episode in the sensors' units (`rows x
    /// entries`).
    ///
    /// They are NaN where a reading is missing; `predicted` is `rows x width`.
    pub fn difference(&self, episode: usize, predicted: &[f64], out: &mut [f64]) {
        let (w, n) = (self.width(), self.entries.len());
        let e = &self.episodes[episode];
        for (k, row) in out.chunks_exact_mut(n).enumerate() {
            let (a, b) = (
                &e.readings[k * w..(k + 1) * w],
                &predicted[k * w..(k + 1) * w],
            );
            self.differences.difference(a, b, row);
        }
    }

    /// Computes the difference `a - b` of two rows of readings (`width` each) in the sensors'
    /// units, one number per entry; NaN where either is missing.
    pub fn reading_difference(&self, a: &[f64], b: &[f64], out: &mut [f64]) {
        self.differences.difference(a, b, out);
    }

    /// Returns the rate of change of one episode's predicted readings (`rows x width`) at each row,
    /// in the sensors' units per second (`rows x entries`).
    #[must_use]
    pub fn speeds(&self, episode: usize, predicted: &[f64]) -> Vec<f64> {
        let (w, n) = (self.width(), self.entries.len());
        let time = &self.episodes[episode].episode.time;
        let rows = predicted.len() / w;
        let mut out = vec![0.0; rows * n];
        for (k, row) in out.chunks_exact_mut(n).enumerate() {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(rows - 1));
            let reading = |k: usize| &predicted[k * w..(k + 1) * w];
            self.differences.difference(reading(b), reading(a), row);
            row.iter_mut().for_each(|x| *x /= time[b] - time[a]);
        }
        out
    }

    /// Whether each entry of a residual vector has a reading.
    #[must_use]
    pub fn present(&self) -> Vec<bool> {
        let mut present = vec![false; self.len()];
        let n = self.entries.len();
        for (i, e) in self.episodes.iter().enumerate() {
            let offset = self.offset(i);
            let mut row = vec![0.0; e.plan.rows() * n];
            self.difference(i, &e.readings.clone(), &mut row);
            for (p, x) in present[offset..].iter_mut().zip(&row) {
                *p = x.is_finite();
            }
        }
        present
    }

    /// Sets the noise of the sensors, in their order.
    pub fn set_noise(&mut self, noise: &[f64]) {
        for (sensor, &noise) in self.sensors.iter_mut().zip(noise) {
            sensor.noise = noise;
        }
    }

    /// Returns, for each entry, over how many successive readings its noise is alike.
    #[must_use]
    pub fn entry_alike(&self) -> Vec<f64> {
        let alike = |e: &Entry| self.sensors[e.sensor].alike;
        self.entries.iter().map(alike).collect()
    }

    /// Returns the standard deviation of the noise of each entry.
    #[must_use]
    pub fn entry_noise(&self) -> Vec<f64> {
        let noise = |e: &Entry| self.sensors[e.sensor].noise;
        self.entries.iter().map(noise).collect()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use asid_core::Scene;
    use asid_mjcf::Plant;

    use super::*;

    /// Makes a log of a slide's positions at 0, 0.1, … s.
    pub(crate) fn log(name: &str, readings: &[f64]) -> (String, Episode) {
        let rows: Vec<String> = readings
            .iter()
            .enumerate()
            .map(|(k, x)| format!("{},{x}", 0.1 * k as f64))
            .collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        std::fs::write(&path, format!("time,place\n{}\n", rows.join("\n"))).unwrap();
        (
            name.to_owned(),
            asid_logs::episode::read(&path, &plant().layout).unwrap(),
        )
    }

    /// Makes a machine with one slide.
    pub(crate) fn plant() -> Plant {
        let scene = r#"<mujoco><worldbody><body name="b">
            <joint name="slide" type="slide"/><geom size="0.1" mass="1"/></body></worldbody>
            <sensor><jointpos name="place" joint="slide"/></sensor></mujoco>"#;
        Plant::of(&Scene::from_xml("slide", scene, &[]).unwrap()).unwrap()
    }
    #[test]
    fn speeds_are_those_of_the_readings() {
        let plant = plant();
        let reading = |k: i32| 0.5 * f64::from(k).powi(2);
        let readings: Vec<f64> = (0..5).map(reading).collect();
        let logs = Logs::new(&plant, &["place".to_owned()], vec![log("a", &readings)]).unwrap();
        // The change is k per row of 0.1 s in the middle; half a row less at the ends.
        let speeds = logs.speeds(0, &readings);
        for (speed, k) in speeds.iter().zip([0.5, 1.0, 2.0, 3.0, 3.5]) {
            assert!((speed - 10.0 * k).abs() < 1e-9, "{speeds:?}");
        }
    }
}
