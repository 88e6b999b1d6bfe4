//! Least squares over open-loop rollouts: Levenberg and Marquardt's method, within bounds,
//! with the episodes' starts as nuisance parameters of their own.
//!
//! Derivatives are differences of rollouts ([`crate::linearise`]), and all trial steps with several
//! dampings are one batch.

use asid_core::layout::Layout;
use asid_core::{Progress, Result};
use nalgebra::DMatrix;

use crate::linearise::{Differences, Linearisation, NOTHING, Open, Unknown, linearise, slope};
use crate::normal::{Normal, inverse};
use crate::predict::{Point, Predictor};

/// How long and how finely to search.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Most iterations.
    pub iterations: usize,
    /// Share of the cost below which a step counts as none.
    pub tolerance: f64,
    /// Whether derivatives in the starts are taken once and kept: over a short window they hardly
    /// change.
    pub chord: bool,
}

impl Effort {
    /// Where it stands, with its slopes.
    pub const LOOK: Self = Self {
        iterations: 0,
        tolerance: 1e-3,
        chord: false,
    };
    /// Starts on the first part of an episode, where slopes hardly change.
    pub const START: Self = Self {
        iterations: 6,
        tolerance: 1e-3,
        chord: true,
    };
    /// A quick look.
    pub const BRIEF: Self = Self {
        iterations: 6,
        tolerance: 1e-3,
        chord: false,
    };
}

/// What a fit found.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The best point.
    pub point: Point,
    /// Sum of squared residuals there.
    pub cost: f64,
    /// Residuals there.
    pub residuals: Vec<f64>,
    /// Derivatives of the prediction in the free parameters at the last linearisation,
    /// `residuals x free`, per unit of each.
    pub jacobian: DMatrix<f64>,
    /// Covariance of the free parameters for residuals of unit variance, in their units.
    pub covariance: DMatrix<f64>,
    /// Indices of the free parameters.
    pub free: Vec<usize>,
}

/// Sum of squares.
#[must_use]
pub fn cost(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| r * r).sum()
}

/// Places of the episodes in a residual vector.
fn bounds(predictor: &Predictor<'_>) -> Vec<std::ops::Range<usize>> {
    let logs = predictor.logs();
    (0..logs.episodes.len())
        .map(|e| logs.offset(e)..logs.offset(e + 1))
        .collect()
}

/// Fits the unknowns and the starts' open coordinates from `point` on, as far as it comes until work is stopped.
///
/// # Errors
/// As [`Predictor::residuals`].
pub fn fit(
    predictor: &mut Predictor<'_>,
    layout: &Layout,
    unknowns: &[Unknown],
    point: Point,
    open: &Open,
    (effort, progress): (Effort, &dyn Progress),
) -> Result<Fit> {
    let free: Vec<usize> = (0..unknowns.len()).filter(|&i| unknowns[i].free).collect();
    let bounds = bounds(predictor);
    let mut differences = Differences::new(unknowns.len(), open.len());
    let mut point = point;
    let mut damping = 1e-3;
    let mut line = linearise(predictor, layout, unknowns, &point, open, &mut differences)?;
    let mut best = cost(&line.residuals);
    if free.is_empty() && open.is_empty() {
        return Ok(finish(unknowns, free, point, line, &bounds));
    }
    if effort.chord {
        line = linearise(predictor, layout, unknowns, &point, open, &mut differences)?;
        differences.kept = Some(line.start_columns.clone());
    }
    // The first differences are a guess; they are right once they hardly change.
    for _ in 0..4 {
        if progress.is_stopped() {
            break;
        }
        let before = differences.clone();
        line = linearise(predictor, layout, unknowns, &point, open, &mut differences)?;
        let settled = |(a, b): (&f64, &f64)| (a / b).max(b / a) < 4.0;
        if before.shares.iter().zip(&differences.shares).all(settled)
            && before.starts.iter().zip(&differences.starts).all(settled)
        {
            break;
        }
    }
    for _ in 0..effort.iterations {
        if progress.is_stopped() {
            break;
        }
        let mut accepted = None;
        for _ in 0..3 {
            let dampings = [damping * 0.1, damping, damping * 10.0];
            let trials: Vec<Point> = dampings
                .iter()
                .map(|&d| trial(&line, layout, unknowns, &free, &point, open, &bounds, d))
                .collect();
            let residuals = predictor.residuals(&trials)?;
            let costs: Vec<f64> = residuals.iter().map(|r| cost(r)).collect();
            let lowest = (0..costs.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b]));
            if let Some(k) = lowest.filter(|&k| costs[k] < best) {
                accepted = Some((trials[k].clone(), costs[k]));
                damping = dampings[k].clamp(1e-8, 1e8);
                break;
            }
            damping *= 100.0;
        }
        let Some((next, value)) = accepted else { break };
        let gain = best - value;
        point = next;
        best = value;
        line = linearise(predictor, layout, unknowns, &point, open, &mut differences)?;
        if gain < effort.tolerance * best.max(1.0) {
            break;
        }
    }
    Ok(finish(unknowns, free, point, line, &bounds))
}

