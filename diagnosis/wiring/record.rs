//! The logs as time series: each column has its own reading times, so that gaps and its own rate do
//! not matter.

use asid_core::episode::InitialState;
use asid_core::layout::Layout;
use asid_core::{Episode, Result};
use nalgebra::{Matrix3, Vector3};

use super::view::{ColumnView, View};

/// Fewest readings of a local fit: one more than a parabola has coefficients.
const FEWEST: usize = 4;

/// Time within which a reading belongs to a row, s: it covers rounding.
const ON_ROW: f64 = 1e-9;

/// The readings of one column of a log.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Times from the first row on, s.
    pub time: Vec<f64>,
    /// Readings.
    pub value: Vec<f64>,
}

impl Series {
    /// Reading at a time, interpolated linearly; NaN if the neighbours are farther apart than
    /// `widest` (s).
    #[must_use]
    pub fn at(&self, time: f64, widest: f64) -> f64 {
        let after = self.time.partition_point(|t| *t < time - ON_ROW);
        match self.time.get(after) {
            Some(t) if *t <= time + ON_ROW => return self.value[after],
            None => return f64::NAN,
            Some(_) if after == 0 => return f64::NAN,
            Some(_) => {}
        }
        let (a, b) = (self.time[after - 1], self.time[after]);
        if b - a > widest {
            return f64::NAN;
        }
        let (x, y) = (self.value[after - 1], self.value[after]);
        x + (time - a) / (b - a) * (y - x)
    }

    /// Value and derivative at a time, from a parabola.
    ///
    /// The parabola fits the readings within `half` (s) of the time, or the nearest few.
    #[must_use]
    pub fn local(&self, time: f64, half: f64) -> Option<(f64, f64)> {
        let mut first = self.time.partition_point(|t| *t < time - half);
        let mut last = self.time.partition_point(|t| *t <= time + half);
        while last - first < FEWEST {
            let left = first.checked_sub(1).map(|i| time - self.time[i]);
            let right = self.time.get(last).map(|t| t - time);
            match (left, right) {
                (Some(l), Some(r)) if l <= r => first -= 1,
                (Some(_), None) => first -= 1,
                (_, Some(_)) => last += 1,
                (None, None) => return None,
            }
        }
        let scale = (first..last)
            .map(|i| (self.time[i] - time).abs())
            .fold(0.0, f64::max);
        let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for i in first..last {
            let s = (self.time[i] - time) / scale;
            let row = Vector3::new(1.0, s, s * s);
            matrix += row * row.transpose();
            right += row * self.value[i];
        }
        let fit = matrix.cholesky()?.solve(&right);
        Some((fit[0], fit[1] / scale))
    }

    /// Joins the readings of several series into one without times.
    pub fn joined<'s>(all: impl Iterator<Item = &'s Self>) -> Self {
        let value = all.flat_map(|s| s.value.iter().copied()).collect();
        Self {
            time: Vec::new(),
            value,
        }
    }

    /// Standard deviation of the readings.
    #[must_use]
    pub fn spread(&self) -> f64 {
        let n = self.value.len().max(1) as f64;
        let mean = self.value.iter().sum::<f64>() / n;
        (self.value.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt()
    }
}

/// Gives each quaternion the sign closer to the one before: between `q` and `-q` lies no
/// orientation.
///
/// A quaternion is four entries of a row from `first` on.
pub(crate) fn align_signs(table: &mut [f64], width: usize, first: usize) {
    let mut before: Option<[f64; 4]> = None;
    for row in table.chunks_exact_mut(width) {
        let q = &mut row[first..first + 4];
        if !q.iter().all(|x| x.is_finite()) {
            continue;
        }
        if before.is_some_and(|b| b.iter().zip(&*q).map(|(a, b)| a * b).sum::<f64>() < 0.0) {
            q.iter_mut().for_each(|x| *x = -*x);
        }
        before = Some([q[0], q[1], q[2], q[3]]);
    }
}

/// One episode as time series.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// One series for each entry of a row of readings.
    pub readings: Vec<Series>,
    /// Times of the rows from the first on, s.
    pub time: Vec<f64>,
    /// Commands, `rows x nu`.
    ctrl: Vec<f64>,
    /// Integrals of the commands up to each row, `rows x nu`.
    integral: Vec<f64>,
    nu: usize,
    /// State at the first row, if the log has all of it.
    pub start: Option<InitialState>,
}

