//! Checks before any diagnosis: are the logs and the study's parameters fit for it?

use asid_core::{Parameter, Result};

use crate::bench::{Bench, Explanation};
use crate::data::Logs;
use crate::fit::{Fit, cost};
use crate::forces::{Missing, Short};
use crate::linearise::slope;
use crate::machine::Machine;
use crate::predict::{Point, Predictor};
use crate::prepare::plain_residuals;
use crate::result::{CheckResult, MissingForce};

fn check(name: &str, ok: bool, detail: String) -> CheckResult {
    CheckResult {
        check: name.into(),
        ok,
        detail,
    }
}

/// Share of missing readings that is still called good.
const MISSING: f64 = 0.2;
/// Logarithm of what a reading's size may be off by for a unit to be recognised.
const UNIT: f64 = 0.27;
/// Share of a parameter's range that its deviation must be below.
const PINNED: f64 = 0.25;
/// Root mean square change by a halved time step that does not matter, in units of the noise.
const FINE: f64 = 0.5;

/// Readings present, rates, and lengths.
#[must_use]
pub fn data(train: &Logs, test: &Logs) -> CheckResult {
    let present: usize = [train, test]
        .iter()
        .map(|l| l.present().iter().filter(|p| **p).count())
        .sum();
    let all = train.len() + test.len();
    let missing = 1.0 - present as f64 / all.max(1) as f64;
    let episodes = || train.episodes.iter().chain(&test.episodes);
    let seconds: f64 = episodes()
        .map(|e| e.episode.time[e.episode.rows() - 1] - e.episode.time[0])
        .sum();
    check(
        "data",
        missing <= MISSING,
        format!(
            "{} + {} episodes, {seconds:.1} s, {present} readings, {:.1} % missing",
            train.episodes.len(),
            test.episodes.len(),
            100.0 * missing
        ),
    )
}

/// Correlation of noise from one reading to the next from which on it is said: below it an estimate from a few hundred rows
/// scatters about 0.
const COLOURED: f64 = 0.2;

/// Whether each sensor's noise is white: where it was filtered, its deviation is larger than neighbouring readings show.
#[must_use]
pub fn whiteness(logs: &Logs, residuals: &[Vec<f64>]) -> CheckResult {
    let noise = crate::noise::describe(logs, residuals);
    let each = logs.sensors.iter().zip(noise);
    let coloured: Vec<String> = each
        .filter(|(_, n)| n.correlation > COLOURED)
        .map(|(s, n)| format!("`{}` by {:.2}", s.name, n.correlation))
        .collect();
    let detail = if coloured.is_empty() {
        "no correlation from reading to reading is seen: it is taken for white".into()
    } else {
        format!(
            "the noise is correlated from reading to reading, which its deviation takes into account: of {}",
            coloured.join(", of ")
        )
    };
    check("noise", true, detail)
}

