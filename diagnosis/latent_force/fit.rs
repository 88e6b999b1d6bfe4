//! A model with some effects, fitted: its values, the noise and the trajectory, with the evidence.
//!
//! Everything is linearised anew about the smoothed trajectory until the evidence stands. An effect that is right
//! makes the missing force small: each round the evidence is compared over common scales of `q`, so that it is seen.

mod slopes;

use asid_core::{Parameter, Progress, Result};
use asid_effects::EffectSpec;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::context::Context;
use super::estimate::Estimate;
use super::evidence::{Evidence, evidence};
use super::fitted_value::Unknown;
use super::smoother::{Regression, regress};
use super::step_map::{Derivatives, LinearEpisode, Variation};

pub use slopes::Slopes;

/// Common factors of `q` at which models are compared.
pub const SCALES: [f64; 6] = [1.0, 0.3, 0.1, 0.03, 0.01, 0.003];
/// Share of a prior's deviation that a slope is taken over.
const SLOPE_STEP: f64 = 0.01;
/// Largest step of a value, in deviations of its prior: a tangent reaches no further.
const LARGEST_STEP: f64 = 1.0;
/// Part of a step that is tried where the whole made things worse.
const SHORTER: f64 = 0.3;
/// Rounds of EM between two linearisations.
const EM_ROUNDS: usize = 4;
/// Further smoothings between two steps of the values where readings remember: their slope in the past of the state is
/// right to first order only.
const AGAIN: usize = 2;
/// Evidence that no longer counts as a rise.
const RISE: f64 = 0.5;
/// Rounds without a rise that are gone on with (a watchdog: Chamberlain and others 1982), for a narrow valley bends away
/// from its tangent, and how often a shorter step is tried after that.
const PATIENCE: usize = 2;
const FAILURES: usize = 2;

/// A model: the study's parameters and effects, with priors.
#[derive(Clone, Debug, Default)]
pub struct Hypothesis {
    /// Effects at their sites.
    pub specs: Vec<EffectSpec>,
    /// The study's parameters, then those of the effects.
    pub unknowns: Vec<Unknown>,
}

impl Hypothesis {
    /// Its parameters, as columns of a batch.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        self.unknowns.iter().map(|u| u.parameter.clone()).collect()
    }

    /// Places of the values that are fitted.
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
    /// All its values.
    pub theta: Vec<f64>,
    /// Logarithm of its marginal likelihood, natural.
    pub evidence: f64,
    /// What a further step of the values promises, to first order.
    pub promised: f64,
    /// Posterior covariance of the fitted values, in their units.
    pub covariance: DMatrix<f64>,
    /// Trajectory, force and noise.
    pub estimate: Estimate,
    /// Slopes in the state, with which fits of like models begin.
    pub slopes: Slopes,
}

/// The regression of all walks.
pub fn regression(
    context: &Context<'_>,
    estimate: &Estimate,
    linear: &[LinearEpisode],
    scale: f64,
    m: usize,
) -> Regression {
    let starts = context.starts(&estimate.trajectory);
    let parts: Vec<Regression> = estimate
        .problems(context, linear, &starts)
        .enumerate()
        .map(|(w, p)| regress(p, &estimate.noise_along(context, w, scale), m))
        .collect();
    let mut sum = Regression {
        log_likelihood: 0.0,
        gram: DMatrix::zeros(m, m),
        moment: DVector::zeros(m),
    };
    parts.iter().for_each(|p| sum.add(p));
    sum
}

/// Half the logarithm of the determinant of the posterior covariance, in units of the prior.
fn determinant_of(found: &Evidence) -> f64 {
    let factor = found.covariance.clone().cholesky();
    factor.map_or(0.0, |c| c.l_dirty().diagonal().iter().map(|x| x.ln()).sum())
}

/// Moves a linearisation by changes of the values that its columns are for.
fn shift(linear: &mut [LinearEpisode], changes: &[f64]) {
    let m = changes.len();
    if m == 0 {
        return;
    }
    let sum = |row: &[f64]| -> f64 { row.iter().zip(changes).map(|(c, x)| c * x).sum() };
    for episode in linear {
        let columns = episode.state_columns.chunks_exact(m);
        for (d, row) in episode.defect.iter_mut().zip(columns) {
            *d += sum(row);
        }
        let columns = episode.reading_columns.chunks_exact(m);
        for (r, row) in episode.residual.iter_mut().zip(columns) {
            *r -= sum(row);
        }
    }
}

/// A point from which steps are taken: what it and its step promise, and where that leads.
struct Anchor {
    hoped: f64,
    from: (Vec<f64>, Estimate),
    to: (Vec<f64>, Estimate),
}

