//! Fit of a model with given effects: values, noise and trajectory, with the evidence.
//!
//! Each round linearises anew about the smoothed trajectory, until the evidence stops rising. A
//! correct effect makes the missing force small. So that the evidence can show this, each round
//! maximises it over common scales of `q`.

mod course;
mod extent;
mod kept_columns;
mod own_steps;
mod regression;
mod secant;
mod slopes;
mod wander;
mod watchdog;

use asid_core::{Parameter, Progress, Result};
use asid_effects::EffectSpec;
use nalgebra::DMatrix;

use super::context::Context;
use super::estimate::Estimate;
use super::fitted_value::Unknown;
use super::scales::settled;
use super::step_map::{Derivatives, LinearEpisode, StepMap};

use course::Course;
pub use extent::Extent;
pub use own_steps::OwnSteps;
use regression::{Compared, compare, in_units, prior_of, shift, variations};
pub use regression::{SCALES, regression, regression_at};
pub use slopes::Slopes;
use wander::wander;
use watchdog::Watchdog;

/// Largest step of a value, in standard deviations of its prior: beyond it, the linearisation does
/// not hold.
const LARGEST_STEP: f64 = 1.0;
/// Rounds of EM between two linearisations.
const EM_ROUNDS: usize = 4;
/// Additional smoothings between two steps of the values where readings have memory: the derivative
/// of such a reading with respect to past states is right to first order only.
const AGAIN: usize = 2;
/// Evidence by which derivatives taken elsewhere may overstate a model: rivals no farther apart
/// than this are all fitted to the end.
const MISLED: f64 = 20.0;
/// Change of evidence below which nothing counts as a rise. With segments it is the change per
/// segment, and grows with the square root of their number, as independent errors do.
const RISE: f64 = 0.5;

/// A model: the study's parameters and effects, with priors.
#[derive(Clone, Debug, Default)]
pub struct Hypothesis {
    /// Effects at their sites.
    pub specs: Vec<EffectSpec>,
    /// The study's parameters, then those of the effects.
    pub unknowns: Vec<Unknown>,
}

impl Hypothesis {
    /// Returns its parameters, as columns of a batch.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        self.unknowns.iter().map(|u| u.parameter.clone()).collect()
    }

    /// Returns the indices of the values that are fitted.
    #[must_use]
    pub fn free(&self) -> Vec<usize> {
        (0..self.unknowns.len())
            .filter(|&i| self.unknowns[i].free)
            .collect()
    }
}

/// A fitted model.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The model.
    pub hypothesis: Hypothesis,
    /// Values of all its unknowns.
    pub theta: Vec<f64>,
    /// Natural logarithm of its marginal likelihood.
    pub evidence: f64,
    /// Median difference between the evidence and the best, over the linearisations that did not
    /// raise it.
    ///
    /// The derivatives of a segment differ about each initial state with equally small residuals,
    /// and so does the evidence. Zero where there are no segments.
    pub wander: f64,
    /// Gain of evidence that a further step of the values predicts, to first order.
    pub promised: f64,
    /// Posterior covariance of the fitted values, in their units.
    pub covariance: DMatrix<f64>,
    /// Posterior mean of each fitted value by the last linearisation, relative to the value, in its
    /// units; 0 once the fit has converged.
    pub ahead: Vec<f64>,
    /// Trajectory, force and noise.
    pub estimate: Estimate,
    /// Derivatives with respect to the state, with which fits of similar models begin.
    pub slopes: Slopes,
}

/// Returns the change of evidence (natural logarithm) below which nothing counts as a rise.
#[must_use]
pub fn rise(context: &Context<'_>) -> f64 {
    let segments = context.walks.iter().filter(|w| w.segment.is_some()).count();
    RISE * (segments.max(1) as f64).sqrt()
}

