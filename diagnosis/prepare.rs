//! From a study to the bench: logs prepared, noise and scatter estimated, the study's own
//! parameters fitted, and the stages chosen on which explanations are tried.

use std::collections::BTreeMap;

use asid_core::problem::home;
use asid_core::rng::Rng;
use asid_core::{Layout, Result};

use crate::bench::{Bench, CAPACITY, Explanation, Record, Stage};
use crate::data::Logs;
use crate::fit::{Effort, Unknown, scan};
use crate::machine::Machine;
use crate::noise;
use crate::predict::{Point, State};
use crate::roughness::{self, Spread};
use crate::study::Study;

/// Shares of the episodes that fits grow through.
const SHARES: [f64; 4] = [0.1, 0.3, 0.6, 1.0];
/// Root mean square of the residuals up to which a gradient is believed.
const NEAR: f64 = 30.0;
/// Root mean square from which on a gap is seen.
const SEEN: f64 = 1.5;
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

/// The start of an episode as the log has it; the rest from the scene's own start.
fn given_start(layout: &Layout, episode: &asid_core::Episode) -> State {
    let (mut qpos, mut qvel) = home(layout);
    if let Some(initial) = &episode.initial {
        for (x, given) in qpos.iter_mut().zip(&initial.qpos) {
            if given.is_finite() {
                *x = *given;
            }
        }
        for (x, given) in qvel.iter_mut().zip(&initial.qvel) {
            if given.is_finite() {
                *x = *given;
            }
        }
    }
    State { qpos, qvel }
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

/// Prepares a study on a machine.
///
/// # Errors
/// When a parameter cannot be set or a rollout fails.
pub fn prepare(study: &Study, machine: Machine, rng: &mut Rng) -> Result<Prepared> {
    let layout = machine.plant.layout.clone();
    let sensors = logged_sensors(&layout, study);
    let record = |logs: &[(String, asid_core::Episode)]| -> Result<Record> {
        let starts = logs.iter().map(|(_, e)| given_start(&layout, e)).collect();
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
    let mut bench = Bench {
        machine,
        train,
        test,
        parameters: study.parameters.clone(),
        open: Vec::new(),
        stages: Vec::new(),
    };
    let point = Point {
        theta: nominal.clone(),
        starts: bench.train.starts.clone(),
    };
    set_noise(&mut bench, &study.noise, &point)?;
    bench.stages = vec![whole(&bench)];
    scatter(&mut bench, &point, rng)?;
    let none = if bench.is_rough() {
        identify_rough(&mut bench, study, point, rng)?
    } else {
        identify_smooth(&mut bench, study, point)?
    };
    Ok(Prepared {
        bench,
        none,
        nominal,
    })
}

/// All training logs.
fn whole(bench: &Bench) -> Stage {
    Stage {
        record: bench.train.clone(),
        episodes: (0..bench.train.logs.episodes.len()).collect(),
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
    bench.train.logs.set_noise(&noise);
    bench.test.logs.set_noise(&noise);
    Ok(())
}

/// Estimates the scatter of predictions about a point.
fn scatter(bench: &mut Bench, point: &Point, rng: &mut Rng) -> Result<()> {
    let layout = bench.layout().clone();
    let spread = Spread::of_known_starts(&layout);
    bench.train.whitening = {
        let mut predictor = bench.predictor(&[], &bench.train)?;
        roughness::estimate(&mut predictor, &layout, point, &spread, rng)?
    };
    bench.test.whitening = {
        let mut predictor = bench.predictor(&[], &bench.test)?;
        let point = Point {
            theta: point.theta.clone(),
            starts: bench.test.starts.clone(),
        };
        roughness::estimate(&mut predictor, &layout, &point, &spread, rng)?
    };
    Ok(())
}

/// Looks over the ranges on a stage and fits from the best.
fn scan_and_fit(bench: &Bench, stage: usize, point: &Point, effort: Effort) -> Result<Explanation> {
    let unknowns: Vec<Unknown> = bench.unknowns(&[]);
    let Stage { record, episodes } = &bench.stages[stage];
    let start = Point {
        theta: point.theta.clone(),
        starts: episodes.iter().map(|&e| point.starts[e].clone()).collect(),
    };
    let best = scan(&mut bench.predictor(&[], record)?, &unknowns, start, SCAN)?;
    bench.explain(stage, &[], &best.theta, &point.starts, effort)
}

/// Where predictions are smooth: fits grow with the episodes.
fn identify_smooth(bench: &mut Bench, study: &Study, point: Point) -> Result<Vec<Explanation>> {
    let layout = bench.layout().clone();
    let all: Vec<usize> = (0..bench.train.logs.episodes.len()).collect();
    bench.train.whitening.clear();
    bench.test.whitening.clear();
    let mut point = point;
    for round in 0..2 {
        bench.stages = SHARES
            .iter()
            .map(|&share| Stage {
                record: bench.train.cut(&layout, share),
                episodes: all.clone(),
            })
            .collect();
        let mut fits: Vec<Explanation> = Vec::new();
        for stage in 0..SHARES.len() {
            let from = fits.last().map_or(&point, |f| &f.fit.point);
            let last = stage + 1 == SHARES.len();
            let mut fit = if stage == 0 || last {
                scan_and_fit(bench, stage, from, Effort::FULL)?
            } else {
                bench.explain(stage, &[], &from.theta, &from.starts, Effort::FULL)?
            };
            if last {
                let followed = bench.explain(stage, &[], &from.theta, &from.starts, Effort::FULL)?;
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
            continue;
        }
        // The longest stage on which a gradient can be believed comes first.
        let rms = |i: usize| (fits[i].fit.cost / bench.readings(i)).sqrt();
        let mut first = (0..SHARES.len()).rev().find(|&i| rms(i) < NEAR).unwrap_or(0);
        // Unless nothing of the gap is seen on it yet.
        while first + 1 < SHARES.len() && rms(first) < SEEN && rms(SHARES.len() - 1) > SEEN {
            first += 1;
        }
        bench.stages.drain(..first);
        fits.drain(..first);
        return Ok(fits);
    }
    Ok(Vec::new())
}

/// Where predictions scatter: fits begin with half of the episodes, and the scatter is
/// estimated again where they arrive.
fn identify_rough(
    bench: &mut Bench,
    study: &Study,
    point: Point,
    rng: &mut Rng,
) -> Result<Vec<Explanation>> {
    let n = bench.train.logs.episodes.len();
    let some: Vec<usize> = (0..n).step_by(2).collect();
    let stages = |bench: &Bench| {
        let part = Stage {
            record: bench.train.some(&some),
            episodes: some.clone(),
        };
        vec![part, whole(bench)]
    };
    // What only rests at the end of an episode tells nothing more.
    let layout = bench.layout().clone();
    let share = bench.train.logs.moving_share();
    bench.train = bench.train.cut(&layout, share);
    scatter(bench, &point, rng)?;
    bench.stages = stages(bench);
    let first = scan_and_fit(bench, 0, &point, Effort::BRIEF)?;
    set_noise(bench, &study.noise, &first.fit.point)?;
    scatter(bench, &first.fit.point, rng)?;
    bench.stages = stages(bench);
    let from = &first.fit.point;
    let part = bench.explain(0, &[], &from.theta, &from.starts, Effort::BRIEF)?;
    let from = &part.fit.point;
    let all = bench.explain(1, &[], &from.theta, &from.starts, Effort::BRIEF)?;
    Ok(vec![part, all])
}
