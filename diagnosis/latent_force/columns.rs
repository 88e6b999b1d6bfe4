//! Effects as columns: what a unit of each adds to the model along the smoothed trajectory.
//!
//! A parameter that acts in proportion from its null on is a slope, taken over a part of the size that the
//! missing force allows it; one that has no slope there (play, a dead band, a limit) is a secant at each of the values
//! that the effect says a search begins with. Sizes come from the logs: an effect may make up for forces as large as
//! those that are missing, and for readings that are off by a part of their spread.

use asid_core::{Parameter, Result};
use asid_effects::{Acts, EffectSpec, Start};
use nalgebra::{DMatrix, DVector};

use crate::candidate::Candidate;

use super::estimate::{Context, Estimate};
use super::fit::Hypothesis;
use super::step_map::{Derivatives, LinearEpisode, Variation};
use super::unknown::Unknown;

/// Share of a parameter's range over which its size is first felt for.
const TRIAL: f64 = 1e-5;
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

/// Solves for the generalized force that makes a change of speeds in row `k`.
fn force_of(b: &[f64], nv: usize, k: usize, change: impl Fn(usize) -> f64) -> Option<DVector<f64>> {
    let nx = 2 * nv;
    let slopes = DMatrix::from_fn(nv, nv, |i, j| b[(k * nx + nv + i) * nv + j]);
    slopes.lu().solve(&DVector::from_fn(nv, |i, _| change(i)))
}

/// A context of some short parts of the logs, evenly spread, with the trajectory there.
fn parts<'c>(context: &'c Context<'_>, estimate: &Estimate) -> (Context<'c>, Vec<Vec<f64>>, Vec<Vec<f64>>) {
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
            let b = range.start * 2 * nv * nv..(range.end - 1) * 2 * nv * nv;
            slopes.push(estimate.b[w][b].to_vec());
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

/// The present model with all candidates at their nulls: effects, parameters and values.
struct All<'c> {
    specs: Vec<EffectSpec>,
    parameters: Vec<Parameter>,
    theta: Vec<f64>,
    candidates: &'c [Candidate],
    /// First parameter of each candidate.
    first: Vec<usize>,
}

