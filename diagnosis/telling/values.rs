//! Fitted values with their intervals.
//!
//! Intervals are those of least squares (Gauss), widened by how much more the fit leaves than the noise and by how alike
//! neighbouring residuals are: many readings of one and the same error count once. Where the missing force was estimated they
//! are no narrower than those of the fit that allows for it: what the model lacks leaves values as uncertain as it does there. Nor are
//! they narrower than the episodes disagree: what the model lacks often pulls one of them up and another one down.
//!
//! Two errors that no spread of residuals shows are added as squares. A model that is wrong makes fits that weigh the logs otherwise
//! disagree (Hausman 1978): the distance of the value from the mean of the fit that allows for a missing force. And the engine's own
//! error: what the value would be at a time step of none, by how far half the step moves it (Richardson 1911). A parameter of the study
//! at an end of its range is as uncertain as the range is wide.

use std::collections::BTreeMap;

use asid_core::Result;

use super::Telling;
use crate::bench::{Bench, Explanation};
use crate::checks::{RICHARDSON, change_by_step};
use crate::linearise::NOTHING;
use crate::result::ParameterResult;

/// Deviations of a normal distribution that hold 95 %, to either side.
const DEVIATIONS: f64 = 1.959_964;
/// Largest correlation that is believed: beyond it a log is one reading.
const MOST_CORRELATED: f64 = 0.98;
/// Share of its range up to which a value is at the end of it: what a fit stops at.
const AT_END: f64 = 1e-6;

/// Correlation of neighbouring residuals, averaged over entries and episodes by their size.
fn correlation(bench: &Bench, residuals: &[f64]) -> f64 {
    let logs = &bench.train.logs;
    let n = logs.entries.len();
    let (mut product, mut square) = (0.0, 0.0);
    for e in 0..logs.episodes.len() {
        let part = &residuals[logs.offset(e)..logs.offset(e + 1)];
        for k in n..part.len() {
            product += part[k] * part[k - n];
            square += part[k] * part[k];
        }
    }
    if square > 0.0 {
        (product / square).clamp(0.0, MOST_CORRELATED)
    } else {
        0.0
    }
}

/// What the spread of residuals does not tell of the uncertainty of an explanation's values.
struct Beyond<'m> {
    /// How far the engine's own error moves each fitted value, in its unit; empty for nothing.
    moved: &'m [f64],
    /// Variance of each by how the episodes disagree.
    by_episodes: Vec<f64>,
}

/// Variance of sums, of which each episode has given its part, one row an episode: of parts that are independent from one episode to
/// the next it is their variance times their number (Liang and Zeger 1986, with episodes as clusters). 0 of a single episode.
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

/// A value with its uncertainty.
struct Fitted {
    value: f64,
    /// Infinite where it does not show in the readings.
    deviation: f64,
    interval95: [f64; 2],
    /// Whether it is at an end of its range.
    at_bound: bool,
}

impl Telling<'_> {
    /// By how much the variance of fitted values exceeds that of independent residuals of the noise's size.
    pub(super) fn inflation(&self, of: &Explanation) -> f64 {
        let readings = self.bench.train.readings.max(1) as f64;
        let rho = correlation(self.bench, &of.fit.residuals);
        (of.fit.cost / readings).max(1.0) * (1.0 + rho) / (1.0 - rho)
    }

    /// How far the engine's own error moves each fitted value of an explanation, in its unit; 0 where that cannot be told.
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

    /// What moves the values of an explanation, and how its episodes disagree about them.
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

    /// The value of an unknown of an explanation; `None` where it was not fitted.
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
        let end = AT_END * (high - low);
        let at_bound = value - low < end || high - value < end;
        // The logs ask for a parameter of the study beyond its range: within it nothing tells where it is.
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

    /// Intervals of the fitted values of each effect of an explanation, and whether one is at an end of its range that does not
    /// mean that the effect is absent. `moved` is how far the engine's own error moves each fitted value, empty for nothing.
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

    /// The study's parameters.
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
    use super::*;

    #[test]
    fn a_mean_has_the_variance_of_its_sample_over_the_number_of_episodes() {
        // Least squares of one value, read once an episode: each episode moves it by a quarter of its residual.
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
