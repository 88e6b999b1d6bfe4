//! Effects as columns: the change of the model per unit of each effect along the smoothed
//! trajectory.
//!
//! A parameter that acts in proportion from its null on is a derivative, taken over a part of the
//! size that the missing force allows. A parameter without a derivative at its null (backlash, a
//! dead band, a limit) is a secant at each start value that its effect declares. Sizes come from
//! the logs: an effect may make up for forces as large as the missing ones, and for errors of
//! readings up to a part of their spread.

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

/// Step of the present model's derivatives, relative to a prior's standard deviation.
const BASE_SHARE: f64 = 0.01;
/// Step of the candidates' derivatives, relative to a prior's standard deviation: a plausible size,
/// so that a law that saturates shows how it acts.
const SHARE: f64 = 0.2;
/// Largest coefficient, in standard deviations of its prior.
const MOST: f64 = 3.0;
/// Largest coefficient of a secant, as a multiple of its start value.
pub const SECANT: f64 = 1.5;

/// Decides for each candidate whether it leads, from columns along a part of the segments.
pub type Leads<'l> = &'l dyn Fn(&Columns) -> Vec<bool>;

/// All candidates as columns of one regression, preceded by those of the present model's own
/// unknowns.
pub struct Columns {
    /// The linearisation, with its columns in units of the priors' standard deviations.
    pub linear: Vec<LinearEpisode>,
    /// Number of columns of the present model.
    pub base: usize,
    /// The ways to take the candidates.
    pub forms: Vec<Form>,
    /// Prior's center relative to the present point, in standard deviations; one per column.
    pub center: Vec<f64>,
    /// Bounds about the present point, in standard deviations.
    pub bounds: Vec<[f64; 2]>,
    /// Whether all candidates are included: those not reached when work was stopped contribute
    /// nothing.
    pub complete: bool,
}

/// Multiplies the priors' standard deviations of a form's derivatives by `factors`, and updates the
/// factors to those applied.
///
/// A standard deviation is at most half of its range. A secant has none.
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

/// Multiplies each of the columns by its factor.
fn multiply((states, readings): &mut Along, factors: &[f64]) {
    for rows in [states, readings] {
        for row in rows.chunks_exact_mut(factors.len().max(1)) {
            row.iter_mut().zip(factors).for_each(|(x, f)| *x *= f);
        }
    }
}

/// Returns the derivatives of the present model that are wanted, and the steps of their finite
/// differences.
///
/// Derivatives with respect to forces, at the same point, separate the columns of a group. Replays
/// of segments have none.
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

/// Returns the priors' standard deviations of some trials before their columns along replays are
/// known: fractions of the ranges.
fn sizes_by_range(candidates: &[Candidate], trials: &[Trial]) -> Vec<f64> {
    let size = |&(c, _, p): &Trial| {
        let [low, high] = candidates[c].ranges[p];
        REPLAY_TRIAL / SHARE * (high - low)
    };
    trials.iter().map(size).collect()
}

impl Columns {
    /// Computes the columns of a fitted model's unknowns and of all candidates along its
    /// trajectory.
    ///
    /// The trajectory is that of the first estimate. The missing force of the second one gives the
    /// widths of the candidates' priors.
    ///
    /// If the work is stopped, it includes only the candidates that there was time for. With many
    /// segments, all candidates are computed along a part of them. Those that lead there according
    /// to `leads` (one flag per candidate) are computed along the rest too; the others' columns are
    /// zero there.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn of(
        context: &Context<'_>,
        (base, theta): (&Hypothesis, &[f64]),
        (estimate, lacking): (&Estimate, &Estimate),
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
        let assigned = linear.iter_mut().map(|l| std::mem::take(&mut l.assigned));
        let assigned: Vec<_> = assigned.collect();
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
            assigned: &assigned,
            together: true,
            progress,
        };
        let trials = trials(candidates);
        let (sizes, felt) = if context.has_segments() {
            (sizes_by_range(candidates, &trials), true)
        } else {
            sizes(context, (estimate, lacking), &source, &trials)?
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
            let estimates = (estimate, lacking);
            factors = sizes_along((context, estimates), &linear, (&found, &first), more);
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
