//! Bounded least squares by Gauss-Newton steps with Levenberg-Marquardt damping, from several
//! starts at once. The residuals are rough, and only their values can be computed.
//!
//! An iteration evaluates two batches: the points of central differences around every start, then
//! steps of several dampings from each, of which the best is taken. The difference steps follow the
//! standard deviations that the last fit left: they shrink as the entries become known, and they
//! average the roughness.
//!
//! At the end a [`LocalFit`] over the region of the posterior gives estimate and information.
//! Identification by emulation does the same with a quadratic instead of a linear model.

use crate::fisher::inverse_above_prior;
use crate::fisher::local_fit::{LocalFit, Told, design, sets};
use crate::fisher::roughness::Roughness;
use asid_core::Result;
use asid_core::rng::Rng;
use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::require;
use descent::{DAMPINGS, Walker, iterate, screen};

mod descent;

/// Whitened residuals at many points: `None` where the evaluation failed.
pub type Residuals<'r> = dyn FnMut(&[Vec<f64>]) -> Result<Vec<Option<Vec<f64>>>> + 'r;

/// Settings of a Gauss-Newton search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GaussNewtonSettings {
    /// Points of the box that are evaluated to choose the starts.
    pub screened: usize,
    /// Number of starts: the best of these points. Several are needed since contact creates local
    /// minima.
    pub starts: usize,
    /// Most iterations from each start.
    pub iterations: usize,
    /// Initial half step of the differences, in prior standard deviations.
    pub step: f64,
    /// Initial damping, relative to the curvature.
    pub damping: f64,
    /// Fits over the region of the posterior; each narrows or widens the region of the next.
    pub rounds: usize,
    /// Standard deviations of that region in units of the posterior's.
    pub widen: f64,
    /// Whether readings are weighted by the whole covariance of the roughness along the episode, or
    /// by its variance alone.
    pub correlated: bool,
}

impl Default for GaussNewtonSettings {
    fn default() -> Self {
        Self {
            screened: 64,
            starts: 4,
            iterations: 10,
            step: 0.3,
            damping: 0.1,
            rounds: 4,
            widen: 2.0,
            correlated: false,
        }
    }
}

impl GaussNewtonSettings {
    /// Checks the settings; `key` is their place in a configuration.
    ///
    /// # Errors
    /// When a setting is out of its domain.
    pub fn check(&self, key: &str) -> Result<()> {
        for (name, value) in [
            ("screened", self.screened),
            ("starts", self.starts),
            ("iterations", self.iterations),
            ("rounds", self.rounds),
        ] {
            require(
                value > 0,
                &format!("{key}.{name}"),
                value as f64,
                "at least 1",
            )?;
        }
        for (name, value) in [
            ("step", self.step),
            ("damping", self.damping),
            ("widen", self.widen),
        ] {
            let ok = value > 0.0 && value.is_finite();
            require(ok, &format!("{key}.{name}"), value, "above 0")?;
        }
        Ok(())
    }

    /// Largest number of points that are evaluated in one batch, for `n` entries.
    #[must_use]
    pub fn batch(&self, n: usize) -> usize {
        let differences = self.starts * (1 + 2 * n);
        let region = 1 + 2 * n * sets(n);
        self.screened
            .max(differences)
            .max(self.starts * DAMPINGS.len())
            .max(region)
    }
}

/// Curvature added in the damping, in units of the entries, so that it also acts where the
/// residuals are flat.
const FLAT: f64 = 1e-3;

/// Longest step in the last fits, in half steps of the region: the linear model says nothing
/// beyond.
const REACH: f64 = 1.5;

/// The space to minimise over.
#[derive(Clone, Copy, Debug)]
pub struct Space<'s> {
    /// Smallest value of each entry.
    pub low: &'s [f64],
    /// Largest value of each entry.
    pub high: &'s [f64],
    /// Number of leading entries that are unknowns; the others are estimated jointly.
    pub sought: usize,
    /// Number of residual entries that are present; the others are zero.
    pub readings: usize,
}

/// A minimum, with its information.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Point with the smallest weighted sum of squares within the box.
    pub point: Vec<f64>,
    /// Minimum of the linear model without the box; it may lie outside.
    pub free: Vec<f64>,
    /// Information about the entries, without any prior. It accounts for the roughness, its
    /// correlation and the remaining misfit.
    pub information: DMatrix<f64>,
    /// Residuals at the point, by the linear model.
    pub left: DVector<f64>,
    /// Roughness of single simulations about the point.
    pub luck: Roughness,
    /// Covariance of these residuals by chance, as a share of that of the roughness.
    pub scatter: f64,
    /// Root mean square of the residuals at the point, by the linear model.
    pub residual: f64,
    /// Root mean square of the residuals at the point, in units of noise and roughness together.
    pub misfit: f64,
    /// Root mean square of the roughness, in units of the readings' noise.
    pub roughness: f64,
    /// For each iteration: half the smallest sum of squares so far, and the points evaluated.
    pub course: Vec<(f64, Vec<Vec<f64>>)>,
}

