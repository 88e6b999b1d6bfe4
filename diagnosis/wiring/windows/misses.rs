//! Misses of the predictions: residuals of the windows, and their means in units of the motion.

use super::placement::Window;
use super::{LOCAL, Windows};
use crate::wiring::view::View;

/// Largest counted miss, in motions: beyond it, a prediction is simply wrong.
const FARTHEST: f64 = 10.0;

/// Misses of the predictions under a view.
#[derive(Clone, Debug)]
pub struct Misses {
    /// `reading - prediction`, `windows x frames x width`; NaN without a reading, infinite if the
    /// engine failed.
    pub residual: Vec<f64>,
    /// Mean distance of each quantity from its straight line, over windows from states read off the
    /// log.
    pub motion: Vec<f64>,
    /// Mean magnitude of each quantity's residual over those windows, in motions.
    pub miss: Vec<f64>,
    /// The same over windows at given initial states; 0 if there are none.
    pub start_miss: Vec<f64>,
}

impl Windows<'_> {
    /// Returns `reading - prediction` in the windows from index `first` on.
    pub(super) fn residuals(&self, view: &View, told: &[f64], first: usize) -> Vec<f64> {
        let (rows, width) = (self.frames + 1, self.width);
        let frame = self.duration / self.frames as f64;
        let mut residual = vec![f64::NAN; told.len()];
        for (i, window) in self.windows[first..].iter().enumerate() {
            let record = &self.record[window.episode];
            for k in 0..rows {
                let time = window.start + k as f64 * frame;
                let row = (i * rows + k) * width;
                let Some(told) = told.get(row..row + width) else {
                    continue;
                };
                let mut read: Vec<f64> = view
                    .readings
                    .iter()
                    .map(|v| record.reading(*v, time, 0.5 * self.duration))
                    .collect();
                self.nearer_signs(&mut read, told);
                let out = &mut residual[row..row + width];
                for ((miss, read), told) in out.iter_mut().zip(read).zip(told) {
                    if read.is_finite() {
                        *miss = if told.is_finite() {
                            read - told
                        } else {
                            f64::INFINITY
                        };
                    }
                }
            }
        }
        residual
    }

    /// Chooses the sign of each quaternion closer to the prediction: both signs are one
    /// orientation.
    fn nearer_signs(&self, read: &mut [f64], told: &[f64]) {
        for &(index, at) in &self.sensors {
            if self.plant.layout.sensors[index].len != 4 {
                continue;
            }
            let (read, told) = (&mut read[at..at + 4], &told[at..at + 4]);
            if read.iter().zip(told).map(|(a, b)| a * b).sum::<f64>() < 0.0 {
                read.iter_mut().for_each(|x| *x = -*x);
            }
        }
    }

    /// Computes the motion and the mean misses of all windows.
    pub(super) fn summed_up(&self, view: &View, residual: Vec<f64>) -> Misses {
        let (rows, width) = (self.frames + 1, self.width);
        let frame = self.duration / self.frames as f64;
        let half = LOCAL * self.duration;
        let mut motion = vec![0.0; width];
        for (entry, motion) in motion.iter_mut().enumerate() {
            let view = view.readings[entry];
            let straight = self.is_place(entry);
            let mut moved = Vec::new();
            for window in self.windows.iter().filter(|w| !w.given) {
                let record = &self.record[window.episode];
                let Some((value, slope)) = record.local(view, window.start, half) else {
                    continue;
                };
                let slope = if straight { slope } else { 0.0 };
                let away = (1..rows).map(|k| {
                    let s = k as f64 * frame;
                    record.reading(view, window.start + s, 0.5 * self.duration) - value - slope * s
                });
                moved.extend(rms(away.filter(|x| x.is_finite())));
            }
            *motion = mean(&moved).unwrap_or(0.0).max(f64::MIN_POSITIVE);
        }
        self.means(residual, motion, |_| true)
    }

    /// Returns the misses of one log's windows, in motions of all logs.
    pub fn of_log(&self, misses: &Misses, log: usize) -> Misses {
        let (residual, motion) = (misses.residual.clone(), misses.motion.clone());
        self.means(residual, motion, |w| w.episode == log)
    }

    /// Returns the misses of the windows in the later or the earlier half of their log; others are
    /// NaN.
    pub fn of_half(&self, misses: &Misses, later: bool) -> Misses {
        let mut out = misses.clone();
        let window = (self.frames + 1) * self.width;
        let residuals = out.residual.chunks_exact_mut(window).zip(&self.windows);
        for (own, w) in residuals {
            let is_late = w.start + 0.5 * self.duration > 0.5 * self.record[w.episode].seconds();
            if is_late != later {
                own.fill(f64::NAN);
            }
        }
        out
    }

    /// Mean magnitudes of residuals over some windows, in motions.
    fn means(
        &self,
        residual: Vec<f64>,
        motion: Vec<f64>,
        counts: impl Fn(&Window) -> bool,
    ) -> Misses {
        let (rows, width) = (self.frames + 1, self.width);
        let (mut miss, mut start_miss) = (vec![0.0; width], vec![0.0; width]);
        for entry in 0..width {
            let of_window = |w: usize| -> Option<f64> {
                let own = (0..rows).map(|k| residual[(w * rows + k) * width + entry]);
                rms(own.filter(|r| !r.is_nan()))
            };
            let of = |given: bool| -> f64 {
                let windows = self.windows.iter().enumerate();
                let own = windows.filter(|(_, w)| w.given == given && counts(w));
                let each: Vec<f64> = own
                    .filter_map(|(w, _)| of_window(w))
                    .map(|r| (r / motion[entry]).min(FARTHEST))
                    .collect();
                mean(&each).unwrap_or(0.0)
            };
            miss[entry] = of(false);
            start_miss[entry] = of(true);
        }
        Misses {
            residual,
            motion,
            miss,
            start_miss,
        }
    }

    /// Whether a quantity is a position or an angle, which continues along its derivative; speeds
    /// and forces do not.
    fn is_place(&self, entry: usize) -> bool {
        let sensors = self.sensors.iter().rev();
        let found = sensors.clone().find(|(_, first)| *first <= entry);
        found.is_some_and(|(index, _)| {
            let kind = &*self.plant.layout.sensors[*index].kind;
            kind.ends_with("pos") || kind.ends_with("quat")
        })
    }
}

/// Root mean square; `None` if there are no values.
fn rms(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for x in values {
        sum += x * x;
        count += 1.0;
    }
    (count > 0.0).then(|| (sum / count).sqrt())
}

/// Mean; `None` if there are no values.
pub(super) fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}
