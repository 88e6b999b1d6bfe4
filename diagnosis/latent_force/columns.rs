//! Effects as columns: what a unit of each adds to the model along the smoothed trajectory.
//!
//! A parameter that acts in proportion from its null on is a slope, taken over a part of the size that the
//! missing force allows it; one that has no slope there (play, a dead band, a limit) is a secant at each of the values
//! that the effect says a search begins with. Sizes come from the logs: an effect may make up for forces as large as
//! those that are missing, and for readings that are off by a part of their spread.

mod asked;
mod force_response;
mod form;
mod group;
mod in_part;
mod null_model;
mod sizes;
mod small_steps;
mod source;
mod together;

use asid_core::{Progress, Result};

use crate::candidate::Candidate;

use super::context::{Context, PUSH};
use super::estimate::Estimate;
use super::fit::Hypothesis;
use super::one_step::one_step_tells;
use super::step_error::beside;
use super::step_map::{Derivatives, LinearEpisode};

use asked::{Asked, Trial, bounds, trials};
use force_response::ForceSlopes;
pub use form::Form;
use in_part::Rest;
use null_model::{NullModel, Way};
use sizes::{REPLAY_TRIAL, sizes, sizes_along};
use small_steps::take_smaller_steps;
use source::{Along, Source};

/// Share of a deviation of the prior that slopes of the present model are taken over.
const BASE_SHARE: f64 = 0.01;
/// Share of a deviation of the prior that slopes are taken over: a plausible size, so that a law that saturates is seen
/// as it acts.
const SHARE: f64 = 0.2;
/// Most that a coefficient may be, in deviations of its prior.
const MOST: f64 = 3.0;
/// Secants may be taken up to this multiple of their start value.
pub const SECANT: f64 = 1.5;

/// Says of each candidate whether it leads, by columns along a part of the segments.
pub type Leads<'l> = &'l dyn Fn(&Columns) -> Vec<bool>;

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

/// Gives the slopes of a form other deviations of their priors, by factors of those that they have, which become those that were taken: a
/// deviation is at most half of its range, and a secant has none.
fn resize(
    form: &mut Form,
    candidates: &[Candidate],
    (factors, base): (&mut [f64], usize),
    all_bounds: &mut [[f64; 2]],
) {
    let columns = form.columns();
    for (column, slope) in columns.zip(&mut form.slopes) {
        let factor = &mut factors[column - base];
        let Some((p, size)) = slope else {
            *factor = 1.0;
            continue;
        };
        let candidate = &candidates[form.candidate];
        let [low, high] = candidate.limits(*p);
        *factor = factor.min(0.5 * (high - low) / *size);
        *size *= *factor;
        all_bounds[column] = bounds(candidate, *p, *size);
    }
}

/// Multiplies each of `m` columns.
fn multiply((states, readings): &mut Along, factors: &[f64]) {
    for rows in [states, readings] {
        for row in rows.chunks_exact_mut(factors.len().max(1)) {
            row.iter_mut().zip(factors).for_each(|(x, f)| *x *= f);
        }
    }
}

/// What the linearisation of the present model has to tell, and the steps of the states that it is taken with. Columns are told
/// apart by slopes in forces at the very point that they are taken at; replays of segments have none.
fn slopes_wanted(context: &Context<'_>) -> (Derivatives, Vec<f64>) {
    let replayed = context.has_segments();
    let want = Derivatives {
        state: true,
        force: !replayed,
        jolt: !replayed,
    };
    let steps = if replayed {
        context.start_steps()
    } else {
        vec![PUSH; context.plant().layout.nv]
    };
    (want, steps)
}

/// Deviations of the priors of some trials where segments are replayed, before their columns are known: shares of the ranges.
fn sizes_by_range(candidates: &[Candidate], trials: &[Trial]) -> Vec<f64> {
    let size = |&(c, _, p): &Trial| {
        let [low, high] = candidates[c].ranges[p];
        REPLAY_TRIAL / SHARE * (high - low)
    };
    trials.iter().map(size).collect()
}