impl Fit {
    /// Half the sum of squared residuals.
    #[must_use]
    pub fn loss(&self) -> f64 {
        0.5 * self.left.norm_squared()
    }

    /// Information about the `sought` leading entries, with the others projected out.
    #[must_use]
    pub fn about(&self, sought: usize) -> DMatrix<f64> {
        let n = self.information.nrows();
        let block = |i: usize, j: usize, h: usize, w: usize| {
            self.information.view((i, j), (h, w)).into_owned()
        };
        let own = block(0, 0, sought, sought);
        if n == sought {
            return own;
        }
        let across = block(0, sought, sought, n - sought);
        let rest = block(sought, sought, n - sought, n - sought)
            + DMatrix::identity(n - sought, n - sought) * FLAT;
        let Some(factor) = rest.cholesky() else {
            return own * 0.0;
        };
        let left = own - &across * factor.solve(&across.transpose());
        (&left + left.transpose()) * 0.5
    }
}

/// Minimises the sum of squares; `None` where nearly every evaluation failed.
///
/// # Errors
/// Those of `residuals`.
pub fn minimise(
    settings: &GaussNewtonSettings,
    residuals: &mut Residuals<'_>,
    space: Space<'_>,
    rng: &mut Rng,
    mut tick: impl FnMut(),
) -> Result<Option<Fit>> {
    let Some(mut walkers) = screen(settings, residuals, space, rng)? else {
        return Ok(None);
    };
    let mut course = Vec::new();
    for _ in 0..settings.iterations {
        let seen = iterate(settings, residuals, space, &mut walkers)?;
        let best = walkers.iter().map(|w| w.loss).fold(f64::INFINITY, f64::min);
        course.push((best, seen));
        tick();
    }
    let Some(best) = walkers
        .into_iter()
        .min_by(|a, b| a.loss.total_cmp(&b.loss))
        .filter(|w| w.loss.is_finite())
    else {
        return Ok(None);
    };
    if space.low.is_empty() {
        return at_the_only_point(residuals, space, course);
    }
    settle(settings, residuals, space, best, course, rng, tick)
}

/// The fit in a space without entries: there is nothing to move, and no roughness is measured.
fn at_the_only_point(
    residuals: &mut Residuals<'_>,
    space: Space<'_>,
    course: Vec<(f64, Vec<Vec<f64>>)>,
) -> Result<Option<Fit>> {
    let row = residuals(&[Vec::new()])?.pop().flatten();
    Ok(row.map(|row| {
        let left = DVector::from_vec(row);
        let residual = (left.norm_squared() / space.readings.max(1) as f64).sqrt();
        Fit {
            point: Vec::new(),
            free: Vec::new(),
            information: DMatrix::zeros(0, 0),
            luck: Roughness::none(left.len()),
            left,
            scatter: 0.0,
            residual,
            misfit: residual,
            roughness: 0.0,
            course,
        }
    }))
}

fn half_squares(row: &[f64]) -> f64 {
    0.5 * row.iter().map(|x| x * x).sum::<f64>()
}

fn clamp(point: &mut [f64], space: Space<'_>) {
    for (x, (low, high)) in point.iter_mut().zip(space.low.iter().zip(space.high)) {
        *x = x.clamp(*low, *high);
    }
}

/// Gradient of half the weighted sum of squares.
fn gradient(fit: &LocalFit, told: &Told) -> DVector<f64> {
    let middle = DMatrix::from_row_slice(1, fit.middle().len(), fit.middle().as_slice());
    let weighed = told.precision.weigh(&middle);
    fit.slopes() * weighed.transpose().column(0)
}

/// Step `-(H + damping diag H)^-1 g` over the entries that are not held.
fn solve(curvature: &DMatrix<f64>, g: &DVector<f64>, damping: f64, held: &[bool]) -> Vec<f64> {
    let n = g.len();
    let mut left = curvature.clone();
    let mut right = -g;
    for i in 0..n {
        left[(i, i)] += damping * (curvature[(i, i)] + FLAT) + FLAT * FLAT;
    }
    for i in (0..n).filter(|&i| held[i]) {
        left.row_mut(i).fill(0.0);
        left.column_mut(i).fill(0.0);
        left[(i, i)] = 1.0;
        right[i] = 0.0;
    }
    left.cholesky()
        .map_or_else(|| vec![0.0; n], |f| f.solve(&right).as_slice().to_vec())
}

