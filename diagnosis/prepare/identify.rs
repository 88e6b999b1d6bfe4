//! The study's parameters, fitted to whole replays without any effect: at once, or through stages that grow.

use asid_core::{Progress, Result};

use crate::bench::{Bench, CAPACITY, Explanation, Stage};
use crate::fit::{Effort, Unknown, cost, scan};
use crate::predict::Point;
use crate::scatter::Scatter;
use crate::search::LEAST_GAP;
use crate::study::Study;
use crate::whitening::Scattering;
use crate::windows;

use super::{set_noise, whole};

/// Shares of the episodes that fits grow through.
const SHARES: [f64; 4] = [0.1, 0.3, 0.6, 1.0];
/// Root mean square of the residuals up to which a gradient is believed.
const NEAR: f64 = 30.0;
/// Root mean square from which on a gap is seen.
const SEEN: f64 = 1.5;
/// Values of each parameter that are looked at before the first fit.
const SCAN: usize = CAPACITY;

/// Looks over the ranges on a stage and fits from the best.
fn scan_and_fit(
    bench: &Bench,
    stage: usize,
    point: &Point,
    effort: (Effort, &dyn Progress),
) -> Result<Explanation> {
    let unknowns: Vec<Unknown> = bench.unknowns(&[]);
    let part = &bench.stages[stage];
    let start = part.point(point.theta.clone(), &point.starts);
    let mut predictor = bench.predictor(&[], &part.record)?;
    let best = scan(&mut predictor, &unknowns, start, SCAN)?;
    bench.explain(stage, &[], &best.theta, &point.starts, effort)
}

/// A fit to the whole of the logs from the model as given on, where it leaves the noise only.
pub(super) fn fit_directly(
    bench: &mut Bench,
    study: &Study,
    point: &Point,
    (scatter, progress): (&mut Scatter, &dyn Progress),
) -> Result<Option<Explanation>> {
    // Slopes in the starts, of which there are many, are taken once: the starts are near already.
    let effort = Effort {
        chord: true,
        ..Effort::BRIEF
    };
    let effort = (effort, progress);
    let found = (bench.train.clone(), bench.test.clone(), bench.head.clone());
    let first = bench.explain(0, &[], &point.theta, &point.starts, effort)?;
    let point = &first.fit.point;
    set_noise(bench, &study.noise, point)?;
    scatter.estimate(bench, point)?;
    bench.stages = vec![whole(bench)];
    let again = bench.explain(0, &[], &point.theta, &point.starts, effort)?;
    let is_noise = |cost: f64, readings: f64| cost <= LEAST_GAP.powi(2) * readings;
    let train = cost(&plain(bench, &again.fit.point)?);
    if is_noise(train, bench.train.readings as f64)
        && is_noise(again.held_plain, bench.held_readings())
    {
        return Ok(Some(again));
    }
    (bench.train, bench.test, bench.head) = found;
    bench.stages = vec![whole(bench)];
    Ok(None)
}

/// Residuals of all training logs without whitening, in units of the noise.
fn plain(bench: &Bench, point: &Point) -> Result<Vec<f64>> {
    let mut predictor = bench.predictor(&[], &bench.train)?;
    predictor.set_scattering(Scattering::default());
    let mut residuals = predictor.residuals(std::slice::from_ref(point))?;
    Ok(residuals.pop().unwrap_or_default())
}