impl Columns {
    /// Columns of a fitted model's unknowns and of all candidates, along its trajectory; of those that there is time for where
    /// the work is stopped. Where there are many segments, the columns of those that `leads` says lead on a part of them
    /// (one flag a candidate), and the others' are zero elsewhere.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn of(
        context: &Context<'_>,
        (base, theta): (&Hypothesis, &[f64]),
        estimate: &Estimate,
        (candidates, leads): (&[Candidate], Leads<'_>),
        progress: &dyn Progress,
    ) -> Result<Self> {
        let model = |way| {
            let model = NullModel::new(context, (base, theta), candidates, way);
            (way, model)
        };
        let models = [Way::OneStep, Way::WholeRow].map(model);
        let (mut asked, variations) = Asked::of_model(base, theta);
        let roles = 8 * context.plant().layout.nv + asked.base + 1;
        let mut map = context.map(&base.specs, &base.parameters(), roles)?;
        let model = (&base.specs[..], &base.parameters()[..]);
        map.by_one_step(one_step_tells(
            context,
            model,
            (theta, &estimate.trajectory),
        )?);
        let (want, steps) = slopes_wanted(context);
        let mut linear = map.linearise(theta, &estimate.trajectory, want, &steps, &variations)?;
        context.step_error.join(&mut linear, asked.base);
        asked.add_step_error(&context.step_error);
        let late: Vec<Vec<f64>> = linear.iter().map(|l| l.late.clone()).collect();
        let slopes = linear.iter_mut().map(ForceSlopes::take);
        let slopes: Vec<ForceSlopes> = slopes.collect();
        let carried: Vec<Vec<f64>> = linear
            .iter_mut()
            .map(|l| std::mem::take(&mut l.carried))
            .collect();
        let one_step = carried.iter().all(|c| !c.is_empty());
        let source = Source {
            candidates,
            replayed: context.has_segments(),
            models: &models,
            carried: if one_step { &carried } else { &[] },
            slopes: &slopes,
            late: &late,
            together: true,
            progress,
        };
        let trials = trials(candidates);
        let (sizes, felt) = if context.has_segments() {
            (sizes_by_range(candidates, &trials), true)
        } else {
            sizes(context, estimate, &source, &trials)?
        };
        asked.add(candidates, &sizes, context.has_segments());
        let [first, others] = in_part::parts(context);
        let along = (context, &estimate.trajectory[..]);
        let mut wanted = std::mem::take(&mut asked.wanted);
        let (mut found, mut walked) = in_part::along(&source, along, &wanted, &first)?;
        if context.has_segments() && walked {
            let steps = (&mut wanted[..], &asked.begins()[..]);
            walked = take_smaller_steps(&source, along, steps, (&mut found, &first))?;
        }
        let Asked {
            center,
            mut bounds,
            base,
            mut forms,
            ..
        } = asked;
        let more = wanted.len();
        let mut factors = vec![1.0; more];
        if context.has_segments() {
            factors = sizes_along((context, estimate), &linear, (&found, &first), more);
            for form in &mut forms {
                resize(form, candidates, (&mut factors, base), &mut bounds);
            }
            found.iter_mut().for_each(|f| multiply(f, &factors));
        }
        for (linear, (state, reading)) in linear.iter_mut().zip(&found) {
            linear.state_columns = beside(&linear.state_columns, base, state, more);
            linear.reading_columns = beside(&linear.reading_columns, base, reading, more);
        }
        let mut columns = Self {
            linear,
            base,
            forms,
            center,
            bounds,
            complete: felt && walked,
        };
        if columns.complete && !others.is_empty() {
            let rest = Rest {
                source: &source,
                wanted: &wanted,
                factors: &factors,
                which: &others,
            };
            let leads = leads(&columns);
            columns.add_rest(along, &rest, &leads)?;
        }
        Ok(columns)
    }
}