impl Recorded {
    /// Creates the series of an episode, with the columns of some sensors.
    ///
    /// # Errors
    /// When the layout has no such sensor.
    pub fn of(layout: &Layout, sensors: &[String], episode: &Episode) -> Result<Self> {
        let first = episode.time[0];
        let time: Vec<f64> = episode.time.iter().map(|t| t - first).collect();
        let table = episode.select(layout, sensors);
        let width = table.len() / time.len();
        let mut readings: Vec<Series> = vec![Series::default(); width];
        let mut table = table;
        let mut first_entry = 0;
        for name in sensors {
            let len = layout.sensor(name)?.len;
            if len == 4 {
                align_signs(&mut table, width, first_entry);
            }
            first_entry += len;
        }
        for (row, &t) in table.chunks_exact(width).zip(&time) {
            for (series, &x) in readings.iter_mut().zip(row) {
                if x.is_finite() {
                    series.time.push(t);
                    series.value.push(x);
                }
            }
        }
        let nu = episode.actuators.len();
        let mut integral = vec![0.0; time.len() * nu];
        for k in 1..time.len() {
            let dt = time[k] - time[k - 1];
            for a in 0..nu {
                integral[k * nu + a] =
                    integral[(k - 1) * nu + a] + dt * episode.ctrl[(k - 1) * nu + a];
            }
        }
        Ok(Self {
            readings,
            time,
            ctrl: episode.ctrl.clone(),
            integral,
            nu,
            start: episode.initial.clone().filter(InitialState::is_complete),
        })
    }

    /// Duration, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.time.last().copied().unwrap_or(0.0)
    }

    /// Reading of a quantity at a time under a view; NaN if nothing was read near it.
    #[must_use]
    pub fn reading(&self, view: ColumnView, time: f64, widest: f64) -> f64 {
        let x = self.readings[view.from].at(time + view.delay, widest);
        view.factor * x + view.offset
    }

    /// Value and derivative of a quantity at a time under a view.
    #[must_use]
    pub fn local(&self, view: ColumnView, time: f64, half: f64) -> Option<(f64, f64)> {
        let (value, slope) = self.readings[view.from].local(time + view.delay, half)?;
        Some((view.factor * value + view.offset, view.factor * slope))
    }

    /// Integral of an actuator's command up to a time; before the first row the first command
    /// holds.
    fn integral(&self, actuator: usize, time: f64) -> f64 {
        let k = self.time.partition_point(|t| *t <= time);
        let k = k.saturating_sub(1);
        self.integral[k * self.nu + actuator]
            + self.ctrl[k * self.nu + actuator] * (time - self.time[k])
    }

    /// Mean commands between two times under a view, one an actuator.
    #[must_use]
    pub fn commands(&self, view: &View, from: f64, to: f64) -> Vec<f64> {
        let mean = |v: &ColumnView| {
            let (a, b) = (from - v.delay, to - v.delay);
            let mean = (self.integral(v.from, b) - self.integral(v.from, a)) / (to - from);
            v.factor * mean + v.offset
        };
        view.commands.iter().map(mean).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_has_its_own_value_and_slope() {
        let time: Vec<f64> = (0..40).map(|k| 0.01 * f64::from(k)).collect();
        let value = time.iter().map(|t| 1.0 + 2.0 * t - 3.0 * t * t).collect();
        let series = Series { time, value };
        for at in [0.0, 0.1234, 0.39] {
            let (x, v) = series.local(at, 0.05).unwrap();
            assert!((x - (1.0 + 2.0 * at - 3.0 * at * at)).abs() < 1e-9);
            assert!((v - (2.0 - 6.0 * at)).abs() < 1e-7);
        }
        assert!(Series::default().local(0.0, 1.0).is_none());
    }

    #[test]
    fn a_reading_between_rows_far_apart_is_missing() {
        let series = Series {
            time: vec![0.0, 0.1, 0.5],
            value: vec![0.0, 1.0, 5.0],
        };
        assert!((series.at(0.05, 0.2) - 0.5).abs() < 1e-12);
        assert!(series.at(0.3, 0.2).is_nan() && series.at(0.6, 9.0).is_nan());
        assert_eq!(series.at(0.5, 0.2), 5.0);
    }
}
