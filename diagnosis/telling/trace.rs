//! What the report shows in addition to the numbers: curves, the ladder of single effects, the map.

use std::collections::BTreeMap;

use asid_core::Result;
use asid_core::registry::find;
use asid_effects::EffectEntry;

use super::{HeldOut, Telling};
use crate::findings::trials;
use crate::result::EffectResult;
use crate::trace::{
    DiagnosisTrace, EffectWords, Map, NamedText, ParameterWords, Rung, SignalTrace,
};

/// Maximum number of points of one curve in the trace.
const CURVE: usize = 600;
/// Number of held-out episodes in the trace.
const SHOWN: usize = 3;
/// Maximum number of points of the map.
const MAP: usize = 4000;

impl Telling<'_> {
    /// Makes the trace of the first held-out episodes and of all single effects.
    pub(super) fn trace(
        &self,
        nominal: &HeldOut,
        identified: &HeldOut,
        refined: &HeldOut,
        effects: &[EffectResult],
    ) -> Result<DiagnosisTrace> {
        let logs = &self.bench.test.logs;
        let width = logs.width();
        let mut signals = Vec::new();
        for (e, log) in logs.episodes.iter().enumerate().take(SHOWN) {
            let rows = log.plan.rows();
            let stride = rows.div_ceil(CURVE);
            let pick = |all: &[f64], column: usize| -> Vec<f64> {
                let values = all.iter().skip(column).step_by(width).step_by(stride);
                values.copied().collect()
            };
            let mut column = 0;
            for (s, sensor) in logs.sensors.iter().enumerate() {
                let own = logs.entries.iter().filter(|x| x.sensor == s).count();
                let len = if sensor.rotation { 4 } else { own };
                for c in 0..len {
                    let at = column + c;
                    signals.push(SignalTrace {
                        episode: log.name.clone(),
                        signal: if len == 1 {
                            sensor.name.clone()
                        } else {
                            format!("{}.{c}", sensor.name)
                        },
                        unit: if sensor.rotation {
                            String::new()
                        } else {
                            sensor.unit.clone()
                        },
                        noise: sensor.noise,
                        time: log.episode.time[..rows]
                            .iter()
                            .step_by(stride)
                            .copied()
                            .collect(),
                        real: pick(&log.readings, at),
                        nominal: pick(&nominal.readings[e], at),
                        identified: pick(&identified.readings[e], at),
                        refined: pick(&refined.readings[e], at),
                    });
                }
                column += len;
            }
        }
        let mut ladder = Vec::new();
        for found in &self.findings.found {
            if found.candidates.len() == 1 {
                let trials = trials(self.candidates, &found.candidates, &found.explanation);
                let of = &found.explanation;
                let held = self.held(&trials, &of.fit.point.theta, of.held_starts.clone())?;
                let (square, count) = self.rms(&held.residuals, None, None);
                let label = found.explanation.effects[0].label();
                let gap = (square / f64::max(count, 1.0)).sqrt();
                ladder.push(Rung { label, gap });
            }
        }
        ladder.sort_by(|a, b| a.gap.total_cmp(&b.gap));
        Ok(DiagnosisTrace {
            signals,
            ladder,
            map: self.map(identified),
            left_out: (self.left_out.iter())
                .map(|l| NamedText::new(&l.label, &l.why))
                .collect(),
            forces: self.findings.forces.clone(),
            catalogue: catalogue(effects),
            held_out: self.study.test.len(),
            fitted_to: self.study.train.len(),
            ..DiagnosisTrace::default()
        })
    }

    /// Returns where a position sensor was, with the size of its residual there.
    fn map(&self, identified: &HeldOut) -> Option<Map> {
        let logs = &self.bench.test.logs;
        let (n, width) = (logs.entries.len(), logs.width());
        let mut column = 0;
        for (s, sensor) in logs.sensors.iter().enumerate() {
            let own: Vec<usize> = (0..n).filter(|&j| logs.entries[j].sensor == s).collect();
            if !sensor.rotation && own.len() == 3 && sensor.unit == "m" {
                let mut map = Vec::new();
                for (e, log) in logs.episodes.iter().enumerate() {
                    for k in 0..log.plan.rows() {
                        let at = &log.readings[k * width + column..][..2];
                        let r = &identified.residuals[logs.offset(e) + k * n..][..n];
                        let size = own.iter().map(|&j| r[j] * r[j]).sum::<f64>().sqrt();
                        if at.iter().all(|x| x.is_finite()) && size.is_finite() {
                            map.push([at[0], at[1], size]);
                        }
                    }
                }
                let stride = map.len().div_ceil(MAP).max(1);
                let map = map.into_iter().step_by(stride).collect();
                return Some(Map {
                    axes: [0, 1].map(|i| format!("{}.{i}", sensor.name)),
                    unit: sensor.unit.clone(),
                    points: map,
                });
            }
            column += if sensor.rotation { 4 } else { own.len() };
        }
        None
    }
}

/// Returns what the catalogue says about some effects.
fn catalogue(effects: &[EffectResult]) -> BTreeMap<String, EffectWords> {
    let known = effects.iter().filter_map(|e| {
        let entry = find::<EffectEntry>(&e.effect).ok()?;
        let made = (entry.make)();
        let parameters = made.parameters().iter().map(|p| {
            let words = ParameterWords {
                unit: p.unit.to_owned(),
                null: p.null,
            };
            (p.name.to_owned(), words)
        });
        let words = EffectWords {
            about: entry.about.to_owned(),
            parameters: parameters.collect(),
        };
        Some((e.effect.clone(), words))
    });
    known.collect()
}
