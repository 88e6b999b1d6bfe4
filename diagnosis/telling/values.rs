//! Fitted values with their intervals.
//!
//! Intervals are those of least squares (Gauss), widened by how much more the fit leaves than the noise and by how alike
//! neighbouring residuals are: many readings of one and the same error count once. Where the missing force was estimated they
//! are no narrower than those of the fit that allows for it: what the model lacks leaves values as uncertain as it does there.

use std::collections::BTreeMap;

use super::Telling;
use crate::bench::{Bench, Explanation};
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

/// A value with its uncertainty.
pub(super) struct Fitted {
    pub(super) value: f64,
    /// Infinite where it does not show in the readings.
    pub(super) deviation: f64,
    pub(super) interval95: [f64; 2],
    /// Whether it is at an end of its range.
    pub(super) at_bound: bool,
}

impl Telling<'_> {
    /// By how much the variance of fitted values exceeds that of independent residuals of the noise's size.
    pub(super) fn inflation(&self, of: &Explanation) -> f64 {
        let readings = self.bench.train.readings.max(1) as f64;
        let rho = correlation(self.bench, &of.fit.residuals);
        (of.fit.cost / readings).max(1.0) * (1.0 + rho) / (1.0 - rho)
    }

    /// The value of an unknown of an explanation; `None` where it was not fitted.
    pub(super) fn fitted(&self, of: &Explanation, unknown: usize) -> Option<Fitted> {
        let fit = &of.fit;
        let k = fit.free.iter().position(|&f| f == unknown)?;
        let [low, high] = of.unknowns[unknown].parameter.range;
        let value = fit.point.theta[unknown];
        let column = fit.jacobian.column(k);
        let shows = column.norm() * (high - low) / (column.len().max(1) as f64).sqrt();
        let deviation = if shows > NOTHING {
            let by_replays = fit.covariance[(k, k)].max(0.0) * self.inflation(of);
            by_replays.max(of.local_variances[unknown]).sqrt()
        } else {
            f64::INFINITY
        };
        let end = AT_END * (high - low);
        Some(Fitted {
            value,
            deviation,
            interval95: [
                (value - DEVIATIONS * deviation).max(low),
                (value + DEVIATIONS * deviation).min(high),
            ],
            at_bound: value - low < end || high - value < end,
        })
    }

    /// Intervals of the fitted values of each effect of an explanation, and whether one is at an end of its range that does not
    /// mean that the effect is absent.
    pub(super) fn intervals(&self, of: &Explanation) -> Vec<(BTreeMap<String, [f64; 2]>, bool)> {
        let mut at = self.bench.parameters.len();
        let each = of.effects.iter().map(|effect| {
            let first = at;
            at += effect.values.len();
            let entry = asid_core::registry::find::<asid_effects::EffectEntry>(&effect.name);
            let made = entry.ok().map(|e| (e.make)());
            let null = |i: usize| made.as_ref().map_or(f64::NAN, |m| m.parameters()[i].null);
            let mut intervals = BTreeMap::new();
            let mut at_bound = false;
            for (i, (name, _)) in effect.values.iter().enumerate() {
                if let Some(fitted) = self.fitted(of, first + i) {
                    intervals.insert(name.clone(), fitted.interval95);
                    at_bound |= fitted.at_bound && fitted.value != null(i);
                }
            }
            (intervals, at_bound)
        });
        each.collect()
    }

    /// The study's parameters.
    pub(super) fn parameters(&self, of: &Explanation) -> Vec<ParameterResult> {
        let all = self.bench.parameters.iter().enumerate();
        all.map(|(i, p)| {
            let value = of.fit.point.theta[i];
            let fitted = self.fitted(of, i);
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
