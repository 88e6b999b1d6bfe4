//! The descent: chooses starts and takes damped steps from each, all in the same batches.

use crate::fisher::inverse_above_prior;
use crate::fisher::local_fit::{LocalFit, Told};
use asid_core::Result;
use asid_core::rng::Rng;
use nalgebra::{DMatrix, DVector};

use super::{GaussNewtonSettings, Residuals, Space, clamp, gradient, half_squares, solve};

/// Dampings that are tried at once, as factors on the present one.
pub(super) const DAMPINGS: [f64; 4] = [0.1, 1.0, 10.0, 100.0];

/// A start has converged once its step is below this share of the differences' steps.
const ARRIVED: f64 = 0.01;

/// Smallest half step of the differences, in units of the entries: below it rounding dominates
/// where simulations hold six digits. A smaller one of the settings is kept as it is.
const LEAST_STEP: f64 = 1e-3;

/// The state of one start's descent.
pub(super) struct Walker {
    pub(super) point: Vec<f64>,
    pub(super) steps: Vec<f64>,
    pub(super) damping: f64,
    pub(super) loss: f64,
    /// Whether it has converged or makes no further progress.
    pub(super) done: bool,
}

/// Evaluates points spread over the box (zero, its middle and random draws); returns the best as
/// starts.
pub(super) fn screen(
    settings: &GaussNewtonSettings,
    residuals: &mut Residuals<'_>,
    space: Space<'_>,
    rng: &mut Rng,
) -> Result<Option<Vec<Walker>>> {
    use rand::Rng as _;
    let n = space.low.len();
    let mut points = vec![vec![0.0; n]];
    // A box about an earlier result has that in its middle.
    let ends = space.low.iter().zip(space.high);
    let middle: Vec<f64> = ends.map(|(low, high)| 0.5 * (low + high)).collect();
    if settings.screened > 1 && middle.iter().any(|x| *x != 0.0) {
        points.push(middle);
    }
    while points.len() < settings.screened {
        // Entries that are estimated jointly are drawn within one standard deviation of zero.
        let point = (0..n).map(|i| {
            let u: f64 = rng.random();
            if i < space.sought {
                space.low[i] + u * (space.high[i] - space.low[i])
            } else {
                (2.0 * u - 1.0).clamp(space.low[i], space.high[i])
            }
        });
        points.push(point.collect());
    }
    for point in &mut points {
        clamp(point, space);
    }
    let rows = residuals(&points)?;
    let mut walkers: Vec<Walker> = points
        .into_iter()
        .zip(rows)
        .filter_map(|(point, row)| {
            Some(Walker {
                loss: half_squares(&row?),
                steps: vec![settings.step; n],
                damping: settings.damping,
                point,
                done: false,
            })
        })
        .collect();
    walkers.sort_by(|a, b| a.loss.total_cmp(&b.loss));
    walkers.truncate(settings.starts);
    Ok((!walkers.is_empty()).then_some(walkers))
}

/// Takes one step from every start that has not converged; returns the evaluated points.
pub(super) fn iterate(
    settings: &GaussNewtonSettings,
    residuals: &mut Residuals<'_>,
    space: Space<'_>,
    walkers: &mut [Walker],
) -> Result<Vec<Vec<f64>>> {
    let n = space.low.len();
    let mut seen = Vec::new();
    let moving: Vec<usize> = (0..walkers.len()).filter(|&i| !walkers[i].done).collect();
    let around: Vec<Vec<Vec<f64>>> = moving
        .iter()
        .map(|&i| differences(&walkers[i], space))
        .collect();
    seen.extend(around.iter().flatten().cloned());
    if seen.is_empty() {
        return Ok(seen);
    }
    let rows = residuals(&seen)?;
    let mut fits = Vec::new();
    let mut trials: Vec<Vec<f64>> = Vec::new();
    for ((&i, points), rows) in moving.iter().zip(&around).zip(rows.chunks(1 + 2 * n)) {
        let walker = &mut walkers[i];
        let factor = DMatrix::from_diagonal(&DVector::from_column_slice(&walker.steps));
        let fit = rows[0]
            .as_ref()
            .and_then(|row| LocalFit::new(&points[0], row, &factor, &points[1..], &rows[1..]));
        let Some((fit, told)) = fit.and_then(|f| f.told(false).map(|t| (f, t))) else {
            walker.done = true;
            continue;
        };
        for by in DAMPINGS {
            let step = damped(&fit, &told, walker, by * walker.damping, space);
            let mut point: Vec<f64> = walker.point.iter().zip(&step).map(|(x, s)| x + s).collect();
            clamp(&mut point, space);
            trials.push(point);
        }
        fits.push((i, fit, told));
    }
    if trials.is_empty() {
        return Ok(seen);
    }
    let rows = residuals(&trials)?;
    for (((i, fit, told), rows), points) in fits
        .iter()
        .zip(rows.chunks(DAMPINGS.len()))
        .zip(trials.chunks(DAMPINGS.len()))
    {
        let walker = &mut walkers[*i];
        // All steps are compared with the same weights: those of the readings around the present
        // point.
        let weighted = |row: &[f64]| {
            let row = DMatrix::from_row_slice(1, row.len(), row);
            0.5 * told.precision.weigh(&row).component_mul(&row).sum()
        };
        let here = weighted(fit.middle().as_slice());
        let best = (0..points.len())
            .filter_map(|k| rows[k].as_ref().map(|r| (k, weighted(r), half_squares(r))))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        match best {
            Some((k, loss, plain)) if loss < here => {
                let far = (0..n)
                    .map(|j| ((points[k][j] - walker.point[j]) / walker.steps[j]).abs())
                    .fold(0.0, f64::max);
                walker.done = far < ARRIVED;
                walker.damping = (walker.damping * DAMPINGS[k]).clamp(1e-9, 1e9);
                walker.point.clone_from(&points[k]);
                walker.loss = plain;
            }
            _ => {
                // No step helps at any damping: this is as good as the roughness of single points
                // allows.
                walker.damping *= DAMPINGS[DAMPINGS.len() - 1];
                walker.done = walker.damping > 1e6;
            }
        }
        let prior = DMatrix::identity(n, n);
        let covariance = inverse_above_prior(&(&told.information + prior));
        for j in 0..n {
            let least = LEAST_STEP.min(settings.step);
            walker.steps[j] = covariance[(j, j)].sqrt().clamp(least, settings.step);
        }
    }
    seen.extend(trials);
    Ok(seen)
}

/// The point and its central differences along the axes, kept inside the box.
fn differences(walker: &Walker, space: Space<'_>) -> Vec<Vec<f64>> {
    let mut points = vec![walker.point.clone()];
    for (j, step) in walker.steps.iter().enumerate() {
        for sign in [1.0, -1.0] {
            let mut point = walker.point.clone();
            point[j] += sign * step;
            clamp(&mut point, space);
            points.push(point);
        }
    }
    points
}

/// A damped step. Entries at an end of the box stay there while the gradient pushes outwards.
fn damped(
    fit: &LocalFit,
    told: &Told,
    walker: &Walker,
    damping: f64,
    space: Space<'_>,
) -> Vec<f64> {
    let g = gradient(fit, told);
    let held: Vec<bool> = (0..g.len())
        .map(|i| {
            (walker.point[i] <= space.low[i] && g[i] > 0.0)
                || (walker.point[i] >= space.high[i] && g[i] < 0.0)
        })
        .collect();
    solve(&told.curvature, &g, damping, &held)
}