/// The point after a damped step, within the bounds.
#[allow(clippy::too_many_arguments)]
fn trial(
    line: &Linearisation,
    layout: &Layout,
    unknowns: &[Unknown],
    free: &[usize],
    point: &Point,
    open: &Open,
    bounds: &[std::ops::Range<usize>],
    damping: f64,
) -> Point {
    let normal = Normal::new(line, bounds, damping);
    let unit: Vec<f64> = free
        .iter()
        .map(|&i| unknowns[i].parameter.to_unit(point.theta[i]))
        .collect();
    let readings = line.residuals.len().max(1) as f64;
    let mut held: Vec<bool> = line
        .columns
        .iter()
        .map(|c| (cost(c) / readings).sqrt() < NOTHING)
        .collect();
    let mut step = normal.step(damping, &held);
    // Where the step leaves a bound that it starts from, that parameter stays.
    for _ in 0..free.len() {
        let mut again = false;
        for k in 0..free.len() {
            let leaves =
                (unit[k] <= 1e-12 && step[k] < 0.0) || (unit[k] >= 1.0 - 1e-12 && step[k] > 0.0);
            if leaves && !held[k] {
                held[k] = true;
                again = true;
            }
        }
        if !again {
            break;
        }
        step = normal.step(damping, &held);
    }
    let mut next = point.clone();
    for (k, &i) in free.iter().enumerate() {
        let u = (unit[k] + step[k]).clamp(0.0, 1.0);
        next.theta[i] = unknowns[i].parameter.from_unit(u);
    }
    if !open.is_empty() {
        for (e, start) in next.starts.iter_mut().enumerate() {
            let moves = normal.start_step(e, &step);
            for (&coordinate, by) in open.iter().zip(moves.iter()) {
                start.shift(layout, coordinate, *by);
            }
        }
    }
    next
}

fn finish(
    unknowns: &[Unknown],
    free: Vec<usize>,
    point: Point,
    line: Linearisation,
    bounds: &[std::ops::Range<usize>],
) -> Fit {
    let normal = Normal::new(&line, bounds, 0.0);
    let p = free.len();
    let inverse = inverse(&normal.information, 1e-14);
    // From shares of the range to the parameter's unit.
    let scale: Vec<f64> = free
        .iter()
        .map(|&i| slope(&unknowns[i].parameter, point.theta[i]))
        .collect();
    let covariance = DMatrix::from_fn(p, p, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
    let rows = line.residuals.len();
    let jacobian = DMatrix::from_fn(rows, p, |r, k| line.columns[k][r] / scale[k]);
    Fit {
        cost: cost(&line.residuals),
        residuals: line.residuals,
        point,
        jacobian,
        covariance,
        free,
    }
}
