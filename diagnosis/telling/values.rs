//! Fitted values with their intervals.
//!
//! Intervals are those of least squares (Gauss), widened for two reasons: the fit leaves more than
//! the noise, and neighbouring residuals are correlated, so that many readings of one error count
//! once. Where the missing force was estimated, intervals are no narrower than those of the fit
//! that allows for it: the values are as uncertain as what the model lacks makes them there. Nor
//! are they narrower than the disagreement between episodes: what the model lacks often raises a
//! value in one episode and lowers it in another.
//!
//! Two errors that no scatter of residuals shows are added as squares:
//!
//! - A wrong model makes fits that weight the logs differently disagree (Hausman 1978). This error
//!   is the distance of the value from the posterior mean of the fit that allows for a missing
//!   force.
//! - The engine's own error, extrapolated to a time step of zero from the change at half the step
//!   (Richardson 1911).
//!
//! A parameter of the study at an end of its range has at least the standard deviation of a uniform
//! distribution over that range.

use std::collections::BTreeMap;

use asid_core::{Parameter, Result};

use super::Telling;
use crate::bench::Explanation;
use crate::checks::{RICHARDSON, change_by_step};
use crate::data::Logs;
use crate::linearise::NOTHING;
use crate::result::ParameterResult;

/// Standard deviations of a normal distribution to either side of the mean that contain 95 %.
const DEVIATIONS: f64 = 1.959_964;
/// Largest correlation that is used: beyond it a log would count as a single reading.
const MOST_CORRELATED: f64 = 0.98;
/// Share of its range within which a value counts as at the end of it: the precision at which a fit
/// stops.
const AT_END: f64 = 1e-6;

/// Returns the correlation of neighbouring residuals, averaged over entries and episodes with their
/// squares as weights.
///
/// The neighbour of a reading is the one before it of the same entry; between them readings may be
/// missing. `present` tells which residuals have a reading.
fn correlation(logs: &Logs, (residuals, present): (&[f64], &[bool])) -> f64 {
    let n = logs.entries.len();
    let (mut product, mut square) = (0.0, 0.0);
    for e in 0..logs.episodes.len() {
        let mut before: Vec<Option<f64>> = vec![None; n];
        let rows = logs.offset(e)..logs.offset(e + 1);
        for (k, i) in rows.enumerate().filter(|(_, i)| present[*i]) {
            let residual = residuals[i];
            if let Some(earlier) = before[k % n].replace(residual) {
                product += residual * earlier;
                square += residual * residual;
            }
        }
    }
    if square > 0.0 {
        (product / square).clamp(0.0, MOST_CORRELATED)
    } else {
        0.0
    }
}

/// Contributions to the uncertainty of an explanation's values that the scatter of residuals does
/// not show.
struct Beyond<'m> {
    /// Change of each fitted value by the engine's own error, in its unit; empty if unknown.
    moved: &'m [f64],
    /// Variance of each fitted value by the disagreement between episodes.
    by_episodes: Vec<f64>,
}

/// Returns the variance of sums of per-episode contributions, one row of `parts` per episode; 0 for
/// a single episode.
///
/// For contributions that are independent between episodes it is their sample variance times their
/// number (Liang and Zeger 1986, with episodes as clusters).
fn between_episodes(parts: &[Vec<f64>], values: usize) -> Vec<f64> {
    let n = parts.len() as f64;
    let of_value = |k: usize| {
        let mean = parts.iter().map(|p| p[k]).sum::<f64>() / n;
        let squares: f64 = parts.iter().map(|p| (p[k] - mean).powi(2)).sum();
        if n > 1.0 {
            n * squares / (n - 1.0)
        } else {
            0.0
        }
    };
    (0..values).map(of_value).collect()
}

/// Whether a value is at an end of its range, on the parameter's scale.
fn is_at_end(parameter: &Parameter, value: f64) -> bool {
    let share = parameter.to_unit(value);
    share < AT_END || 1.0 - share < AT_END
}

/// A value with its uncertainty.
struct Fitted {
    value: f64,
    /// Standard deviation; infinite where the value does not show in the readings.
    deviation: f64,
    interval95: [f64; 2],
    /// Whether it is at an end of its range.
    at_bound: bool,
}

