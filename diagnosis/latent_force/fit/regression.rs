//! The regression on small changes of the values: columns, prior, and evidence at common scales of
//! `q`.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::latent_force::context::Context;
use crate::latent_force::estimate::Estimate;
use crate::latent_force::evidence::{Evidence, evidence};
use crate::latent_force::fitted_value::Unknown;
use crate::latent_force::smoother::{Regression, regress, regress_on};
use crate::latent_force::step_map::{LinearEpisode, Variation};

/// Common factors of `q` at which models are compared.
pub const SCALES: [f64; 6] = [1.0, 0.3, 0.1, 0.03, 0.01, 0.003];
/// Step of a finite difference with respect to a value, relative to its prior's standard deviation.
const SLOPE_STEP: f64 = 0.01;

/// Returns the regression of all walks.
pub fn regression(
    context: &Context<'_>,
    estimate: &Estimate,
    linear: &[LinearEpisode],
    scale: f64,
    m: usize,
) -> Regression {
    let starts = context.starts(&estimate.trajectory, &estimate.read);
    let problems = estimate.problems(context, linear, &starts).enumerate();
    let of_walk = |(w, p)| regress(p, &estimate.noise_along(context, w, scale), m);
    sum(problems.map(of_walk).collect(), m)
}

/// Returns the regression of all walks, none of them a segment, on some of `m` columns.
///
/// The variances of the missing force at one degree of freedom are scaled.
pub fn regression_at(
    context: &Context<'_>,
    estimate: &Estimate,
    linear: &[LinearEpisode],
    (dof, scale): (usize, f64),
    (m, columns): (usize, &[usize]),
) -> Regression {
    let starts = context.starts(&estimate.trajectory, &estimate.read);
    let noise = estimate.noise.scaled_at(dof, scale, &estimate.least_white);
    let problems = estimate.problems(context, linear, &starts);
    let of_walk = |p| regress_on(p, &noise, (m, columns));
    sum(problems.map(of_walk).collect(), columns.len())
}

fn sum(parts: Vec<Regression>, m: usize) -> Regression {
    let mut sum = Regression {
        log_likelihood: 0.0,
        gram: DMatrix::zeros(m, m),
        moment: DVector::zeros(m),
    };
    parts.iter().for_each(|p| sum.add(p));
    sum
}

/// Returns the values for finite differences: each a little up, or down where up would leave its
/// bounds.
pub(super) fn variations(unknowns: &[Unknown], free: &[usize], theta: &[f64]) -> Vec<Variation> {
    free.iter()
        .map(|&i| {
            let u = &unknowns[i];
            let step = SLOPE_STEP * u.deviation;
            let up = theta[i] + step <= u.bounds[1];
            let mut other = theta.to_vec();
            other[i] += if up { step } else { -step };
            Variation {
                theta: other,
                scale: if up { SLOPE_STEP } else { -SLOPE_STEP },
            }
        })
        .collect()
}

/// The evidence at the common scale of `q` that maximises it.
pub(super) struct Compared {
    /// The scale.
    pub(super) scale: f64,
    /// Evidence at the present values, not at the end of a step.
    pub(super) here: f64,
    /// Gain beyond it that a step predicts, to first order.
    pub(super) promised: f64,
    /// The regression, in standard deviations of the priors.
    pub(super) found: Evidence,
}

/// Returns centers and bounds of the coefficients, in standard deviations of their priors about the
/// present values.
///
/// The engine's own error comes last. Its coefficient has its prior and no bounds.
pub(super) fn prior_of(
    context: &Context<'_>,
    (unknowns, free, theta): (&[Unknown], &[usize], &[f64]),
) -> (Vec<f64>, Vec<[f64; 2]>) {
    let m = free.len() + context.step_error.columns();
    let center = free.iter().map(|&i| -unknowns[i].distance(theta[i]));
    let mut center: Vec<f64> = center.collect();
    let bounds = free.iter().map(|&i| {
        let u = &unknowns[i];
        u.bounds.map(|b| (b - theta[i]) / u.deviation)
    });
    let mut bounds: Vec<[f64; 2]> = bounds.collect();
    center.extend(context.step_error.center());
    bounds.resize(m, [f64::NEG_INFINITY, f64::INFINITY]);
    (center, bounds)
}

/// Compares the common scales of `q` for a model, given its unknowns, the indices of the fitted
/// ones, and all values.
///
/// If `whole`, it tries all scales. Otherwise it starts at the largest, the one that was best
/// before, and stops once the evidence no longer rises. Returns `None` if there is no scale.
pub(super) fn compare(
    context: &Context<'_>,
    estimate: &Estimate,
    linear: &[LinearEpisode],
    (unknowns, free, theta): (&[Unknown], &[usize], &[f64]),
    whole: bool,
) -> Option<Compared> {
    let (center, bounds) = prior_of(context, (unknowns, free, theta));
    let m = center.len();
    let places: Vec<usize> = (0..m).collect();
    let prior: f64 = center.iter().map(|c| c * c).sum();
    let mut best: Option<Compared> = None;
    for scale in SCALES {
        let sum = regression(context, estimate, linear, scale, m);
        let found = evidence(&sum.gram, &sum.moment, &places, &center, &bounds);
        let determinant = determinant_of(&found);
        // At the present values, with the engine's own error marginalised.
        let own: f64 = (free.len()..m)
            .map(|e| 0.5 * (sum.moment[e] + center[e]).powi(2) / (1.0 + sum.gram[(e, e)]))
            .sum();
        let here = sum.log_likelihood + own - 0.5 * prior + determinant;
        // A result that is not a number is no model of the logs.
        let here = if here.is_nan() {
            f64::NEG_INFINITY
        } else {
            here
        };
        if !whole && best.as_ref().is_some_and(|b| here <= b.here) {
            break;
        }
        if best.as_ref().is_none_or(|b| here > b.here) {
            best = Some(Compared {
                scale,
                here,
                promised: if determinant.is_finite() {
                    found.gain - own - determinant + 0.5 * prior
                } else {
                    0.0
                },
                found,
            });
        }
    }
    best
}

/// Converts a covariance from standard deviations of the priors to the values' units.
pub(super) fn in_units(
    covariance: &DMatrix<f64>,
    unknowns: &[Unknown],
    free: &[usize],
) -> DMatrix<f64> {
    let deviation = |k: usize| unknowns[free[k]].deviation;
    DMatrix::from_fn(free.len(), free.len(), |i, j| {
        covariance[(i, j)] * deviation(i) * deviation(j)
    })
}

/// Half the log-determinant of the posterior covariance, in units of the prior; infinitely small
/// where it has none.
fn determinant_of(found: &Evidence) -> f64 {
    let factor = found.covariance.clone().cholesky();
    factor.map_or(f64::NEG_INFINITY, |c| {
        c.l_dirty().diagonal().iter().map(|x| x.ln()).sum()
    })
}

/// Shifts a linearisation by changes of the values of its columns.
pub(super) fn shift(linear: &mut [LinearEpisode], changes: &[f64]) {
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
