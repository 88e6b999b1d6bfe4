//! From a study to the bench: logs prepared, noise and scatter estimated, the study's own
//! parameters fitted, and the stages chosen on which explanations are tried.

mod identify;

use std::collections::BTreeMap;

use asid_core::rng::Rng;
use asid_core::{Layout, Progress, Result};

use crate::bench::{Bench, Explanation, Stage};
use crate::data::Logs;
use crate::fit::{Effort, cost, fit};
use crate::machine::Machine;
use crate::noise;
use crate::predict::Point;
use crate::record::Record;
use crate::roughness::Spread;
use crate::scatter::Scatter;
use crate::shot::Shot;
use crate::starts::{given_start, open_coordinates};
use crate::study::Study;

use identify::{fit_directly, identify_rough, identify_smooth};

/// Root mean square up to which a model follows the first tenth of an episode, so that its start
/// can be taken from there.
const QUIET: f64 = 3.0;
/// Share of a held-out episode that an open start is fitted on.
pub(crate) const HEAD: f64 = 0.1;
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