impl<'c> All<'c> {
    fn new(base: &Hypothesis, theta: &[f64], candidates: &'c [Candidate]) -> Self {
        let mut all = Self {
            specs: base.specs.clone(),
            parameters: base.parameters(),
            theta: theta.to_vec(),
            candidates,
            first: Vec::with_capacity(candidates.len()),
        };
        for c in candidates {
            all.first.push(all.theta.len());
            all.specs.push(c.spec.clone());
            all.parameters.extend(c.unknowns().into_iter().map(|(p, _)| p));
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

    /// Values of a candidate with one parameter moved by `step`, towards the inside of its range.
    fn moved(&self, candidate: usize, begin: &[f64], parameter: usize, step: f64) -> (Vec<f64>, f64) {
        let [_, high] = self.candidates[candidate].ranges[parameter];
        let mut values = begin.to_vec();
        let step = if values[parameter] + step <= high { step } else { -step };
        values[parameter] += step;
        (self.with(candidate, &values), step)
    }
}

/// Deviations of priors from what a trial step of each parameter does: `(candidate, start, parameter)` to deviation;
/// 0 where it does nothing.
fn sizes(
    context: &Context<'_>,
    estimate: &Estimate,
    all: &All<'_>,
    trials: &[(usize, Vec<f64>, usize)],
) -> Result<Vec<f64>> {
    let nv = context.plant().layout.nv;
    let ns = context.logs.entries.len();
    let (short, states, slopes) = parts(context, estimate);
    let mut steps = Vec::with_capacity(trials.len());
    let variations: Vec<Variation> = trials
        .iter()
        .map(|(c, begin, p)| {
            let [low, high] = all.candidates[*c].ranges[*p];
            let (theta, step) = all.moved(*c, begin, *p, TRIAL * (high - low));
            steps.push(step);
            Variation { theta, scale: step }
        })
        .collect();
    let m = variations.len();
    let mut map = short.map(&all.specs, &all.parameters, m + 1)?;
    let linear = map.linearise(&all.theta, &states, Derivatives::default(), &[], &variations)?;
    let missing: Vec<f64> = estimate
        .force_quantile(nv, QUANTILE)
        .iter()
        .zip(&context.inertial)
        .map(|(w, inertial)| w.max(LEAST_MISSING * inertial))
        .collect();
    let spread = spreads(context);
    let mut out = Vec::with_capacity(m);
    for (i, (c, _, p)) in trials.iter().enumerate() {
        let mut sums = vec![0.0; nv];
        let mut readings = 0.0;
        let (mut rows, mut count) = (0.0, 0.0);
        for (episode, b) in linear.iter().zip(&slopes) {
            for k in 0..episode.rows - 1 {
                let at = |s: usize| episode.state_columns[(k * 2 * nv + s) * m + i];
                if let Some(force) = force_of(b, nv, k, |d| at(nv + d)) {
                    for (sum, f) in sums.iter_mut().zip(force.iter()) {
                        *sum += f * f;
                    }
                }
                rows += 1.0;
            }
            for k in 0..episode.rows {
                for s in 0..ns {
                    let change = episode.reading_columns[(k * ns + s) * m + i];
                    readings += (change / spread[s]).powi(2);
                    count += 1.0;
                }
            }
        }
        let active = sums.iter().filter(|s| **s > 0.0).count().max(1) as f64;
        let ratio: f64 = sums
            .iter()
            .zip(&missing)
            .map(|(s, f)| s / rows / (f * f))
            .sum();
        let by_force = (active / ratio).sqrt();
        let by_reading = READING_SHARE * (count / ns as f64 / readings).sqrt();
        let [low, high] = all.candidates[*c].ranges[*p];
        let size = by_force.min(by_reading).min(0.5 * (high - low));
        let acts = sums.iter().any(|s| *s > 0.0) || readings > 0.0;
        let null = all.candidates[*c].effect.acts();
        let _ = matches!(null, Acts::Measurement);
        out.push(if acts && size.is_finite() { size } else { 0.0 });
    }
    Ok(out)
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
            out.push(if sensor.rotation { 1.0 } else { variance.sqrt().max(sensor.noise) });
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
        let all = All::new(base, theta, candidates);
        // Every start of a candidate, with the slopes at it.
        let mut trials = Vec::new();
        for (c, candidate) in candidates.iter().enumerate() {
            for begin in &candidate.starts {
                trials.extend(candidate.slopes().into_iter().map(|p| (c, begin.clone(), p)));
            }
        }
        let sizes = sizes(context, estimate, &all, &trials)?;
        let (mut variations, mut center, mut bounds) = (Vec::new(), Vec::new(), Vec::new());
        let free = base.free();
        for &i in &free {
            let u = &base.unknowns[i];
            let up = theta[i] + 0.01 * u.deviation <= u.bounds[1];
            let share = if up { 0.01 } else { -0.01 };
            let mut other = all.theta.clone();
            other[i] += share * u.deviation;
            variations.push(Variation {
                theta: other,
                scale: share,
            });
            center.push(-u.distance(theta[i]));
            bounds.push(u.bounds.map(|b| (b - theta[i]) / u.deviation));
        }
        let mut forms = Vec::new();
        let mut next = 0;
        for (c, candidate) in candidates.iter().enumerate() {
            for begin in &candidate.starts {
                let first = variations.len();
                let mut slopes = Vec::new();
                if candidate.slopes().is_empty() {
                    variations.push(Variation {
                        theta: all.with(c, begin),
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
                    let (theta, step) = all.moved(c, begin, p, SHARE * size);
                    variations.push(Variation {
                        theta,
                        scale: step / size,
                    });
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
        let nx = 2 * context.plant().layout.nv;
        let mut map = context.map(&all.specs, &all.parameters, variations.len() + 2 * nx + 1)?;
        let want = Derivatives {
            state: true,
            force: false,
        };
        let linear = map.linearise(&all.theta, &estimate.trajectory, want, &[], &variations)?;
        Ok(Self {
            linear,
            base: free.len(),
            forms,
            center,
            bounds,
        })
    }
}
