//! Sensors whose readings never change while the model's do: an unplugged encoder, a field that
//! nobody fills.
//!
//! Readings without any third difference show no noise, and without a unit of noise every gap is
//! infinite. That does not matter where the model reads the same. Where it does not, such a sensor
//! is skipped and named: its fault is not physics. If the study gives its noise, the sensor counts.

use asid_core::{Episode, Error, Result};

use super::open_loop::OpenLoop;
use crate::data::Logs;
use crate::machine::Machine;
use crate::study::Study;

/// Third difference, relative to the largest of the readings, up to which four readings lie on a
/// parabola.
///
/// It is the rounding of sums of doubles.
const ROUNDING: f64 = 1e-14;
/// Fewest readings of a column that are tested for a parabola, unless they are all equal.
const FEWEST: usize = 8;
/// Largest motion of the model, relative to a sensor's readings, that counts as none.
///
/// For readings near 0 it is in the sensor's unit. Larger: more sensors count that stand still in
/// model and log.
const STILL: f64 = 1e-9;

/// A sensor whose readings never change.
#[derive(Clone, Debug, PartialEq)]
pub struct Unchanging {
    /// Name.
    pub sensor: String,
    /// SI unit.
    pub unit: String,
    /// The one value that it reads; `None` if it counts evenly, or reads another value in each log.
    pub value: Option<f64>,
    /// How much farther the model moves the reading over a log than the log does.
    pub moved: f64,
}

impl Unchanging {
    /// Describes the sensor in one line.
    #[must_use]
    pub fn line(&self) -> String {
        let Self { sensor, unit, .. } = self;
        let unit = if unit.is_empty() {
            String::new()
        } else {
            format!(" {unit}")
        };
        let reads = match self.value {
            Some(value) => format!("always reads {value}{unit}"),
            None => "reads nothing but a value that stays or counts evenly".to_owned(),
        };
        format!(
            "`{sensor}` {reads}, where the model moves by {:.3}{unit}: it is passed over; look whether the sensor is dead or its column \
             another one, or give what it resolves as its noise, `[noise] {sensor} = …`",
            self.moved
        )
    }
}

/// Removes the readings of sensors that never change from a study's logs, if the model as given
/// moves them.
///
/// Returns these sensors.
///
/// # Errors
/// When the engine fails, or no other sensor is read.
pub fn pass_over(study: &mut Study, machine: &Machine) -> Result<Vec<Unchanging>> {
    let sensors = machine.plant.layout.sensors.iter().map(|s| &*s.name);
    let flat: Vec<String> = sensors
        .filter(|s| !study.noise.contains_key(*s) && is_flat(study, s))
        .map(str::to_owned)
        .collect();
    if flat.is_empty() {
        return Ok(Vec::new());
    }
    let replayed = OpenLoop::of(study, machine)?;
    let found: Vec<Unchanging> = flat
        .iter()
        .filter_map(|sensor| unchanging(study, &replayed, sensor))
        .collect();
    if found.len() == replayed.logs().sensors.len() && !found.is_empty() {
        return Err(Error::Failed(format!(
            "study {}: no sensor is left: {}",
            study.name,
            found[0].line()
        )));
    }
    for (_, episode) in study.train.iter_mut().chain(&mut study.test) {
        found.iter().for_each(|f| empty(episode, &f.sensor));
    }
    Ok(found)
}

/// Finite readings of each entry of a sensor in an episode.
fn entries(episode: &Episode, sensor: &str) -> Vec<Vec<f64>> {
    let columns = episode.channel(sensor).unwrap_or_default();
    let width = episode.width();
    let column = |c: usize| {
        let all = episode.readings.iter().skip(c).step_by(width);
        all.copied().filter(|x| x.is_finite()).collect()
    };
    columns.map(column).collect()
}

/// Whether a sensor has readings to fit to, without any third difference in any of these logs.
fn is_flat(study: &Study, sensor: &str) -> bool {
    let logs = study.train.iter();
    let all: Vec<Vec<f64>> = logs.flat_map(|(_, e)| entries(e, sensor)).collect();
    all.iter().any(|column| column.len() > 1) && all.iter().all(|column| lies_on_a_parabola(column))
}

/// Whether all readings are equal, or every four in a row lie on a parabola.
fn lies_on_a_parabola(column: &[f64]) -> bool {
    if column.windows(2).all(|w| w[0] == w[1]) {
        return true;
    }
    let largest = column.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let third = |w: &[f64]| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs();
    column.len() >= FEWEST && column.windows(4).all(|w| third(w) <= ROUNDING * largest)
}

/// Describes a flat sensor; `None` if the model does not move it.
fn unchanging(study: &Study, replayed: &OpenLoop, sensor: &str) -> Option<Unchanging> {
    let logs = replayed.logs();
    let place = logs.sensors.iter().position(|s| s.name == sensor)?;
    let moved = moved(logs, replayed.residuals(), place);
    let all: Vec<f64> = (study.train.iter())
        .flat_map(|(_, e)| entries(e, sensor))
        .flatten()
        .collect();
    let largest = all.iter().fold(1.0, |most: f64, x| most.max(x.abs()));
    let first = all.first().copied();
    let value = first.filter(|first| all.iter().all(|x| x == first));
    (moved > STILL * largest).then(|| Unchanging {
        sensor: sensor.to_owned(),
        unit: logs.sensors[place].unit.clone(),
        value,
        moved,
    })
}

/// Widest range of the residuals of one of the sensor's entries in a log; of the finite ones if
/// replays diverge.
fn moved(logs: &Logs, residuals: &[Vec<f64>], sensor: usize) -> f64 {
    let n = logs.entries.len();
    let own = |j: &usize| logs.entries[*j].sensor == sensor;
    let mut widest: f64 = 0.0;
    for residual in residuals {
        for j in (0..n).filter(own) {
            let left = residual.iter().skip(j).step_by(n);
            let left = left.copied().filter(|x| x.is_finite());
            let [low, high] = left.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
                [low.min(x), high.max(x)]
            });
            widest = widest.max(high - low);
        }
    }
    widest
}

/// Removes the readings of a sensor from an episode.
fn empty(episode: &mut Episode, sensor: &str) {
    let (columns, width) = (episode.channel(sensor).unwrap_or_default(), episode.width());
    for row in episode.readings.chunks_exact_mut(width.max(1)) {
        if let Some(cells) = row.get_mut(columns.clone()) {
            cells.fill(f64::NAN);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_and_an_even_count_are_flat_and_a_motion_is_not() {
        let of = |f: &dyn Fn(f64) -> f64| (0..40).map(|k| f(f64::from(k))).collect::<Vec<f64>>();
        assert!(lies_on_a_parabola(&of(&|_| 0.292)));
        assert!(lies_on_a_parabola(&of(&|k| 3.0 * k)));
        assert!(!lies_on_a_parabola(&of(&|k| (0.1 * k).sin())));
        assert!(!lies_on_a_parabola(&of(&|k| f64::from(k > 30.0))));
        // Three readings always lie on a parabola.
        assert!(!lies_on_a_parabola(&[0.0, 1.0, 5.0]));
    }
}