impl Telling<'_> {
    /// Returns the ratio of the variance of fitted values to that for independent residuals of the
    /// noise's size.
    pub(super) fn inflation(&self, of: &Explanation) -> f64 {
        let readings = self.bench.train.readings.max(1) as f64;
        let logs = &self.bench.train.logs;
        let rho = correlation(logs, (&of.fit.residuals, &logs.present()));
        (of.fit.cost / readings).max(1.0) * (1.0 + rho) / (1.0 - rho)
    }

    /// Returns how far the engine's own error moves each fitted value of an explanation, in its
    /// unit; 0 where that cannot be computed.
    pub(super) fn moved_by_step(&self, of: &Explanation) -> Result<Vec<f64>> {
        let none = vec![0.0; of.fit.free.len()];
        let scatters = self.findings.repeats.is_some_and(|r| r.scatters);
        if self.stopped || scatters || none.is_empty() {
            return Ok(none);
        }
        let Ok(halved) = self.bench.machine.halved() else {
            return Ok(none);
        };
        let change = change_by_step(self.bench, of, &halved)?;
        let moved = of.fit.answer(&change);
        Ok(moved.iter().map(|m| RICHARDSON * m).collect())
    }

    /// Collects what else makes the values of an explanation uncertain: the engine's own error and
    /// the disagreement between episodes.
    fn beyond<'m>(&self, of: &Explanation, moved: &'m [f64]) -> Beyond<'m> {
        let (logs, residuals) = (&self.bench.train.logs, &of.fit.residuals);
        let mut own = vec![0.0; residuals.len()];
        let of_episode = |e: usize| {
            let rows = logs.offset(e)..logs.offset(e + 1);
            own[rows.clone()].copy_from_slice(&residuals[rows.clone()]);
            let part = of.fit.answer(&own);
            own[rows].fill(0.0);
            part
        };
        let parts: Vec<Vec<f64>> = (0..logs.episodes.len()).map(of_episode).collect();
        Beyond {
            moved,
            by_episodes: between_episodes(&parts, of.fit.free.len()),
        }
    }

    /// Returns the value of an unknown of an explanation; `None` where it was not fitted.
    fn fitted(&self, (of, beyond): (&Explanation, &Beyond<'_>), unknown: usize) -> Option<Fitted> {
        let fit = &of.fit;
        let k = fit.free.iter().position(|&f| f == unknown)?;
        let [low, high] = of.unknowns[unknown].parameter.range;
        let value = fit.point.theta[unknown];
        let readings = fit.residuals.len().max(1) as f64;
        let shows = fit.shows[k] * (high - low) / readings.sqrt();
        let deviation = if shows > NOTHING {
            let by_replays = fit.covariance[(k, k)].max(0.0) * self.inflation(of);
            let (local, apart) =
                of.local[unknown].map_or((0.0, 0.0), |l| (l.variance, value - l.mean));
            let moved = beyond.moved.get(k).copied().unwrap_or(0.0);
            let disagreement = beyond.by_episodes[k];
            (by_replays.max(local).max(disagreement) + apart.powi(2) + moved.powi(2)).sqrt()
        } else {
            f64::INFINITY
        };
        let at_bound = is_at_end(&of.unknowns[unknown].parameter, value);
        // The logs ask for a value of the study's parameter beyond its range. Within the range
        // nothing determines it.
        let is_of_study = unknown < self.bench.parameters.len();
        let least = if at_bound && is_of_study {
            (high - low) / 12.0_f64.sqrt()
        } else {
            0.0
        };
        let deviation = deviation.max(least);
        Some(Fitted {
            value,
            deviation,
            interval95: [
                (value - DEVIATIONS * deviation).max(low),
                (value + DEVIATIONS * deviation).min(high),
            ],
            at_bound,
        })
    }

    /// Returns the intervals of the fitted values of each effect, and whether one is at an end of
    /// its range other than its null.
    ///
    /// `moved` is how far the engine's own error moves each fitted value; empty if unknown.
    pub(super) fn intervals(
        &self,
        of: &Explanation,
        moved: &[f64],
    ) -> Vec<(BTreeMap<String, [f64; 2]>, bool)> {
        let mut at = self.bench.parameters.len();
        let beyond = self.beyond(of, moved);
        let each = of.effects.iter().map(|effect| {
            let first = at;
            at += effect.values.len();
            let entry = asid_core::registry::find::<asid_effects::EffectEntry>(&effect.name);
            let made = entry.ok().map(|e| (e.make)());
            let null = |i: usize| made.as_ref().map_or(f64::NAN, |m| m.parameters()[i].null);
            let mut intervals = BTreeMap::new();
            let mut at_bound = false;
            for (i, (name, _)) in effect.values.iter().enumerate() {
                if let Some(fitted) = self.fitted((of, &beyond), first + i) {
                    intervals.insert(name.clone(), fitted.interval95);
                    at_bound |= fitted.at_bound && fitted.value != null(i);
                }
            }
            (intervals, at_bound)
        });
        each.collect()
    }

    /// Returns the study's parameters with their estimates and intervals.
    pub(super) fn parameters(&self, of: &Explanation, moved: &[f64]) -> Vec<ParameterResult> {
        let beyond = self.beyond(of, moved);
        let all = self.bench.parameters.iter().enumerate();
        all.map(|(i, p)| {
            let value = of.fit.point.theta[i];
            let fitted = self.fitted((of, &beyond), i);
            ParameterResult {
                name: p.name.clone(),
                unit: self.study.parameters[i].unit.clone(),
                nominal: Some(self.nominal[i]),
                estimate: value,
                std: fitted.as_ref().map_or(0.0, |f| f.deviation),
                interval95: fitted.map_or([value, value], |f| f.interval95),
            }
        })
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use asid_core::parameter::Scale;

    use super::*;
    use crate::data::tests::{log, plant};

    /// Symptom: a friction of 5e-6 within a range from 1e-6 to 10 on a log scale was told as at the
    /// end of it. Cause: its distance from the end was compared with the length of the range.
    #[test]
    fn an_end_of_a_range_is_on_the_scale_of_the_parameter() {
        let of = |scale, range| Parameter {
            name: "friction".to_owned(),
            targets: Vec::new(),
            range,
            scale,
            unit: String::new(),
        };
        let friction = of(Scale::Log, [1e-6, 10.0]);
        let is_end = [1e-6, 5e-6, 1.0, 10.0].map(|x| is_at_end(&friction, x));
        assert_eq!(is_end, [true, false, false, true]);
        let offset = of(Scale::Linear, [-1.0, 1.0]);
        let is_end = [-1.0, -0.999, 0.999, 1.0].map(|x| is_at_end(&offset, x));
        assert_eq!(is_end, [true, false, false, true]);
    }

    /// Symptom: the intervals of values were too narrow for a sensor that reads at every second
    /// row. Cause: the residual of a missing reading, 0, was used as that of a reading.
    #[test]
    fn readings_are_correlated_over_rows_without_a_reading() {
        let episode = log("a", &[0.0; 6]);
        let logs = Logs::new(&plant(), &["place".to_owned()], vec![episode]).unwrap();
        let alternate: Vec<bool> = (0..6).map(|k| k % 2 == 0).collect();
        let of = |residuals: [f64; 6]| correlation(&logs, (&residuals, &alternate));
        assert_eq!(of([1.0, 0.0, 2.0, 0.0, 2.0, 0.0]), 0.75);
        assert_eq!(of([1.0, 0.0, 0.0, 0.0, 2.0, 0.0]), 0.0);
    }

    #[test]
    fn a_mean_has_the_variance_of_its_sample_over_the_number_of_episodes() {
        // Least squares of one value, read once per episode: each episode moves it by a quarter of
        // its residual.
        let readings = [1.0, 3.0, 2.0, 6.0];
        let mean = 3.0;
        let parts: Vec<Vec<f64>> = readings.iter().map(|x| vec![(x - mean) / 4.0]).collect();
        let sample = (4.0 + 0.0 + 1.0 + 9.0) / 3.0;
        assert!((between_episodes(&parts, 1)[0] - sample / 4.0).abs() < 1e-12);
    }

    #[test]
    fn one_episode_cannot_disagree() {
        assert_eq!(between_episodes(&[vec![0.3, -2.0]], 2), [0.0, 0.0]);
    }
}
