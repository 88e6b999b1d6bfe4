//! From a study to the bench: logs prepared, noise and scatter estimated, the study's own
//! parameters fitted, and the stages chosen on which explanations are tried.

use std::collections::BTreeMap;

use asid_core::rng::Rng;
use asid_core::{Layout, Progress, Result};

use crate::bench::{Bench, CAPACITY, Explanation, Stage};
use crate::data::Logs;
use crate::fit::{Effort, Unknown, cost, fit, scan};
use crate::latent_force::pipeline::Shot;
use crate::machine::Machine;
use crate::noise;
use crate::predict::Point;
use crate::record::Record;
use crate::roughness::Spread;
use crate::scatter::Scatter;
use crate::search::LEAST_GAP;
use crate::starts::{given_start, open_coordinates};
use crate::study::Study;
use crate::whitening::Scattering;
use crate::windows;

/// Shares of the episodes that fits grow through.
const SHARES: [f64; 4] = [0.1, 0.3, 0.6, 1.0];
/// Root mean square of the residuals up to which a gradient is believed.
const NEAR: f64 = 30.0;
/// Root mean square from which on a gap is seen.
const SEEN: f64 = 1.5;
/// Root mean square up to which a model follows the first tenth of an episode, so that its start
/// can be taken from there.
const QUIET: f64 = 3.0;
/// Share of a held-out episode that an open start is fitted on.
pub(crate) const HEAD: f64 = 0.1;
/// Values of each parameter that are looked at before the first fit.
const SCAN: usize = CAPACITY;

/// The bench, and the study's parameters fitted without any effect on each stage.
pub struct Prepared {
    /// The bench.
    pub bench: Bench,
    /// One fit a stage.
    pub none: Vec<Explanation>,
    /// Values of the study's parameters in the model as given.
    pub nominal: Vec<f64>,
    /// What the bench's scatter is estimated with.
    pub scatter: Scatter,
    /// Whether nothing is missing: replays of all logs, those held out too, leave the noise only.
    pub is_whole: bool,
}

/// Sensors that some of the logs have, in the scene's order.
fn logged_sensors(layout: &Layout, study: &Study) -> Vec<String> {
    let episodes = || study.train.iter().chain(&study.test);
    layout
        .sensors
        .iter()
        .filter(|s| {
            episodes().any(|(_, e)| {
                let range = e.channel(&s.name);
                range.is_some_and(|r| {
                    (0..e.rows()).any(|k| e.reading(k)[r.clone()].iter().any(|x| x.is_finite()))
                })
            })
        })
        .map(|s| s.name.clone())
        .collect()
}

