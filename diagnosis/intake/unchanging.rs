//! Sensors whose readings never change while the model's move: an encoder that is unplugged, a field that nobody fills.
//!
//! Readings without any third difference have no noise that could be told, and in units of none every gap is infinite. Where the model
//! reads the same, that is no matter. Where it does not, such a sensor is passed over and named: what is wrong with it is not physics.
//! A study that gives its noise has it counted.

use asid_core::{Episode, Error, Result};

use super::open_loop::OpenLoop;
use crate::data::Logs;
use crate::machine::Machine;
use crate::study::Study;

/// Third difference up to which four readings lie on a parabola, relative to the largest of them: what sums of doubles round.
const ROUNDING: f64 = 1e-14;
/// Readings of a column at least of which it is said that they lie on a parabola, where they are not all alike.
const FEWEST: usize = 8;
/// How far the model leaves what a sensor reads where that counts as no motion, relative to the readings, and of readings near 0 in the
/// sensor's unit. Larger: more of what stands still in model and log is counted.
const STILL: f64 = 1e-9;

/// A sensor whose readings never change.
#[derive(Clone, Debug, PartialEq)]
pub struct Unchanging {
    /// Name.
    pub sensor: String,
    /// SI unit.
    pub unit: String,
    /// The one value that it reads; `None` where it counts evenly, or reads another in each log.
    pub value: Option<f64>,
    /// How much further the model moves it over a log than the readings do.
    pub moved: f64,
}

impl Unchanging {
    /// What is told of it, in one line.
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

/// Takes the readings of sensors that never change out of a study's logs, where the model as given moves them; what they are.
///
/// # Errors
/// When the engine fails, or nothing else is read.
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

/// Readings of each entry of a sensor in an episode, of those that are there.
fn entries(episode: &Episode, sensor: &str) -> Vec<Vec<f64>> {
    let columns = episode.channel(sensor).unwrap_or_default();
    let width = episode.width();
    let column = |c: usize| {
        let all = episode.readings.iter().skip(c).step_by(width);
        all.copied().filter(|x| x.is_finite()).collect()
    };
    columns.map(column).collect()
}

/// Whether a sensor has readings to fit to, and in none of these logs a third difference.
fn is_flat(study: &Study, sensor: &str) -> bool {
    let logs = study.train.iter();
    let all: Vec<Vec<f64>> = logs.flat_map(|(_, e)| entries(e, sensor)).collect();
    all.iter().any(|column| column.len() > 1) && all.iter().all(|column| lies_on_a_parabola(column))
}

/// Whether readings are all alike, or every four in a row of them lie on a parabola.
fn lies_on_a_parabola(column: &[f64]) -> bool {
    if column.windows(2).all(|w| w[0] == w[1]) {
        return true;
    }
    let largest = column.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let third = |w: &[f64]| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs();
    column.len() >= FEWEST && column.windows(4).all(|w| third(w) <= ROUNDING * largest)
}

/// A flat sensor, where the model moves it otherwise.
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

/// The widest range of what replays leave of a sensor's entry in a log; where they diverge, of what is finite.
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

/// Takes the readings of a sensor out of an episode.
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
        // Three readings lie on a parabola whatever they are.
        assert!(!lies_on_a_parabola(&[0.0, 1.0, 5.0]));
    }
}
