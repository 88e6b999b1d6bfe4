//! Effects as columns: what a unit of each adds to the model along the smoothed trajectory.
//!
//! A parameter that acts in proportion from its null on is a slope, taken over a part of the size that the
//! missing force allows it; one that has no slope there (play, a dead band, a limit) is a secant at each of the values
//! that the effect says a search begins with. Sizes come from the logs: an effect may make up for forces as large as
//! those that are missing, and for readings that are off by a part of their spread.

use asid_core::{Parameter, Result};
use asid_effects::{EffectSpec, Start};
use asid_mjcf::Plant;
use nalgebra::DMatrix;

use crate::candidate::Candidate;

use super::estimate::{Context, Estimate};
use super::fit::Hypothesis;
use super::step_map::{Derivatives, LinearEpisode, Variation, retime_columns};
use super::trace::{is_traceable, trace};
use super::unknown::Unknown;

/// Share of a parameter's range over which its size is first felt for.
const TRIAL: f64 = 1e-5;
/// Inertial force of a degree of freedom that does not move, N or N m.
const SILENT: f64 = 1e-8;
/// Share of a deviation of the prior that slopes of the present model are taken over.
const BASE_SHARE: f64 = 0.01;
/// Share of a deviation of the prior that slopes are taken over: a plausible size, so that a law that saturates is seen
/// as it acts.
const SHARE: f64 = 0.2;
/// Share of the inertial forces that is missing at least, for the size of priors.
const LEAST_MISSING: f64 = 0.1;
/// Quantile of the missing force that counts as its size.
const QUANTILE: f64 = 0.99;
/// Share of a reading's spread that an effect on it may make up for.
const READING_SHARE: f64 = 0.1;
/// Most that a coefficient may be, in deviations of its prior.
const MOST: f64 = 3.0;
/// Secants may be taken up to this multiple of their start value.
const SECANT: f64 = 1.5;
/// Rows of the parts that sizes are felt for on, and how many parts.
const PART: usize = 6;
const PARTS: usize = 24;

/// One way to take a candidate: some values to begin with, and the columns that stand for it.
#[derive(Clone, Debug)]
pub struct Form {
    /// The candidate.
    pub candidate: usize,
    /// Values of its parameters to begin with.
    pub begin: Vec<f64>,
    /// For each column: the parameter that it is a slope in, with the deviation of its prior; `None` for a secant.
    pub slopes: Vec<Option<(usize, f64)>>,
    /// The first of its columns.
    pub first: usize,
}

impl Form {
    /// Places of its columns.
    #[must_use]
    pub fn columns(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.slopes.len()
    }

    /// Values of the candidate's parameters at some coefficients of the columns.
    #[must_use]
    pub fn values(&self, candidate: &Candidate, coefficients: &[f64]) -> Vec<f64> {
        let mut values = self.begin.clone();
        for (slope, c) in self.slopes.iter().zip(coefficients) {
            match slope {
                Some((i, deviation)) => values[*i] += c * deviation,
                None => {
                    for (v, p) in values.iter_mut().zip(candidate.parameters()) {
                        if !matches!(p.start, Start::Choice(_) | Start::Given | Start::Set(..)) {
                            *v = p.null + c * (*v - p.null);
                        }
                    }
                }
            }
        }
        for (v, range) in values.iter_mut().zip(&candidate.ranges) {
            *v = v.clamp(range[0], range[1]);
        }
        values
    }

    /// What its parameters are as unknowns of a fit.
    #[must_use]
    pub fn unknowns(&self, candidate: &Candidate) -> Vec<Unknown> {
        candidate
            .unknowns()
            .into_iter()
            .enumerate()
            .map(|(i, (parameter, free))| {
                let p = &candidate.parameters()[i];
                let slope = self.slopes.iter().flatten().find(|(k, _)| *k == i);
                let [low, high] = candidate.ranges[i];
                // A parameter that is no slope is as uncertain as it is large.
                let width = (high - low) / 12.0_f64.sqrt();
                let size = (self.begin[i] - p.null).abs();
                let other = if size > 0.0 { size.min(width) } else { width };
                Unknown {
                    parameter,
                    center: if slope.is_some() || size > 0.0 && p.null == low {
                        p.null
                    } else {
                        self.begin[i]
                    },
                    deviation: slope.map_or(other, |(_, d)| *d),
                    bounds: [low, high],
                    free,
                }
            })
            .collect()
    }
}