/// Residuals `logged - predicted` without whitening, in the sensors' units, one array an
/// episode.
///
/// # Errors
/// When a rollout fails.
pub fn plain_residuals(
    bench: &Bench,
    record: &Record,
    trials: &[crate::bench::Trial<'_>],
    point: &Point,
) -> Result<Vec<Vec<f64>>> {
    let mut predictor = bench.predictor(trials, record)?;
    let mut readings = predictor.readings(std::slice::from_ref(point))?;
    let predicted = readings.pop().unwrap_or_default();
    let logs = &record.logs;
    Ok((0..logs.episodes.len())
        .map(|e| {
            let mut out = vec![0.0; logs.episodes[e].plan.rows() * logs.entries.len()];
            logs.difference(e, &predicted[e], &mut out);
            out
        })
        .collect())
}

/// The bench of a study with its noise and stages still open, and the values of its parameters in the model
/// as given.
///
/// # Errors
/// When a parameter cannot be set.
pub fn dataset(study: &Study, machine: Machine) -> Result<(Bench, Vec<f64>)> {
    let layout = machine.plant.layout.clone();
    let sensors = logged_sensors(&layout, study);
    let record = |logs: &[(String, asid_core::Episode)]| -> Result<Record> {
        let starts = logs
            .iter()
            .map(|(_, e)| given_start(&machine.plant, e))
            .collect();
        let logs = Logs::new(&machine.plant, &sensors, logs.to_vec())?;
        Ok(Record::new(logs, starts))
    };
    let (train, test) = (record(&study.train)?, record(&study.test)?);
    let model = machine.with(&[])?;
    let nominal = study
        .parameters
        .iter()
        .map(|p| Ok(model.nominal(&p.targets[0])?.clamp(p.range[0], p.range[1])))
        .collect::<Result<Vec<_>>>()?;
    let open = open_coordinates(&layout, study);
    let bench = Bench {
        machine,
        train,
        parameters: study.parameters.clone(),
        fitted: open.clone(),
        open,
        head: test.cut(&layout, HEAD),
        test,
        stages: Vec::new(),
    };
    Ok((bench, nominal))
}

/// Estimates the noise from the readings alone; what the study gives stays.
pub fn set_reading_noise(bench: &mut Bench, given: &BTreeMap<String, f64>) {
    let logs = &bench.train.logs;
    let n = logs.entries.len();
    let width = logs.width();
    let series: Vec<Vec<f64>> = logs
        .episodes
        .iter()
        .map(|e| {
            let rows = e.plan.rows();
            let mut out = vec![0.0; rows * n];
            // Of each column the first reading that is there: any fixed one takes the place of the start.
            let first: Vec<f64> = (0..width)
                .map(|c| {
                    let mut column = e.readings.iter().skip(c).step_by(width);
                    column.find(|x| x.is_finite()).copied().unwrap_or(0.0)
                })
                .collect();
            for (row, out) in e.readings.chunks_exact(width).zip(out.chunks_exact_mut(n)) {
                logs.reading_difference(row, &first, out);
            }
            out
        })
        .collect();
    let estimated = noise::estimate(logs, &series);
    let noise: Vec<f64> = logs
        .sensors
        .iter()
        .zip(estimated)
        .map(|(s, x)| given.get(&s.name).copied().unwrap_or(x))
        .collect();
    bench.set_noise(&noise);
}

/// Prepares a study on a machine, from where multiple shooting arrived.
///
/// # Errors
/// When a parameter cannot be set or a rollout fails.
pub fn prepare(
    study: &Study,
    (machine, shot): (Machine, Option<Shot>),
    rng: Rng,
    progress: &dyn Progress,
) -> Result<Prepared> {
    let (mut bench, nominal) = dataset(study, machine)?;
    let layout = bench.layout().clone();
    let finer = bench.machine.halved().and_then(|half| {
        let quarter = half.halved()?;
        Ok([half, quarter])
    });
    let mut scatter = Scatter {
        finer: finer.ok(),
        rng,
        starts: Spread::of_known_starts(&layout),
    };
    let point = Point {
        theta: nominal.clone(),
        starts: bench.train.starts.clone(),
    };
    set_noise(&mut bench, &study.noise, &point)?;
    bench.stages = vec![whole(&bench)];
    let (mut point, left) = settle_starts(&mut bench, (point, progress))?;
    let mut lacks = false;
    if let Some(shot) = shot {
        lacks = shot.lacks;
        point = nearest(&mut bench, point, shot)?;
    }
    scatter.estimate(&mut bench, &point)?;
    if !bench.open.is_empty() && left < QUIET {
        scatter.keep_starts(&mut bench, &point)?;
    }
    let direct = if bench.is_rough() || lacks {
        None
    } else {
        fit_directly(&mut bench, study, &point, (&mut scatter, progress))?
    };
    let is_whole = direct.is_some();
    let none = if let Some(direct) = direct {
        vec![direct]
    } else if bench.is_rough() {
        identify_rough(&mut bench, study, point, (&mut scatter, progress))?
    } else {
        identify_smooth(&mut bench, study, point, (&mut scatter, progress))?
    };
    Ok(Prepared {
        bench,
        none,
        nominal,
        scatter,
        is_whole,
    })
}

/// All training logs.
fn whole(bench: &Bench) -> Stage {
    Stage {
        record: bench.train.clone(),
        episodes: (0..bench.train.logs.episodes.len()).collect(),
        open: bench.fitted.clone(),
    }
}

/// Estimates the noise at a point; what the study gives stays.
fn set_noise(bench: &mut Bench, given: &BTreeMap<String, f64>, point: &Point) -> Result<()> {
    let residuals = plain_residuals(bench, &bench.train, &[], point)?;
    let estimated = noise::estimate(&bench.train.logs, &residuals);
    let sensors = &bench.train.logs.sensors;
    let noise: Vec<f64> = sensors
        .iter()
        .zip(estimated)
        .map(|(s, x)| given.get(&s.name).copied().unwrap_or(x))
        .collect();
    for record in [&mut bench.train, &mut bench.test, &mut bench.head] {
        record.logs.set_noise(&noise);
    }
    Ok(())
}

/// Fits open starts alone, so that the model as given begins where the logs do; with the root
/// mean square that this leaves of the first tenth.
fn settle_starts(
    bench: &mut Bench,
    (point, progress): (Point, &dyn Progress),
) -> Result<(Point, f64)> {
    if bench.open.is_empty() {
        return Ok((point, 0.0));
    }
    let layout = bench.layout().clone();
    let mut unknowns = bench.unknowns(&[]);
    unknowns.iter_mut().for_each(|u| u.free = false);
    let head = bench.train.cut(&layout, HEAD);
    let mut predictor = bench.predictor(&[], &head)?;
    let fitted = fit(
        &mut predictor,
        &layout,
        &unknowns,
        point,
        &bench.open,
        (Effort::BRIEF, progress),
    )?;
    bench.train.starts.clone_from(&fitted.point.starts);
    let theta = &fitted.point.theta;
    bench.test.starts = bench.head_starts(&[], theta, &bench.test.starts)?;
    bench.head.starts.clone_from(&bench.test.starts);
    let left = (fitted.cost / head.readings.max(1) as f64).sqrt();
    Ok((fitted.point, left))
}

/// Of the point as it is, the values of a shot in its place, and its starts too, what leaves least.
fn nearest(bench: &mut Bench, point: Point, shot: Shot) -> Result<Point> {
    let mut points = vec![point.clone(), point.clone(), point];
    points[1].theta.clone_from(&shot.theta);
    points[2].theta = shot.theta;
    if !bench.open.is_empty() {
        let starts = points[2].starts.iter_mut().zip(shot.starts);
        starts.for_each(|(start, found)| *start = found.unwrap_or_else(|| start.clone()));
    }
    let mut predictor = bench.predictor(&[], &bench.train)?;
    let costs: Vec<f64> = predictor
        .residuals(&points)?
        .iter()
        .map(|r| cost(r))
        .collect();
    drop(predictor);
    let least = (0..costs.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b]));
    let point = points.swap_remove(least.unwrap_or(0));
    bench.train.starts.clone_from(&point.starts);
    bench.test.starts = bench.head_starts(&[], &point.theta, &bench.test.starts)?;
    bench.head.starts.clone_from(&bench.test.starts);
    bench.stages = vec![whole(bench)];
    Ok(point)
}

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
fn fit_directly(
    bench: &mut Bench,
    study: &Study,
    point: &Point,
    (scatter, progress): (&mut Scatter, &dyn Progress),
) -> Result<Option<Explanation>> {
    let effort = (Effort::BRIEF, progress);
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
fn identify_smooth(
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
fn identify_rough(
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