/// Where predictions are smooth: fits grow with the episodes, and once more with the noise and the scatter that the first found;
/// once, and as far as they have come, where work is stopped.
pub(super) fn identify_smooth(
    bench: &mut Bench,
    study: &Study,
    point: Point,
    (scatter, progress): (&mut Scatter, &dyn Progress),
) -> Result<Vec<Explanation>> {
    let layout = bench.layout().clone();
    let all: Vec<usize> = (0..bench.train.logs.episodes.len()).collect();
    bench.train.set_scattering(Scattering::default());
    let mut point = point;
    let windows = windows::rows(&bench.machine.plant, &bench.train.logs, &bench.open);
    for round in 0..2 {
        let mut stages: Vec<Stage> = SHARES
            .iter()
            .map(|&share| Stage {
                record: if share < 1.0 {
                    bench.train.cut(&layout, share)
                } else {
                    bench.train.clone()
                },
                episodes: all.clone(),
                open: bench.fitted.clone(),
            })
            .collect();
        if let Some(rows) = windows {
            (stages[0], point) = windows::stage(bench, rows, &point)?;
        }
        bench.stages = stages;
        let mut fits: Vec<Explanation> = Vec::new();
        for stage in 0..SHARES.len() {
            let from = fits.last().map_or(&point, |f| &f.fit.point);
            let last = stage + 1 == SHARES.len();
            let stopped = progress.is_stopped();
            let effort = if stopped { Effort::LOOK } else { Effort::FULL };
            let effort = (effort, progress);
            let mut fit = if (stage == 0 || last) && !stopped {
                scan_and_fit(bench, stage, from, effort)?
            } else {
                bench.explain(stage, &[], &from.theta, &from.starts, effort)?
            };
            if last && !progress.is_stopped() {
                let followed = bench.explain(stage, &[], &from.theta, &from.starts, effort)?;
                if followed.fit.cost < fit.fit.cost {
                    fit = followed;
                }
            }
            fits.push(fit);
        }
        let Some(best) = fits.last() else { break };
        point = best.fit.point.clone();
        if round == 0 {
            set_noise(bench, &study.noise, &point)?;
            scatter.estimate(bench, &point)?;
            if !progress.is_stopped() {
                continue;
            }
        }
        // The longest stage on which a gradient can be believed comes first.
        let rms = |i: usize| (fits[i].fit.cost / bench.readings(i)).sqrt();
        let begin = usize::from(windows.is_some());
        let mut first = (begin..SHARES.len())
            .rev()
            .find(|&i| rms(i) < NEAR)
            .unwrap_or(begin);
        // Unless nothing of the gap is seen on it yet.
        while first + 1 < SHARES.len() && rms(first) < SEEN && rms(SHARES.len() - 1) > SEEN {
            first += 1;
        }
        bench.stages.drain(begin..first);
        fits.drain(begin..first);
        return Ok(fits);
    }
    Ok(Vec::new())
}

/// Episodes that fits begin with where each rollout is dear.
const FEW: usize = 3;

/// Episodes to begin with: half of them, few in all, every other one by the size of its gap, so
/// that those in which much is amiss are among them.
fn telling(bench: &Bench, point: &Point) -> Result<Vec<usize>> {
    let logs = &bench.train.logs;
    let n = logs.episodes.len();
    let mut predictor = bench.predictor(&[], &bench.train)?;
    let residuals = predictor.residuals(std::slice::from_ref(point))?;
    let gap = |e: usize| -> f64 {
        let own = &residuals[0][logs.offset(e)..logs.offset(e + 1)];
        own.iter().map(|r| r * r).sum()
    };
    let gaps: Vec<f64> = (0..n).map(gap).collect();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| gaps[b].total_cmp(&gaps[a]));
    let mut some: Vec<usize> = order.into_iter().step_by(2).take(FEW).collect();
    some.sort_unstable();
    Ok(some)
}

/// Where predictions scatter: fits begin with half of the episodes, and the scatter is
/// estimated again where they arrive.
pub(super) fn identify_rough(
    bench: &mut Bench,
    study: &Study,
    point: Point,
    (scatter, progress): (&mut Scatter, &dyn Progress),
) -> Result<Vec<Explanation>> {
    // What only rests at the end of an episode tells nothing more.
    let layout = bench.layout().clone();
    let shares = bench.train.logs.moving_shares();
    bench.train = bench.train.cut_each(&layout, &shares);
    scatter.estimate(bench, &point)?;
    let some = telling(bench, &point)?;
    let rows = windows::rows(&bench.machine.plant, &bench.train.logs, &bench.open);
    let stages = |bench: &Bench, point: &Point| -> Result<(Vec<Stage>, Point)> {
        let (part, point) = match rows {
            Some(rows) => windows::stage(bench, rows, point)?,
            None => {
                let part = Stage {
                    record: bench.train.some(&some),
                    episodes: some.clone(),
                    open: bench.fitted.clone(),
                };
                (part, point.clone())
            }
        };
        Ok((vec![part, whole(bench)], point))
    };
    let (found, point) = stages(bench, &point)?;
    bench.stages = found;
    let first = scan_and_fit(bench, 0, &point, (Effort::BRIEF, progress))?;
    set_noise(bench, &study.noise, &first.fit.point)?;
    scatter.estimate(bench, &first.fit.point)?;
    let (found, from) = stages(bench, &first.fit.point)?;
    bench.stages = found;
    let effort = || match progress.is_stopped() {
        true => (Effort::LOOK, progress),
        false => (Effort::BRIEF, progress),
    };
    let part = bench.explain(0, &[], &from.theta, &from.starts, effort())?;
    let from = &part.fit.point;
    let all = bench.explain(1, &[], &from.theta, &from.starts, effort())?;
    Ok(vec![part, all])
}