/// Fits a model, starting from given values, an estimate and the derivatives of a similar model.
///
/// `extent` limits the fit. If the work is stopped, the result rests on the linearisations so far,
/// at least one.
///
/// # Errors
/// When a value is not physical or the engine fails.
pub fn fit<'p>(
    context: &Context<'_>,
    hypothesis: &Hypothesis,
    theta: &[f64],
    (estimate, slopes): (&Estimate, &Slopes),
    extent: impl Into<Extent<'p>>,
) -> Result<Fitted> {
    let extent = extent.into();
    let (rounds, progress) = (extent.rounds, extent.progress);
    let unknowns = &hypothesis.unknowns;
    let free = hypothesis.free();
    let m = free.len();
    let nx = 2 * context.plant().layout.nv;
    let mut map = context.map(&hypothesis.specs, &hypothesis.parameters(), 2 * nx + m + 1)?;
    let steps = context.start_steps();
    let mut theta = theta.to_vec();
    let mut estimate = estimate.clone();
    let mut slopes = slopes.begun();
    let has_segments = context.has_segments();
    let rise = rise(context);
    let mut watchdog = Watchdog::new(rise, has_segments);
    let mut course = Course::default();
    for round in 0..rounds.max(1) {
        let variations = variations(unknowns, &free, &theta);
        let mut linear = slopes.linearise(
            (context, &mut map),
            (&theta, hypothesis),
            &estimate,
            &variations,
        )?;
        context.step_error.join(&mut linear, m);
        let model = (&unknowns[..], &free[..], &theta[..]);
        let whole = round == 0 || has_segments;
        if round == 0 && extent.settles {
            let (center, bounds) = prior_of(context, model);
            let all: Vec<usize> = (0..center.len()).collect();
            estimate = settled(context, &estimate, (&linear, &all), (&center, &bounds));
        }
        let Some(compared) = compare(context, &estimate, &linear, model, whole) else {
            break;
        };
        let (here, promised) = (compared.here, compared.promised);
        estimate.rescale(compared.scale);
        let is_own = !has_segments && slopes.are_own();
        let outcome = watchdog.look((here, promised), course.before(here, is_own));
        course.add(here, is_own, || {
            fitted_at(hypothesis, (&theta, &estimate), &compared)
        });
        let stands = round > 0 && !outcome.rose && promised < rise;
        if stands && round + 1 < rounds && !progress.is_stopped() && slopes.renew_columns() {
            // Kept columns can make a fit look converged by mistake.
            continue;
        }
        let ends = stands || extent.is_out_of_reach(course.reached(), promised);
        let is_last = round + 1 == rounds || progress.is_stopped();
        if ends || is_last || watchdog.is_out_of_steps() && !outcome.rose {
            break;
        }
        if outcome.astray {
            let Some(shorter) = watchdog.shorter(context) else {
                break;
            };
            (theta, estimate) = shorter;
            let before = estimate.trajectory.clone();
            estimate.roll(context, &mut map, &theta, (&before, &[]))?;
            continue;
        }
        let from = outcome.rose.then(|| (theta.clone(), estimate.clone()));
        let moves = step(unknowns, &free, &compared.found.coefficients, &mut theta);
        shift(&mut linear, &moves);
        smooth(context, &mut map, &theta, (&linear, &steps), &mut estimate)?;
        if let Some(from) = from {
            watchdog.anchor(&outcome, from, (theta.clone(), estimate.clone()));
        }
    }
    let none_finite = || asid_core::Error::Failed("no round of the fit was finite".into());
    let wander = if has_segments {
        wander(course.all(), rise)
    } else {
        0.0
    };
    let best = course.best().ok_or_else(none_finite)?;
    let best = Fitted {
        slopes,
        wander,
        ..best
    };
    Ok(best)
}

/// Assembles the fitted model at given values and an estimate, from the result of a comparison
/// there.
fn fitted_at(
    hypothesis: &Hypothesis,
    (theta, estimate): (&[f64], &Estimate),
    compared: &Compared,
) -> Fitted {
    let (unknowns, free) = (&hypothesis.unknowns, hypothesis.free());
    Fitted {
        hypothesis: hypothesis.clone(),
        theta: theta.to_vec(),
        evidence: compared.here,
        wander: 0.0,
        promised: compared.promised,
        covariance: in_units(&compared.found.covariance, unknowns, &free),
        ahead: ahead(&compared.found.coefficients, unknowns, &free),
        estimate: estimate.clone(),
        slopes: Slopes::default(),
    }
}