/// All candidates as columns of one regression, those of the present model's own unknowns first.
pub struct Columns {
    /// The linearisation, with its columns in units of the priors' deviations.
    pub linear: Vec<LinearEpisode>,
    /// Columns of the present model.
    pub base: usize,
    /// The ways to take the candidates.
    pub forms: Vec<Form>,
    /// Where the prior's center lies from the present point, in deviations; one a column.
    pub center: Vec<f64>,
    /// Bounds about the present point, in deviations.
    pub bounds: Vec<[f64; 2]>,
}

/// A context of some short parts of the logs, evenly spread, with the trajectory there.
fn parts<'c>(
    context: &'c Context<'_>,
    estimate: &Estimate,
    slopes_of: &[Vec<f64>],
) -> (Context<'c>, Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let layout = &context.plant().layout;
    let (nv, width) = (layout.nv, layout.nq + layout.nv);
    let rows: usize = context.walks.iter().map(|w| w.len()).sum();
    let every = (rows / PARTS).max(PART);
    let (mut walks, mut states, mut slopes) = (Vec::new(), Vec::new(), Vec::new());
    for (w, walk) in context.walks.iter().enumerate() {
        let mut first = 0;
        while first + 2 <= walk.len() {
            let range = first..(first + PART).min(walk.len());
            states.push(estimate.trajectory[w][range.start * width..range.end * width].to_vec());
            let own = range.start * 2 * nv * nv..(range.end - 1) * 2 * nv * nv;
            slopes.push(slopes_of[w][own].to_vec());
            walks.push(walk.part(range));
            first += every;
        }
    }
    let context = Context {
        machine: context.machine,
        logs: context.logs,
        given: vec![None; walks.len()],
        open: context.open.clone(),
        scale: context.scale.clone(),
        position_noise: context.position_noise.clone(),
        reading_variance: context.reading_variance.clone(),
        inertial: context.inertial.clone(),
        walks,
    };
    (context, states, slopes)
}

/// The present model with all candidates that need the engine at their nulls: effects, parameters and values.
#[derive(Clone)]
struct All<'c> {
    specs: Vec<EffectSpec>,
    parameters: Vec<Parameter>,
    theta: Vec<f64>,
    candidates: &'c [Candidate],
    /// First parameter of each candidate.
    first: Vec<usize>,
}

impl<'c> All<'c> {
    fn new(plant: &Plant, base: &Hypothesis, theta: &[f64], candidates: &'c [Candidate]) -> Self {
        let mut all = Self {
            specs: base.specs.clone(),
            parameters: base.parameters(),
            theta: theta.to_vec(),
            candidates,
            first: Vec::with_capacity(candidates.len()),
        };
        for c in candidates {
            all.first.push(all.theta.len());
            if is_traceable(plant, c) {
                continue;
            }
            all.specs.push(c.spec.clone());
            all.parameters
                .extend(c.unknowns().into_iter().map(|(p, _)| p));
            all.theta.extend(c.parameters().iter().map(|p| p.null));
        }
        all
    }

    /// All values with those of one candidate.
    fn with(&self, candidate: usize, values: &[f64]) -> Vec<f64> {
        let mut theta = self.theta.clone();
        let first = self.first[candidate];
        theta[first..first + values.len()].copy_from_slice(values);
        theta
    }
}

/// A column that is wanted: a candidate with some values, and what its change is divided by.
struct Wanted {
    candidate: usize,
    values: Vec<f64>,
    scale: f64,
}

impl Wanted {
    /// The slope of a candidate in a parameter about some values, over a step towards the inside of its range.
    fn slope(
        candidates: &[Candidate],
        c: usize,
        begin: &[f64],
        parameter: usize,
        step: f64,
    ) -> Self {
        let [_, high] = candidates[c].ranges[parameter];
        let mut values = begin.to_vec();
        let step = if values[parameter] + step <= high {
            step
        } else {
            -step
        };
        values[parameter] += step;
        Self {
            candidate: c,
            values,
            scale: step,
        }
    }
}

