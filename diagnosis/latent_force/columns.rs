//! Effects as columns: what a unit of each adds to the model along the smoothed trajectory.
//!
//! A parameter that acts in proportion from its null on is a slope, taken over a part of the size that the
//! missing force allows it; one that has no slope there (play, a dead band, a limit) is a secant at each of the values
//! that the effect says a search begins with. Sizes come from the logs: an effect may make up for forces as large as
//! those that are missing, and for readings that are off by a part of their spread.

mod force_response;
mod form;
mod group;
mod null_model;
mod sizes;
mod source;
mod together;

use asid_core::{Progress, Result};

use crate::candidate::Candidate;

use super::context::{Context, PUSH};
use super::estimate::Estimate;
use super::fit::Hypothesis;
use super::step_map::{Derivatives, LinearEpisode, Variation};

use force_response::ForceSlopes;
pub use form::Form;
use null_model::All;
use sizes::{REPLAY_TRIAL, sizes, sizes_by_replay};
use source::{Source, Wanted};

/// Share of a deviation of the prior that slopes of the present model are taken over.
const BASE_SHARE: f64 = 0.01;
/// Share of a deviation of the prior that slopes are taken over: a plausible size, so that a law that saturates is seen
/// as it acts.
const SHARE: f64 = 0.2;
/// Most that a coefficient may be, in deviations of its prior.
const MOST: f64 = 3.0;
/// Secants may be taken up to this multiple of their start value.
pub const SECANT: f64 = 1.5;

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
    /// Whether all candidates are there: those that work was stopped before add nothing.
    pub complete: bool,
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

/// Gives the slopes of a form other deviations of their priors, relative to those that they have.
fn resize(
    form: &mut Form,
    candidates: &[Candidate],
    (factors, base): (&[f64], usize),
    found: &mut [(Vec<f64>, Vec<f64>)],
    bounds: &mut [[f64; 2]],
) {
    let m = factors.len();
    let columns = form.columns();
    for (column, slope) in columns.zip(&mut form.slopes) {
        let Some((p, size)) = slope else { continue };
        let candidate = &candidates[form.candidate];
        let [low, high] = candidate.ranges[*p];
        let null = candidate.parameters()[*p].null;
        let most = 0.5 * (high - low) / *size;
        let factor = factors[column - base].min(most);
        *size *= factor;
        bounds[column] = [
            ((low - null) / *size).max(-MOST),
            ((high - null) / *size).min(MOST),
        ];
        for (states, readings) in found.iter_mut() {
            for all in [states, readings] {
                all.iter_mut()
                    .skip(column - base)
                    .step_by(m)
                    .for_each(|x| *x *= factor);
            }
        }
    }
}

impl Columns {
    /// Columns of a fitted model's unknowns and of all candidates, along its trajectory; of those that there is time for where
    /// the work is stopped.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn of(
        context: &Context<'_>,
        (base, theta): (&Hypothesis, &[f64]),
        estimate: &Estimate,
        candidates: &[Candidate],
        progress: &dyn Progress,
    ) -> Result<Self> {
        let all = All::new(context, base, theta, candidates);
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
        let nv = context.plant().layout.nv;
        let roles = 8 * nv + free.len() + 1;
        let mut map = context.map(&base.specs, &base.parameters(), roles)?;
        let replayed = context.has_segments();
        let want = Derivatives {
            state: true,
            // Columns are told apart by slopes in forces at the very point that they are taken at.
            force: !replayed,
            jolt: !replayed,
        };
        let push = if replayed {
            context.start_steps()
        } else {
            vec![PUSH; nv]
        };
        let mut linear = map.linearise(theta, &estimate.trajectory, want, &push, &variations)?;
        let late: Vec<Vec<f64>> = linear.iter().map(|l| l.late.clone()).collect();
        let slopes = linear.iter_mut().map(ForceSlopes::take);
        let slopes: Vec<ForceSlopes> = slopes.collect();
        let source = Source {
            all,
            slopes: &slopes,
            late: &late,
            together: true,
            progress,
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
        let (sizes, felt) = if replayed {
            let range = |&(c, _, p): &(usize, Vec<f64>, usize)| {
                let [low, high]: [f64; 2] = candidates[c].ranges[p];
                high - low
            };
            let range = |t| REPLAY_TRIAL / SHARE * range(t);
            (trials.iter().map(range).collect(), true)
        } else {
            sizes(context, estimate, &source, &trials)?
        };
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
        let (mut found, walked) = source.columns(context, &estimate.trajectory, &wanted)?;
        let (base, more) = (free.len(), wanted.len());
        if replayed {
            let sizes = sizes_by_replay(context, estimate, &found, more);
            for form in &mut forms {
                resize(form, candidates, (&sizes, base), &mut found, &mut bounds);
            }
        }
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
            complete: felt && walked,
        })
    }
}