/// Returns the moves of the free values that coefficients stand for, in the values' units, limited
/// to the largest step.
fn ahead(coefficients: &[f64], unknowns: &[Unknown], free: &[usize]) -> Vec<f64> {
    let pairs = coefficients.iter().zip(free);
    pairs
        .map(|(c, &i)| c.clamp(-LARGEST_STEP, LARGEST_STEP) * unknowns[i].deviation)
        .collect()
}

/// Moves the free values by coefficients in standard deviations of their priors, within their
/// bounds and the largest step.
///
/// Returns the moves, followed by the coefficient of the engine's own error, which has no largest
/// step.
fn step(unknowns: &[Unknown], free: &[usize], coefficients: &[f64], theta: &mut [f64]) -> Vec<f64> {
    let mut moves = coefficients.to_vec();
    for by in moves.iter_mut().take(free.len()) {
        *by = by.clamp(-LARGEST_STEP, LARGEST_STEP);
    }
    for (by, &i) in moves.iter().zip(free) {
        let [low, high] = unknowns[i].bounds;
        theta[i] = (theta[i] + by * unknowns[i].deviation).clamp(low, high);
    }
    moves
}

/// Smooths the logs again after a step of the values.
///
/// It smooths once about the shifted linearisation. Where readings have memory, it then smooths
/// about new linearisations.
fn smooth(
    context: &Context<'_>,
    map: &mut StepMap<'_>,
    theta: &[f64],
    (linear, steps): (&[LinearEpisode], &[f64]),
    estimate: &mut Estimate,
) -> Result<()> {
    let want = Derivatives {
        state: true,
        ..Derivatives::default()
    };
    let before = estimate.trajectory.clone();
    let followed = estimate.read_as(context, map, theta)?;
    estimate.improve(context, linear, EM_ROUNDS);
    estimate.roll(context, map, theta, (&before, &followed))?;
    let again = map.remembers_readings() && !map.is_all_segments();
    for _ in 0..if again { AGAIN } else { 0 } {
        let linear = map.linearise(theta, &estimate.trajectory, want, steps, &[])?;
        let before = estimate.trajectory.clone();
        estimate.improve(context, &linear, 1);
        estimate.roll(context, map, theta, (&before, &[]))?;
    }
    Ok(())
}

/// Moves an estimate to a model whose values differ by `changes`, one per column of a linearisation
/// about the estimate.
///
/// The initial states of segments move with the values, as they do in each step of a fit.
///
/// # Errors
/// When a value is not physical or the engine fails.
pub fn taken_along(
    context: &Context<'_>,
    (hypothesis, theta): (&Hypothesis, &[f64]),
    (linear, changes): (&[LinearEpisode], &[f64]),
    estimate: &Estimate,
) -> Result<Estimate> {
    let nx = 2 * context.plant().layout.nv;
    let mut map = context.map(&hypothesis.specs, &hypothesis.parameters(), 2 * nx + 1)?;
    let mut linear = linear.to_vec();
    shift(&mut linear, changes);
    let mut estimate = estimate.clone();
    let steps = context.start_steps();
    smooth(context, &mut map, theta, (&linear, &steps), &mut estimate)?;
    Ok(estimate)
}

/// Smooths the logs under a model for the first time: alternates linearisation and EM for up to
/// `rounds` rounds.
///
/// Returns the last derivatives.
///
/// # Errors
/// When the engine fails.
pub fn settle_noise(
    context: &Context<'_>,
    hypothesis: &Hypothesis,
    theta: &[f64],
    estimate: &mut Estimate,
    (rounds, em_rounds): (usize, usize),
    progress: &dyn Progress,
) -> Result<Slopes> {
    let nx = 2 * context.plant().layout.nv;
    let mut map = context.map(&hypothesis.specs, &hypothesis.parameters(), 2 * nx + 1)?;
    let mut slopes = Slopes::default();
    for round in 0..rounds {
        if round > 0 && progress.is_stopped() {
            break;
        }
        let linear = slopes.linearise((context, &mut map), (theta, hypothesis), estimate, &[])?;
        let before = estimate.trajectory.clone();
        estimate.improve(context, &linear, em_rounds);
        estimate.roll(context, &mut map, theta, (&before, &[]))?;
    }
    Ok(slopes)
}
