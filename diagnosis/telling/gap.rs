//! The gap on the held-out logs, in units of the noise, and how much of it is closed, with its
//! interval.

use asid_core::Streams;

use super::{HeldOut, Telling};
use crate::result::{Gap, SignalGap};

/// Number of bootstrap samples.
const RESAMPLES: usize = 2000;
/// Gap of the identified model up to which there is nothing to close.
pub(super) const NO_GAP: f64 = 1.05;

impl Telling<'_> {
    /// Returns the sum of squared residuals that have a reading, of all or of one sensor or
    /// episode, and their number.
    ///
    /// Where a simulation diverged, each square is capped.
    pub(super) fn rms(
        &self,
        residuals: &[f64],
        sensor: Option<usize>,
        episode: Option<usize>,
    ) -> (f64, f64) {
        let logs = &self.bench.test.logs;
        let n = logs.entries.len();
        let present = logs.present();
        let (mut square, mut count) = (0.0, 0.0);
        for e in 0..logs.episodes.len() {
            if episode.is_some_and(|x| x != e) {
                continue;
            }
            let head = if self.bench.open.is_empty() {
                0
            } else {
                self.bench.head.logs.episodes[e].plan.rows() * n
            };
            for k in logs.offset(e) + head..logs.offset(e + 1) {
                if present[k] && sensor.is_none_or(|s| logs.entries[k % n].sensor == s) {
                    let r = residuals[k];
                    square += if r.is_finite() { r * r } else { 1e12 };
                    count += 1.0;
                }
            }
        }
        (square, count)
    }

    /// Returns the gap of three models: as given, with the study's parameters fitted, and with the
    /// verdict's effects.
    pub(super) fn gap(&self, nominal: &HeldOut, identified: &HeldOut, refined: &HeldOut) -> Gap {
        let logs = &self.bench.test.logs;
        let root = |(square, count): (f64, f64)| (square / f64::max(count, 1.0)).sqrt();
        let of = |h: &HeldOut, sensor| root(self.rms(&h.residuals, sensor, None));
        let (i, r) = (of(identified, None), of(refined, None));
        let closed = |i2: f64, r2: f64| (1.0 - (r2 - 1.0) / (i2 - 1.0)).min(1.0);
        let has_gap = i > NO_GAP;
        let interval = has_gap.then(|| {
            let episodes: Vec<_> = (0..logs.episodes.len())
                .map(|e| {
                    let part = |h: &HeldOut| self.rms(&h.residuals, None, Some(e));
                    (part(identified), part(refined))
                })
                .collect();
            let mut rng = Streams::new(self.settings.breadth.seed).stream("bootstrap");
            let mut all: Vec<f64> = (0..RESAMPLES)
                .map(|_| {
                    let (mut a, mut b, mut n) = (0.0, 0.0, 0.0);
                    for _ in 0..episodes.len() {
                        use rand::Rng as _;
                        let ((x, count), (y, _)) = episodes[rng.random_range(0..episodes.len())];
                        a += x;
                        b += y;
                        n += count;
                    }
                    let (a, b) = (a / f64::max(n, 1.0), b / f64::max(n, 1.0));
                    if a > 1.0 { closed(a, b) } else { 0.0 }
                })
                .collect();
            all.sort_by(f64::total_cmp);
            let pick = |q: f64| all[(q * (RESAMPLES - 1) as f64).round() as usize];
            [pick(0.025), pick(0.975)]
        });
        Gap {
            noise_floor: 1.0,
            nominal: of(nominal, None),
            identified: i,
            refined: r,
            closed: has_gap.then(|| closed(i * i, r * r)),
            closed_interval95: interval,
            shares: None,
            p_value: None,
            signals: logs
                .sensors
                .iter()
                .enumerate()
                .map(|(s, sensor)| SignalGap {
                    signal: sensor.name.clone(),
                    noise: sensor.noise,
                    unit: sensor.unit.clone(),
                    nominal: of(nominal, Some(s)),
                    identified: of(identified, Some(s)),
                    refined: of(refined, Some(s)),
                })
                .collect(),
        }
    }
}