/// Fits over the region of the posterior, around the point where a start converged.
fn settle(
    settings: &GaussNewtonSettings,
    residuals: &mut Residuals<'_>,
    space: Space<'_>,
    from: Walker,
    mut course: Vec<(f64, Vec<Vec<f64>>)>,
    rng: &mut Rng,
    mut tick: impl FnMut(),
) -> Result<Option<Fit>> {
    let n = space.low.len();
    let mut point = from.point;
    let mut best = from.loss;
    let mut factor = DMatrix::from_diagonal(&DVector::from_column_slice(&from.steps));
    let mut found = None;
    for _ in 0..settings.rounds {
        let mut points = design(&point, &factor, (space.low, space.high), sets(n), rng);
        points.insert(0, point.clone());
        let rows = residuals(&points)?;
        let losses = rows.iter().flatten().map(|r| half_squares(r));
        best = losses.fold(best, f64::min);
        let fit = rows[0]
            .as_ref()
            .and_then(|row| LocalFit::new(&points[0], row, &factor, &points[1..], &rows[1..]));
        course.push((best, points));
        tick();
        let Some((fit, told)) = fit.and_then(|f| f.told(settings.correlated).map(|t| (f, t)))
        else {
            break;
        };
        let (next, whole) = moved(&fit, &told, &point, &factor, space);
        // Residuals after the step, by the linear model.
        let step = DVector::from_fn(n, |i, _| next[i] - point[i]);
        let left = fit.middle() + fit.slopes().tr_mul(&step);
        let row = DMatrix::from_row_slice(1, left.len(), left.as_slice());
        let weighted = told.precision.weigh(&row).component_mul(&row).sum();
        let spare = (space.readings as f64 - n as f64).max(1.0);
        let mismatch = weighted / spare;
        let information = told.information / mismatch.max(1.0);
        point.clone_from(&next);
        let covariance = inverse_above_prior(&(&information + DMatrix::identity(n, n)));
        found = Some(Fit {
            point: next,
            free: whole,
            information,
            scatter: fit.scatter(&step),
            luck: fit.roughness().clone(),
            residual: (left.norm_squared() / space.readings.max(1) as f64).sqrt(),
            misfit: mismatch.max(0.0).sqrt(),
            roughness: fit.roughness().size(space.readings),
            left,
            course: Vec::new(),
        });
        let Some(root) = covariance.cholesky() else {
            break;
        };
        factor = root.l() * (settings.widen * (n as f64).sqrt());
        for i in 0..n {
            let (length, most) = (factor.row(i).norm(), 0.5 * (space.high[i] - space.low[i]));
            if length > most {
                factor.row_mut(i).scale_mut(most / length);
            }
        }
    }
    Ok(found.map(|fit| Fit { course, ..fit }))
}

/// Minimum of the linear model: inside the box and within reach, and without either limit.
fn moved(
    fit: &LocalFit,
    told: &Told,
    point: &[f64],
    factor: &DMatrix<f64>,
    space: Space<'_>,
) -> (Vec<f64>, Vec<f64>) {
    let n = point.len();
    let g = gradient(fit, told);
    let whole = solve(&told.curvature, &g, 0.0, &vec![false; n]);
    let free: Vec<f64> = (0..n).map(|i| point[i] + whole[i]).collect();
    // Entries that would leave the box are held at its end one by one, and the others are solved
    // for again.
    let mut held = vec![false; n];
    let mut step = whole;
    for _ in 0..n {
        let out = (0..n).find(|&i| {
            !held[i] && {
                let x = point[i] + step[i];
                (x < space.low[i] && point[i] <= space.low[i])
                    || (x > space.high[i] && point[i] >= space.high[i])
            }
        });
        let Some(i) = out else { break };
        held[i] = true;
        step = solve(&told.curvature, &g, 0.0, &held);
    }
    let in_steps = DVector::from_column_slice(&step);
    let far = factor
        .solve_lower_triangular(&in_steps)
        .map_or(0.0, |w| w.amax());
    let shorten = (REACH / far.max(1e-300)).min(1.0);
    let mut next: Vec<f64> = (0..n).map(|i| point[i] + shorten * step[i]).collect();
    clamp(&mut next, space);
    (next, free)
}

#[cfg(test)]
mod tests;
