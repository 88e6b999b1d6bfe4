//! What the report shows besides the numbers: curves, the ladder of single effects, the map.

use asid_core::Result;

use super::{HeldOut, Telling};
use crate::result::{DiagnosisTrace, SignalTrace};
use crate::search::trials;

/// Points of one curve in the trace.
const CURVE: usize = 600;
/// Held-out episodes in the trace.
const SHOWN: usize = 3;
/// Points of the map.
const MAP: usize = 4000;

impl Telling<'_> {
    /// Of the first held-out episodes, and of all single effects.
    pub(super) fn trace(
        &self,
        nominal: &HeldOut,
        identified: &HeldOut,
        refined: &HeldOut,
    ) -> Result<DiagnosisTrace> {
        let logs = &self.bench.test.logs;
        let width = logs.width();
        let mut signals = Vec::new();
        for (e, log) in logs.episodes.iter().enumerate().take(SHOWN) {
            let rows = log.plan.rows();
            let stride = rows.div_ceil(CURVE);
            let pick = |all: &[f64], column: usize| -> Vec<Option<f64>> {
                let values = all.iter().skip(column).step_by(width).step_by(stride);
                values.map(|x| x.is_finite().then_some(*x)).collect()
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
                let held = self.held(&trials, &found.explanation.fit.point.theta)?;
                let (square, count) = self.rms(&held.residuals, None, None);
                let label = found.explanation.effects[0].label();
                ladder.push((label, (square / f64::max(count, 1.0)).sqrt()));
            }
        }
        ladder.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (map, map_axes) = self.map(identified);
        Ok(DiagnosisTrace {
            signals,
            ladder,
            map,
            map_axes,
            left_out: self
                .left_out
                .iter()
                .map(|l| (l.label.clone(), l.why.clone()))
                .collect(),
        })
    }

    /// Where a position sensor was, and how large its residual there.
    fn map(&self, identified: &HeldOut) -> (Vec<[f64; 3]>, [String; 2]) {
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
                let axis = |i: usize| format!("{}.{i} (m)", sensor.name);
                return (map, [axis(0), axis(1)]);
            }
            column += if sensor.rotation { 4 } else { own.len() };
        }
        (Vec::new(), [String::new(), String::new()])
    }
}
