//! Units: readings in degrees or millimetres are one of the usual factors times those of the model.

use asid_core::Result;

use super::check;
use crate::bench::Bench;
use crate::predict::Point;
use crate::prepare::plain_residuals;
use crate::result::CheckResult;

/// Largest logarithm of the ratio of a slope to a unit's factor for which the unit is recognised.
const UNIT: f64 = 0.27;

/// Checks for readings in another unit: their slope over the predictions is one of the usual
/// factors.
///
/// # Errors
/// When a rollout fails.
pub fn units(bench: &Bench, nominal: &[f64]) -> Result<CheckResult> {
    let record = &bench.train;
    // The model as given, because a fit would have adapted its parameters to the wrong unit.
    let point = Point {
        theta: nominal.to_vec(),
        starts: record.starts.clone(),
    };
    let residuals = plain_residuals(bench, record, &[], &point)?;
    let logs = &record.logs;
    let (n, width) = (logs.entries.len(), logs.width());
    let mut found = Vec::new();
    let mut column = 0;
    for (i, sensor) in logs.sensors.iter().enumerate() {
        let own: Vec<usize> = (0..n).filter(|&j| logs.entries[j].sensor == i).collect();
        if sensor.rotation {
            column += 4;
            continue;
        }
        let (mut xy, mut xx, mut yy) = (0.0, 0.0, 0.0);
        for (&j, c) in own.iter().zip(column..) {
            for (e, log) in logs.episodes.iter().enumerate() {
                let pairs = (0..log.plan.rows()).map(|k| {
                    let y = log.readings[k * width + c];
                    (y - residuals[e][k * n + j], y)
                });
                let pairs: Vec<_> = pairs
                    .filter(|(x, y)| x.is_finite() && y.is_finite())
                    .collect();
                let m = pairs.len().max(1) as f64;
                let mean = |f: fn(&(f64, f64)) -> f64| pairs.iter().map(f).sum::<f64>() / m;
                let (mx, my) = (mean(|p| p.0), mean(|p| p.1));
                for (x, y) in &pairs {
                    xy += (x - mx) * (y - my);
                    xx += (x - mx) * (x - mx);
                    yy += (y - my) * (y - my);
                }
            }
        }
        column += own.len();
        let (slope, correlation) = (xy / xx, xy / (xx * yy).sqrt());
        for (factor, what) in [
            (180.0 / std::f64::consts::PI, "degrees"),
            (1000.0, "thousandths of the unit (mm, mrad)"),
            (100.0, "hundredths of the unit (cm)"),
        ] {
            if correlation > 0.9 && (slope / factor).ln().abs() < UNIT {
                found.push(format!(
                    "`{}` reads {slope:.1} times what the model has: is it in {what}? Logs are in SI units",
                    sensor.name
                ));
            }
        }
    }
    let ok = found.is_empty();
    let detail = if ok {
        "readings have the size that the model predicts".into()
    } else {
        found.join("; ")
    };
    Ok(check("units", ok, detail))
}