/// Columns of the present model with some candidates: those that need the engine from it, the others traced.
struct Source<'s> {
    all: All<'s>,
    /// Slopes in forces, one a walk.
    slopes: &'s [Vec<f64>],
    /// How late readings are in the present model.
    late: &'s [Vec<f64>],
}

impl Source<'_> {
    /// The columns wanted, `(rows - 1) x nx x m` and `rows x ns x m`, one pair a walk.
    fn columns(
        &self,
        context: &Context<'_>,
        states: &[Vec<f64>],
        wanted: &[Wanted],
    ) -> Result<Vec<(Vec<f64>, Vec<f64>)>> {
        let plant = context.plant();
        let (nv, m) = (plant.layout.nv, wanted.len());
        let (nx, ns) = (2 * nv, context.logs.entries.len());
        let traced = |w: &Wanted| is_traceable(plant, &self.all.candidates[w.candidate]);
        let by_engine: Vec<usize> = (0..m).filter(|&i| !traced(&wanted[i])).collect();
        let variations: Vec<Variation> = by_engine
            .iter()
            .map(|&i| Variation {
                theta: self.all.with(wanted[i].candidate, &wanted[i].values),
                scale: wanted[i].scale,
            })
            .collect();
        let mut out: Vec<(Vec<f64>, Vec<f64>)> = context
            .walks
            .iter()
            .map(|w| {
                let n = w.len();
                (vec![0.0; (n - 1) * nx * m], vec![0.0; n * ns * m])
            })
            .collect();
        if !variations.is_empty() {
            let own = variations.len();
            let mut map = context.map(&self.all.specs, &self.all.parameters, own + 1)?;
            let found = map.linearise(
                &self.all.theta,
                states,
                Derivatives::default(),
                &[],
                &variations,
            )?;
            for (w, mut linear) in found.into_iter().enumerate() {
                if let Some(late) = self.late.get(w).filter(|l| !l.is_empty()) {
                    let time = &context.walks[w].time;
                    retime_columns(&mut linear.reading_columns, time, late, own);
                }
                let spread = |from: &[f64], to: &mut [f64]| {
                    for (row, target) in from.chunks_exact(own).zip(to.chunks_exact_mut(m)) {
                        row.iter()
                            .zip(&by_engine)
                            .for_each(|(x, &i)| target[i] = *x);
                    }
                };
                spread(&linear.state_columns, &mut out[w].0);
                spread(&linear.reading_columns, &mut out[w].1);
            }
        }
        for (w, walk) in context.walks.iter().enumerate() {
            let b = &self.slopes[w];
            for (i, wanted) in wanted.iter().enumerate().filter(|(_, w)| traced(w)) {
                let candidate = &self.all.candidates[wanted.candidate];
                let forces = trace(plant, candidate, &wanted.values, walk, &states[w])?;
                for (k, force) in forces.chunks_exact(nv).enumerate() {
                    if force.iter().all(|x| *x == 0.0) {
                        continue;
                    }
                    for s in 0..nx {
                        let b = &b[(k * nx + s) * nv..(k * nx + s + 1) * nv];
                        let sum: f64 = b.iter().zip(force).map(|(x, y)| x * y).sum();
                        out[w].0[(k * nx + s) * m + i] = sum / wanted.scale;
                    }
                }
            }
        }
        Ok(out)
    }
}