/// Fits a model from some values, an estimate and the slopes of a like model on, over at most `rounds` linearisations;
/// over those so far, but at least one, where the work is stopped.
///
/// # Errors
/// When a value is not physical or the engine fails.
pub fn fit(
    context: &Context<'_>,
    hypothesis: &Hypothesis,
    theta: &[f64],
    (estimate, slopes): (&Estimate, &Slopes),
    (rounds, progress): (usize, &dyn Progress),
) -> Result<Fitted> {
    let unknowns = &hypothesis.unknowns;
    let free = hypothesis.free();
    let m = free.len();
    let nx = 2 * context.plant().layout.nv;
    let mut map = context.map(&hypothesis.specs, &hypothesis.parameters(), 2 * nx + m + 1)?;
    let want = Derivatives {
        state: true,
        ..Derivatives::default()
    };
    let steps = context.start_steps();
    let mut theta = theta.to_vec();
    let mut estimate = estimate.clone();
    let mut best: Option<Fitted> = None;
    let mut slopes = slopes.begun();
    let mut anchor: Option<Anchor> = None;
    let mut part = 1.0;
    let (mut waited, mut failed) = (0, 0);
    for round in 0..rounds.max(1) {
        let variations: Vec<Variation> = free
            .iter()
            .map(|&i| {
                let u = &unknowns[i];
                let step = SLOPE_STEP * u.deviation;
                let up = theta[i] + step <= u.bounds[1];
                let mut other = theta.clone();
                other[i] += if up { step } else { -step };
                Variation {
                    theta: other,
                    scale: if up { SLOPE_STEP } else { -SLOPE_STEP },
                }
            })
            .collect();
        let mut linear = slopes.linearise(
            (context, &mut map),
            (&theta, unknowns),
            &estimate,
            &variations,
        )?;
        let places: Vec<usize> = (0..m).collect();
        let center: Vec<f64> = free
            .iter()
            .map(|&i| -unknowns[i].distance(theta[i]))
            .collect();
        let bounds: Vec<[f64; 2]> = free
            .iter()
            .map(|&i| {
                let u = &unknowns[i];
                u.bounds.map(|b| (b - theta[i]) / u.deviation)
            })
            .collect();
        let prior: f64 = center.iter().map(|c| c * c).sum();
        let mut chosen: Option<(f64, f64, Evidence)> = None;
        for scale in SCALES {
            let sum = regression(context, &estimate, &linear, scale, m);
            let found = evidence(&sum.gram, &sum.moment, &places, &center, &bounds);
            // Of the present values, not of where a step would lead.
            let here = sum.log_likelihood - 0.5 * prior + determinant_of(&found);
            if chosen.as_ref().is_none_or(|(best, ..)| here > *best) {
                chosen = Some((here, scale, found));
            }
        }
        let Some((here, scale, found)) = chosen else {
            break;
        };
        estimate.rescale(scale);
        let covariance = DMatrix::from_fn(m, m, |i, j| {
            let d = |k: usize| unknowns[free[k]].deviation;
            found.covariance[(i, j)] * d(i) * d(j)
        });
        let promised = found.gain - determinant_of(&found) + 0.5 * prior;
        let hoped = here + promised;
        let rose = best.as_ref().is_none_or(|b| here > b.evidence + RISE)
            || anchor.as_ref().is_none_or(|a| hoped > a.hoped + RISE);
        waited = if rose { 0 } else { waited + 1 };
        if best.as_ref().is_none_or(|b| here > b.evidence) {
            best = Some(Fitted {
                hypothesis: hypothesis.clone(),
                theta: theta.clone(),
                evidence: here,
                promised,
                covariance,
                estimate: estimate.clone(),
                slopes: Slopes::default(),
            });
        }
        let stands = round > 0 && !rose && promised < RISE;
        if stands || failed == FAILURES || round + 1 == rounds || progress.is_stopped() {
            break;
        }
        if waited > PATIENCE {
            // The tangents led astray: less of the way.
            let Some(Anchor { from, to, .. }) = &anchor else {
                break;
            };
            part *= SHORTER;
            failed += 1;
            waited = 0;
            for (x, (a, b)) in theta.iter_mut().zip(from.0.iter().zip(&to.0)) {
                *x = a + part * (b - a);
            }
            estimate = from.1.towards(context, &to.1, part);
            let before = estimate.trajectory.clone();
            estimate.roll(context, &mut map, &theta, &before)?;
            continue;
        }
        let from = rose.then(|| (theta.clone(), estimate.clone()));
        let moves: Vec<f64> = found
            .coefficients
            .iter()
            .map(|c| c.clamp(-LARGEST_STEP, LARGEST_STEP))
            .collect();
        for (k, &i) in free.iter().enumerate() {
            let [low, high] = unknowns[i].bounds;
            theta[i] = (theta[i] + moves[k] * unknowns[i].deviation).clamp(low, high);
        }
        shift(&mut linear, &moves);
        let before = estimate.trajectory.clone();
        estimate.improve(context, &linear, EM_ROUNDS);
        estimate.roll(context, &mut map, &theta, &before)?;
        let again = map.reads() && !map.is_all_segments();
        for _ in 0..if again { AGAIN } else { 0 } {
            let linear = map.linearise(&theta, &estimate.trajectory, want, &steps, &[])?;
            let before = estimate.trajectory.clone();
            estimate.improve(context, &linear, 1);
            estimate.roll(context, &mut map, &theta, &before)?;
        }
        if let Some(from) = from {
            part = 1.0;
            anchor = Some(Anchor {
                hoped,
                from,
                to: (theta.clone(), estimate.clone()),
            });
        }
    }
    let mut best =
        best.ok_or_else(|| asid_core::Error::Failed("no round of the fit was finite".into()))?;
    best.slopes = slopes;
    Ok(best)
}

/// Smooths the logs in a model for the first time: linearises and fits the noise until both stand.
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
) -> Result<()> {
    let nx = 2 * context.plant().layout.nv;
    let mut map = context.map(&hypothesis.specs, &hypothesis.parameters(), 2 * nx + 1)?;
    let mut slopes = Slopes::default();
    for round in 0..rounds {
        if round > 0 && progress.is_stopped() {
            break;
        }
        let linear = slopes.linearise(
            (context, &mut map),
            (theta, &hypothesis.unknowns),
            estimate,
            &[],
        )?;
        let before = estimate.trajectory.clone();
        estimate.improve(context, &linear, em_rounds);
        estimate.roll(context, &mut map, theta, &before)?;
    }
    Ok(())
}
