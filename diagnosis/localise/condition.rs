//! The condition under which a residual grows: a threshold on a reading, a command or the time.

use crate::data::Logs;

/// Number of rows over which the growth of a residual is taken.
const WINDOW: usize = 5;
/// Largest share of the rows for which a condition may hold.
const FEW: f64 = 0.6;
/// Smallest share of the rows for which a condition may hold: with fewer rows a threshold is
/// chance.
const FEWEST: f64 = 0.02;
/// Smallest share of the growth that must fall within a condition.
const MOST: f64 = 0.8;

/// Returns the squared growth of an entry's residual over the [`WINDOW`] rows that end at each row,
/// beyond that of noise alone.
///
/// It is NaN where a reading is missing. There is one value per row from [`WINDOW`] on, episode by
/// episode.
pub(super) fn growth(logs: &Logs, residuals: &[f64], entry: usize) -> Vec<f64> {
    let n = logs.entries.len();
    let mut growth = Vec::new();
    for (e, log) in logs.episodes.iter().enumerate() {
        let at = |k: usize| residuals[logs.offset(e) + k * n + entry];
        growth.extend((WINDOW..log.plan.rows()).map(|k| {
            let d = at(k) - at(k - WINDOW);
            // The noise of a difference has a variance of two.
            if d.is_finite() {
                (d * d - 2.0).max(0.0)
            } else {
                f64::NAN
            }
        }));
    }
    growth
}

/// Quantities of a condition: readings of plain sensors, commands, and the time since the start of
/// an episode.
///
/// Each is taken in the middle of the rows of a [`growth`].
pub(super) struct Features {
    names: Vec<String>,
    /// One list per name, with one value per growth.
    values: Vec<Vec<f64>>,
    /// Indices of the finite values, smallest value first.
    order: Vec<Vec<usize>>,
}

impl Features {
    pub(super) fn of(logs: &Logs) -> Self {
        let mut names: Vec<String> = Vec::new();
        // Columns of the readings of plain sensors in a row.
        let mut columns = Vec::new();
        let mut column = 0;
        for (i, sensor) in logs.sensors.iter().enumerate() {
            if sensor.rotation {
                column += 4;
                continue;
            }
            for entry in logs.entries.iter().filter(|e| e.sensor == i) {
                names.push(entry.label.clone());
                columns.push(column);
                column += 1;
            }
        }
        let actuators = (logs.episodes.first()).map_or(&[][..], |e| &e.episode.actuators[..]);
        names.extend(actuators.iter().map(|a| format!("ctrl.{a}")));
        names.push("time".into());
        let width = logs.width();
        let mut values: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
        for log in &logs.episodes {
            for row in WINDOW..log.plan.rows() {
                let row = row - WINDOW / 2;
                let readings = columns.iter().map(|c| log.readings[row * width + c]);
                let commands = &log.episode.ctrl[row * actuators.len()..][..actuators.len()];
                let time = log.episode.time[row] - log.episode.time[0];
                let all = readings.chain(commands.iter().copied()).chain([time]);
                for (list, value) in values.iter_mut().zip(all) {
                    list.push(value);
                }
            }
        }
        let order = values.iter().map(|v| sorted(v)).collect();
        Self {
            names,
            values,
            order,
        }
    }

    /// Returns the threshold beyond which [`MOST`] of the growth lies in the fewest rows.
    ///
    /// Returns `None` if there is none, or if the residual grows by no more than noise.
    pub(super) fn condition(&self, growth: &[f64]) -> Option<String> {
        let known = growth.iter().filter(|g| g.is_finite());
        let total: f64 = known.clone().sum();
        if total <= known.count() as f64 {
            return None;
        }
        let mut best: Option<(f64, String)> = None;
        for ((name, values), order) in self.names.iter().zip(&self.values).zip(&self.order) {
            let order = order.iter().filter(|&&i| growth[i].is_finite());
            let m = order.clone().count();
            let mut below = 0.0;
            for (k, &i) in order.enumerate() {
                below += growth[i];
                let rows = (k + 1) as f64 / m as f64;
                let share = below / total;
                for (share, rows, sign) in [(share, rows, '<'), (1.0 - share, 1.0 - rows, '>')] {
                    if rows < FEW && rows > FEWEST && share > MOST {
                        let merit = share - rows;
                        if best.as_ref().is_none_or(|(b, _)| merit > *b) {
                            best = Some((merit, format!("{name} {sign} {:.3}", values[i])));
                        }
                    }
                }
            }
        }
        best.map(|(_, text)| text)
    }
}

fn sorted(values: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len())
        .filter(|&i| values[i].is_finite())
        .collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    order
}
