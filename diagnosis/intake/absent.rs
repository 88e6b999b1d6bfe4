//! Sensors that some logs of a study read and others do not: their column has another name, or was
//! not recorded.

use asid_core::Episode;

use crate::study::Study;

/// Largest number of logs that are named; the rest is counted.
const NAMED: usize = 4;

/// A sensor that some logs read and others do not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Absent {
    /// Name.
    pub sensor: String,
    /// Logs without a reading of it.
    pub logs: Vec<String>,
    /// Whether these are all logs to fit to.
    pub never_fitted: bool,
    /// Whether the study gives its noise.
    pub has_noise: bool,
    /// Whether these are all held-out logs.
    pub never_held_out: bool,
}

impl Absent {
    /// Describes the sensor in one line.
    #[must_use]
    pub fn line(&self) -> String {
        let mut logs: Vec<String> = self.logs.iter().take(NAMED).cloned().collect();
        if self.logs.len() > NAMED {
            logs.push(format!("{} more", self.logs.len() - NAMED));
        }
        let so = match (self.never_fitted, self.never_held_out, self.has_noise) {
            (_, true, _) => ": no log held out reads it, so that the gap says nothing of it",
            (true, _, true) => ": no log to fit to reads it, so that nothing is fitted to it",
            (true, _, false) => {
                ": no log to fit to reads it, so that its noise is not known and it is passed over"
            }
            _ => "",
        };
        format!(
            "`{}` has no reading in {}{so}; call its column there as in the other logs, or leave these logs out",
            self.sensor,
            logs.join(", ")
        )
    }
}

/// Whether an episode has a reading of a sensor.
fn reads(episode: &Episode, sensor: &str) -> bool {
    let Some(columns) = episode.channel(sensor) else {
        return false;
    };
    let rows = episode.readings.chunks_exact(episode.width().max(1));
    rows.into_iter()
        .any(|row| row[columns.clone()].iter().any(|x| x.is_finite()))
}

/// Returns the sensors that some logs of a study read and others do not, in the scene's order.
#[must_use]
pub fn absent<'s>(study: &Study, sensors: impl IntoIterator<Item = &'s str>) -> Vec<Absent> {
    let of = |sensor: &str| {
        let lacking = |logs: &[(String, Episode)]| -> Vec<String> {
            let without = logs.iter().filter(|(_, e)| !reads(e, sensor));
            without.map(|(name, _)| name.clone()).collect()
        };
        let (fitted, held_out) = (lacking(&study.train), lacking(&study.test));
        let (never_fitted, never_held_out) = (
            fitted.len() == study.train.len(),
            !study.test.is_empty() && held_out.len() == study.test.len(),
        );
        let logs = [fitted, held_out].concat();
        let some = !logs.is_empty() && logs.len() < study.train.len() + study.test.len();
        some.then(|| Absent {
            sensor: sensor.to_owned(),
            logs,
            never_fitted,
            never_held_out,
            has_noise: study.noise.contains_key(sensor),
        })
    };
    sensors.into_iter().filter_map(of).collect()
}
