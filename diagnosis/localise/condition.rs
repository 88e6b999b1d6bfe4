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
/// Digits of a threshold: it is exact to a thousandth of the range of its quantity, which is less
/// than a plot shows.
const DIGITS: f64 = 3.0;
/// Most decimals of a threshold: a double has no more digits.
const MOST_DECIMALS: f64 = 17.0;

/// Returns the squared growth of an entry's residual over the [`WINDOW`] rows that end at each row,
/// beyond that of noise alone.
///
/// It is NaN where a reading is missing. If the reading at the beginning of these rows is missing,
/// the nearest row with a reading takes its place. There is one value per row from [`WINDOW`] on,
/// episode by episode. `present` tells which residuals have a reading.
pub(super) fn growth(
    logs: &Logs,
    (residuals, present): (&[f64], &[bool]),
    entry: usize,
) -> Vec<f64> {
    let n = logs.entries.len();
    let mut growth = Vec::new();
    for (e, log) in logs.episodes.iter().enumerate() {
        let rows = log.plan.rows();
        let first = logs.offset(e) + entry;
        let place = |k: usize| first + k * n;
        let there: Vec<usize> = (0..rows).filter(|&k| present[place(k)]).collect();
        let before = |k: usize| {
            let aim = k - WINDOW;
            let next = there.partition_point(|&row| row < aim);
            let beside = &there[next.saturating_sub(1)..(next + 1).min(there.len())];
            let earlier = beside.iter().filter(|&&row| row < k);
            earlier.min_by_key(|row| row.abs_diff(aim)).copied()
        };
        growth.extend((WINDOW..rows).map(|k| {
            let from = before(k).filter(|_| present[place(k)]);
            let d = from.map_or(f64::NAN, |row| residuals[place(k)] - residuals[place(row)]);
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
    /// The rows are those that fulfil the text. Returns `None` if there is none, or if the residual
    /// grows by no more than noise.
    pub(super) fn condition(&self, growth: &[f64]) -> Option<String> {
        let known = growth.iter().filter(|g| g.is_finite());
        let total: f64 = known.clone().sum();
        if total <= known.count() as f64 {
            return None;
        }
        let mut best: Option<(f64, String)> = None;
        for ((name, values), order) in self.names.iter().zip(&self.values).zip(&self.order) {
            let order: Vec<usize> = (order.iter().copied())
                .filter(|&i| growth[i].is_finite())
                .collect();
            let sorted: Vec<f64> = order.iter().map(|&i| values[i]).collect();
            // The growth in the first rows of this order.
            let mut sums = vec![0.0];
            for &i in &order {
                sums.push(sums[sums.len() - 1] + growth[i]);
            }
            let all = order.len();
            let (decimals, thresholds) = thresholds(&sorted);
            for threshold in thresholds {
                let below = sorted.partition_point(|x| *x < threshold);
                let up_to = sorted.partition_point(|x| *x <= threshold);
                let above = sums[all] - sums[up_to];
                for (growth, rows, sign) in [(sums[below], below, '<'), (above, all - up_to, '>')] {
                    let (share, rows) = (growth / total, rows as f64 / all as f64);
                    let merit = share - rows;
                    let is_better = best.as_ref().is_none_or(|(b, _)| merit > *b);
                    if rows < FEW && rows > FEWEST && share > MOST && is_better {
                        best = Some((merit, format!("{name} {sign} {threshold:.decimals$}")));
                    }
                }
            }
        }
        best.map(|(_, text)| text)
    }
}

/// Thresholds between values that are sorted, and the decimals that they are rounded to.
///
/// Equal values are on one side of any threshold, so a quantity that is constant has none.
fn thresholds(sorted: &[f64]) -> (usize, Vec<f64>) {
    let (Some(first), Some(last)) = (sorted.first(), sorted.last()) else {
        return (0, Vec::new());
    };
    let decimals = (DIGITS - (last - first).log10()).ceil();
    let decimals = decimals.clamp(0.0, MOST_DECIMALS) as usize;
    let scale = 10_f64.powi(decimals as i32);
    let between = sorted.windows(2).filter(|w| w[0] < w[1]);
    // Adding 0 turns -0 into 0.
    let rounded = between.map(|w| (0.5 * (w[0] + w[1]) * scale).round() / scale + 0.0);
    let mut rounded: Vec<f64> = rounded.collect();
    rounded.dedup();
    (decimals, rounded)
}

fn sorted(values: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len())
        .filter(|&i| values[i].is_finite())
        .collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::tests::{log, plant};

    /// Symptom: a residual seemed to grow where readings are missing and where they begin again.
    /// Cause: the residual of a missing reading, 0, was used as that of a reading.
    #[test]
    fn a_residual_grows_from_one_reading_to_another() {
        let episode = log("a", &[0.0; 12]);
        let logs = Logs::new(&plant(), &["place".to_owned()], vec![episode]).unwrap();
        // The residual is the number of the row, and rows 5 and 6 have no reading.
        let present: Vec<bool> = (0..12).map(|k| k != 5 && k != 6).collect();
        let residual = |k: usize| if present[k] { k as f64 } else { 0.0 };
        let residuals: Vec<f64> = (0..12).map(residual).collect();
        let found = growth(&logs, (&residuals, &present), 0);
        let found: Vec<Option<f64>> = (found.into_iter())
            .map(|g| g.is_finite().then_some(g))
            .collect();
        // Over five rows, but over six from row 4 to row 10, and over four from row 7 to row 11.
        let over = |rows: f64| Some(rows * rows - 2.0);
        let [four, five, six] = [4.0, 5.0, 6.0].map(over);
        assert_eq!(found, [None, None, five, five, five, six, four]);
    }

    fn features(columns: &[(&str, Vec<f64>)]) -> Features {
        let values: Vec<Vec<f64>> = columns.iter().map(|c| c.1.clone()).collect();
        Features {
            names: columns.iter().map(|c| c.0.to_owned()).collect(),
            order: values.iter().map(|v| sorted(v)).collect(),
            values,
        }
    }

    /// Share of the growth in the rows that fulfil a condition, as its text reads.
    fn share(features: &Features, growth: &[f64], condition: &str) -> f64 {
        let words: Vec<&str> = condition.split(' ').collect();
        let threshold: f64 = words[2].parse().unwrap();
        let column = features.names.iter().position(|n| n == words[0]).unwrap();
        let is_in = |x: f64| match words[1] {
            "<" => x < threshold,
            _ => x > threshold,
        };
        let rows = features.values[column].iter().zip(growth);
        let within: f64 = rows.filter(|(x, _)| is_in(**x)).map(|(_, g)| g).sum();
        within / growth.iter().sum::<f64>()
    }

    /// Symptom: "where ctrl.u > 1.000", for a command that is never above 1.
    ///
    /// Cause: a threshold split rows with equal commands, which are in the order of their times.
    #[test]
    fn a_condition_holds_for_the_rows_in_which_the_residual_grows() {
        let time = || (0..400).map(|k| 0.01 * f64::from(k));
        // The same command in each of some logs, and growth between two times, not in all of them.
        for (logs, grown, [on, off], [from, to], expected) in [
            // A constant command.
            (1, 1, [-1.0, 9.0], [2.5, 9.0], "time > 2.505"),
            // A step.
            (1, 1, [1.0, 3.5], [2.0, 3.5], "time > 2.005"),
            (4, 3, [1.0, 3.0], [2.0, 3.0], "ctrl.u > 0.500"),
        ] {
            let (mut times, mut commands, mut growth) = (Vec::new(), Vec::new(), Vec::new());
            for log in 0..logs {
                for t in time() {
                    times.push(t);
                    commands.push(f64::from(u8::from(t > on && t < off)));
                    let grows = log < grown && t > from && t < to;
                    growth.push(50.0 * f64::from(u8::from(grows)));
                }
            }
            let features = features(&[("ctrl.u", commands), ("time", times)]);
            let found = features.condition(&growth).unwrap();
            assert_eq!(found, expected);
            assert!(share(&features, &growth, &found) > MOST);
        }
    }

    /// Symptom: "where place > 0.000" for a stage that moves by half a millimetre.
    #[test]
    fn a_threshold_has_the_digits_of_its_range() {
        let place = (0..400).map(|k| 1.25e-6 * f64::from(k)).collect();
        let growth: Vec<f64> = (0..400).map(|k| if k > 300 { 50.0 } else { 0.0 }).collect();
        let features = features(&[("place", place)]);
        let found = features.condition(&growth).unwrap();
        assert_eq!(found, "place > 0.0003756");
        assert!(share(&features, &growth, &found) > MOST);
    }
}