/// Deviations of priors from what a trial step of each parameter does, for `(candidate, start, parameter)`; 0 where it does
/// nothing.
fn sizes(
    context: &Context<'_>,
    estimate: &Estimate,
    source: &Source<'_>,
    trials: &[(usize, Vec<f64>, usize)],
) -> Result<Vec<f64>> {
    let nv = context.plant().layout.nv;
    let (nx, ns) = (2 * nv, context.logs.entries.len());
    let (short, states, slopes) = parts(context, estimate, source.slopes);
    let candidates = source.all.candidates;
    let wanted: Vec<Wanted> = trials
        .iter()
        .map(|(c, begin, p)| {
            let [low, high] = candidates[*c].ranges[*p];
            Wanted::slope(candidates, *c, begin, *p, TRIAL * (high - low))
        })
        .collect();
    let m = wanted.len();
    let source = Source {
        all: source.all.clone(),
        slopes: &slopes,
        late: &[],
    };
    let columns = source.columns(&short, &states, &wanted)?;
    // A joint that neither moves nor lacks a force says nothing of sizes.
    let missing: Vec<f64> = estimate
        .force_quantile(nv, QUANTILE)
        .iter()
        .zip(&context.inertial)
        .map(|(w, inertial)| {
            if *inertial > SILENT {
                w.max(LEAST_MISSING * inertial)
            } else {
                f64::INFINITY
            }
        })
        .collect();
    let spread = spreads(context);
    let mut sums = vec![vec![0.0; nv]; m];
    let mut readings = vec![0.0; m];
    let (mut rows, mut count) = (0.0, 0.0);
    for ((walk, (states, read)), b) in short.walks.iter().zip(&columns).zip(&slopes) {
        for k in 0..walk.len() - 1 {
            let matrix = DMatrix::from_fn(nv, nv, |i, j| b[(k * nx + nv + i) * nv + j]);
            let factor = matrix.lu();
            let change = DMatrix::from_fn(nv, m, |d, i| states[(k * nx + nv + d) * m + i]);
            if let Some(force) = factor.solve(&change) {
                for (i, sums) in sums.iter_mut().enumerate() {
                    for (sum, f) in sums.iter_mut().zip(force.column(i).iter()) {
                        *sum += f * f;
                    }
                }
            }
            rows += 1.0;
        }
        for k in 0..walk.len() {
            for (s, spread) in spread.iter().enumerate() {
                for (i, sum) in readings.iter_mut().enumerate() {
                    *sum += (read[(k * ns + s) * m + i] / spread).powi(2);
                }
            }
            count += 1.0;
        }
    }
    Ok((0..m)
        .map(|i| {
            let acting = sums[i]
                .iter()
                .zip(&missing)
                .filter(|(s, f)| **s > 0.0 && f.is_finite());
            let active = acting.count().max(1) as f64;
            let ratio: f64 = sums[i]
                .iter()
                .zip(&missing)
                .map(|(s, f)| s / rows / (f * f))
                .sum();
            let by_force = (active / ratio).sqrt();
            let by_reading = READING_SHARE * (count / readings[i]).sqrt();
            let (c, _, p) = &trials[i];
            let [low, high] = candidates[*c].ranges[*p];
            let size = by_force.min(by_reading).min(0.5 * (high - low));
            let acts = ratio > 0.0 || readings[i] > 0.0;
            if acts && size.is_finite() { size } else { 0.0 }
        })
        .collect())
}

/// Two row-major matrices of `n` and `m` columns side by side.
fn beside(a: &[f64], n: usize, b: &[f64], m: usize) -> Vec<f64> {
    let rows = a.len().checked_div(n).unwrap_or(b.len() / m.max(1));
    let mut out = Vec::with_capacity(rows * (n + m));
    for k in 0..rows {
        out.extend_from_slice(&a[k * n..(k + 1) * n]);
        out.extend_from_slice(&b[k * m..(k + 1) * m]);
    }
    out
}

/// Spread of the readings of each entry.
fn spreads(context: &Context<'_>) -> Vec<f64> {
    let logs = context.logs;
    let mut out = Vec::with_capacity(logs.entries.len());
    let width = logs.width();
    let mut at = 0;
    for sensor in &logs.sensors {
        let own = logs
            .entries
            .iter()
            .filter(|e| logs.sensors[e.sensor].name == sensor.name)
            .count();
        let len = if sensor.rotation { 4 } else { own };
        for c in 0..own {
            let values: Vec<f64> = logs
                .episodes
                .iter()
                .flat_map(|e| e.readings.iter().skip(at + c).step_by(width).copied())
                .filter(|x| x.is_finite())
                .collect();
            let n = values.len().max(1) as f64;
            let mean = values.iter().sum::<f64>() / n;
            let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
            out.push(if sensor.rotation {
                1.0
            } else {
                variance.sqrt().max(sensor.noise)
            });
        }
        at += len;
    }
    out
}