/// Readings in another unit: their slope over the predictions is one of the usual factors.
///
/// # Errors
/// When a rollout fails.
pub fn units(bench: &Bench, nominal: &[f64]) -> Result<CheckResult> {
    let record = &bench.train;
    // The model as given: a fit would have bent its parameters to the wrong unit.
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

/// Does each of the study's parameters show, without effects or with those of the best
/// explanation, and which of their combinations do not?
#[must_use]
pub fn identifiability(
    parameters: &[Parameter],
    none: &Explanation,
    best: &Explanation,
) -> Vec<CheckResult> {
    if parameters.is_empty() {
        return vec![check(
            "excitation",
            true,
            "the study fits no parameter".into(),
        )];
    }
    let fit = &none.fit;
    let p = fit.free.len();
    // In shares of the range.
    let scale = |fit: &Fit, k: usize| {
        let i = fit.free[k];
        slope(&parameters[i], fit.point.theta[i]).abs()
    };
    let deviation = |k: usize| fit.covariance[(k, k)].max(0.0).sqrt() / scale(fit, k);
    // Far off the logs a replay may be so chaotic that it has no slope; the best explanation is
    // nearer.
    let information = |k: usize| {
        let of = |fit: &Fit| fit.jacobian.column(k).norm() * scale(fit, k);
        of(fit).max(of(&best.fit))
    };
    let silent: Vec<&str> = (0..p)
        .filter(|&k| information(k) * PINNED < 1.0)
        .map(|k| &*parameters[fit.free[k]].name)
        .collect();
    let excitation = if silent.is_empty() {
        check(
            "excitation",
            true,
            "every parameter shows in the readings".into(),
        )
    } else {
        check(
            "excitation",
            false,
            format!(
                "{} hardly show in these logs: over a quarter of the range the readings change by less than the noise; move more",
                silent.join(", ")
            ),
        )
    };
    let loose: Vec<String> = (0..p)
        .filter(|&k| information(k) * PINNED >= 1.0 && deviation(k) > PINNED)
        .map(|k| parameters[fit.free[k]].name.clone())
        .collect();
    let together = if loose.is_empty() {
        check(
            "identifiability",
            true,
            "the logs determine every combination of parameters".into(),
        )
    } else {
        check(
            "identifiability",
            false,
            format!(
                "the logs see {} only in combination with each other: their values are not to be believed one by one",
                loose.join(", ")
            ),
        )
    };
    let correlations = correlated(parameters, none);
    let mut all = vec![excitation, together];
    if let Some(text) = correlations {
        all.push(check("correlation", true, text));
    }
    all
}

/// The most correlated pair of parameters, where it is beyond 0.95.
fn correlated(parameters: &[Parameter], none: &Explanation) -> Option<String> {
    let c = &none.fit.covariance;
    let p = c.nrows();
    let mut worst: Option<(f64, usize, usize)> = None;
    for i in 0..p {
        for j in 0..i {
            let r = c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt();
            if r.abs() > 0.95 && worst.is_none_or(|(w, ..)| r.abs() > w.abs()) {
                worst = Some((r, i, j));
            }
        }
    }
    let name = |k: usize| &parameters[none.fit.free[k]].name;
    worst.map(|(r, i, j)| format!("{} and {} trade off: correlation {r:.3}", name(i), name(j)))
}

/// How far predictions of the held-out logs scatter by what nobody can repeat.
#[must_use]
pub fn repeatability(bench: &Bench) -> CheckResult {
    let variance = bench.test.scattering.variance();
    let scatter = (variance / bench.test.readings.max(1) as f64).sqrt();
    check(
        "repeatability",
        true,
        format!(
            "on the logs held out predictions scatter by {scatter:.1} of the noise by differences that nobody controls (starts, contacts, the integrator): a gap of that size is no effect"
        ),
    )
}

/// What short replays leave, and what forces the model lacks at its joints over them, before and
/// with the verdict's effects.
#[must_use]
pub fn windows(before: &Short, after: &Short, seconds: f64) -> Vec<CheckResult> {
    const PLACES: [&str; 2] = [" in free motion", " in contact"];
    let touch = before.gaps.iter().all(Option::is_some);
    let place = |touching: bool| {
        if touch {
            PLACES[usize::from(touching)]
        } else {
            ""
        }
    };
    let gap = |touching: bool| {
        let [a, b] = [before, after].map(|s| s.gaps[usize::from(touching)]);
        let (a, b) = (a?, b?);
        let place = place(touching);
        Some(format!(
            "{a:.1} of the noise{place} ({b:.1} with the best explanation)"
        ))
    };
    let gaps: Vec<String> = [false, true].into_iter().filter_map(gap).collect();
    let replays = format!(
        "the median replay of a window of {seconds:.2} s, each from a start of its own, leaves {}",
        gaps.join(" and ")
    );
    let mut all = vec![check("windows", true, replays)];
    let joint = |(a, b): (&Missing, &Missing)| {
        let [mean, error] = a.against;
        // Two digits of the error.
        let digits = (1.0 - error.abs().max(1e-9).log10().floor()).clamp(3.0, 9.0) as usize;
        format!(
            "{}{} {:.3} {} ({mean:.digits$} ± {error:.digits$} against the motion), of which {:.3} are left with the best explanation",
            a.joint,
            place(a.touching),
            a.force,
            a.unit,
            b.force
        )
    };
    let joints: Vec<String> = before.joints.iter().zip(&after.joints).map(joint).collect();
    if !joints.is_empty() {
        let forces = format!(
            "over these windows the model lacks a force, root mean square, of {}",
            joints.join("; of ")
        );
        all.push(check("forces", true, forces));
    }
    all
}

/// What force the model lacks at each degree of freedom, before and with the verdict's effects; none where it was not
/// estimated.
#[must_use]
pub fn missing_force(missing: &[MissingForce]) -> Option<CheckResult> {
    let one = |m: &MissingForce| {
        format!(
            "{} {:.3} {} ({:.3} with the best explanation)",
            m.dof, m.identified, m.unit, m.refined
        )
    };
    let all: Vec<String> = missing.iter().map(one).collect();
    (!all.is_empty()).then(|| {
        let detail = format!(
            "the model lacks a force, standard deviation, of {}",
            all.join("; of ")
        );
        check("forces", true, detail)
    })
}

/// Change of the predictions of the training logs by a halved time step, in units of the noise; `halved` is the same machine with
/// half of it.
///
/// # Errors
/// When a rollout fails.
pub fn change_by_step(bench: &Bench, none: &Explanation, halved: &Machine) -> Result<Vec<f64>> {
    let point = &none.fit.point;
    let read = |machine: &Machine| -> Result<Vec<f64>> {
        let model = machine.with(&[])?;
        let logs = bench.train.logs.replanned(model.layout());
        let mut predictor = Predictor::new(&*model, &bench.parameters, &logs, 1, machine.threads)?;
        let mut residuals = predictor.residuals(std::slice::from_ref(point))?;
        Ok(residuals.pop().unwrap_or_default())
    };
    let (here, there) = (read(&bench.machine)?, read(halved)?);
    Ok(here.iter().zip(&there).map(|(a, b)| a - b).collect())
}

/// Does the gap depend on the time step? `halved` is the same machine with half of it.
///
/// # Errors
/// When a rollout fails.
pub fn time_step(bench: &Bench, none: &Explanation, halved: &Machine) -> Result<CheckResult> {
    let mut change = change_by_step(bench, none, halved)?;
    let rms = |r: &[f64]| (cost(r) / bench.train.readings.max(1) as f64).sqrt();
    let plain = rms(&change);
    bench.train.scattering.apply(&bench.train.logs, &mut change);
    let left = rms(&change);
    let gap = (none.fit.cost / bench.train.readings.max(1) as f64).sqrt();
    let ok = left < FINE || left < 0.5 * gap;
    Ok(check(
        "time-step",
        ok,
        format!(
            "halving the time step changes the predictions by {plain:.2} standard deviations of the noise, {left:.2} of them beyond the integrator's own error; the gap is {gap:.2}{}",
            if ok {
                ""
            } else {
                ": make the model's time step smaller first"
            }
        ),
    ))
}