impl Columns {
    /// Columns of a fitted model's unknowns and of all candidates, along its trajectory.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn of(
        context: &Context<'_>,
        (base, theta): (&Hypothesis, &[f64]),
        estimate: &Estimate,
        candidates: &[Candidate],
    ) -> Result<Self> {
        let plant = context.plant();
        let all = All::new(plant, base, theta, candidates);
        let free = base.free();
        let (mut center, mut bounds) = (Vec::new(), Vec::new());
        let variations: Vec<Variation> = free
            .iter()
            .map(|&i| {
                let u = &base.unknowns[i];
                let up = theta[i] + BASE_SHARE * u.deviation <= u.bounds[1];
                let share = if up { BASE_SHARE } else { -BASE_SHARE };
                let mut other = theta.to_vec();
                other[i] += share * u.deviation;
                center.push(-u.distance(theta[i]));
                bounds.push(u.bounds.map(|b| (b - theta[i]) / u.deviation));
                Variation {
                    theta: other,
                    scale: share,
                }
            })
            .collect();
        let nx = 2 * plant.layout.nv;
        let roles = 3 * nx + free.len() + 1;
        let mut map = context.map(&base.specs, &base.parameters(), roles)?;
        let want = Derivatives {
            state: true,
            ..Derivatives::default()
        };
        let mut linear = map.linearise(theta, &estimate.trajectory, want, &[], &variations)?;
        let late: Vec<Vec<f64>> = linear.iter().map(|l| l.late.clone()).collect();
        let source = Source {
            all,
            slopes: &estimate.b,
            late: &late,
        };
        // Every start of a candidate, with the slopes at it.
        let mut trials = Vec::new();
        for (c, candidate) in candidates.iter().enumerate() {
            for begin in &candidate.starts {
                trials.extend(
                    candidate
                        .slopes()
                        .into_iter()
                        .map(|p| (c, begin.clone(), p)),
                );
            }
        }
        let sizes = sizes(context, estimate, &source, &trials)?;
        let mut wanted = Vec::new();
        let mut forms = Vec::new();
        let mut next = 0;
        for (c, candidate) in candidates.iter().enumerate() {
            for begin in &candidate.starts {
                let first = free.len() + wanted.len();
                let mut slopes = Vec::new();
                if candidate.slopes().is_empty() {
                    wanted.push(Wanted {
                        candidate: c,
                        values: begin.clone(),
                        scale: 1.0,
                    });
                    center.push(0.0);
                    bounds.push([0.0, SECANT]);
                    slopes.push(None);
                }
                for p in candidate.slopes() {
                    let size = sizes[next];
                    next += 1;
                    if size <= 0.0 {
                        continue;
                    }
                    let mut slope = Wanted::slope(candidates, c, begin, p, SHARE * size);
                    slope.scale /= size;
                    wanted.push(slope);
                    let null = candidate.parameters()[p].null;
                    let [low, high] = candidate.ranges[p];
                    center.push(0.0);
                    bounds.push([
                        ((low - null) / size).max(-MOST),
                        ((high - null) / size).min(MOST),
                    ]);
                    slopes.push(Some((p, size)));
                }
                if !slopes.is_empty() {
                    forms.push(Form {
                        candidate: c,
                        begin: begin.clone(),
                        slopes,
                        first,
                    });
                }
            }
        }
        let found = source.columns(context, &estimate.trajectory, &wanted)?;
        let (base, more) = (free.len(), wanted.len());
        for (linear, (state, reading)) in linear.iter_mut().zip(&found) {
            linear.state_columns = beside(&linear.state_columns, base, state, more);
            linear.reading_columns = beside(&linear.reading_columns, base, reading, more);
        }
        Ok(Self {
            linear,
            base,
            forms,
            center,
            bounds,
        })
    }
}
