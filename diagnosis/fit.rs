//! Least squares over open-loop rollouts: Levenberg and Marquardt's method, within bounds,
//! with the episodes' starts as nuisance parameters of their own.
//!
//! Derivatives are differences of rollouts ([`crate::linearise`]), and all trial steps with several
//! dampings are one batch.

mod region;
mod steps;

use std::sync::Arc;

use asid_core::layout::Layout;
use asid_core::{Progress, Result};
use nalgebra::DMatrix;

use crate::linearise::{Differences, Linearisation, Open, Unknown, slope};
use crate::normal::{Normal, inverse};
use crate::predict::{Point, Predictor};

pub use region::Region;
use steps::Steps;

/// How long and how finely to search.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Most iterations.
    pub iterations: usize,
    /// Share of the cost below which a step counts as none.
    pub tolerance: f64,
    /// Whether derivatives in the starts are taken once and kept to the end: over a short window they hardly
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
    /// Length of the derivatives of the prediction in each free parameter at the last linearisation, per unit of it.
    pub shows: Vec<f64>,
    /// How far each free parameter moves by a unit of each residual, with the starts refitted, `free x residuals`, in its unit.
    pub gains: DMatrix<f64>,
    /// Covariance of the free parameters for residuals of unit variance, in their units.
    pub covariance: DMatrix<f64>,
    /// Indices of the free parameters.
    pub free: Vec<usize>,
    /// Derivatives in the starts at the last linearisation.
    pub starts: Arc<StartSlopes>,
}

impl Fit {
    /// How far a fit to residuals that are changed so moves each free parameter, to first order, in its unit. Residuals that are not
    /// numbers, as after a replay diverged, do not count.
    #[must_use]
    pub fn answer(&self, change: &[f64]) -> Vec<f64> {
        let product = |row: usize| {
            let gains = self.gains.row(row);
            let pairs = gains.iter().zip(change).filter(|(_, c)| c.is_finite());
            pairs.map(|(g, c)| g * c).sum()
        };
        (0..self.free.len()).map(product).collect()
    }
}

/// Sum of squares.
#[must_use]
pub fn cost(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| r * r).sum()
}

/// Places of the episodes in a residual vector.
#[must_use]
pub fn bounds(predictor: &Predictor<'_>) -> Vec<std::ops::Range<usize>> {
    let logs = predictor.logs();
    (0..logs.episodes.len())
        .map(|e| logs.offset(e)..logs.offset(e + 1))
        .collect()
}

/// Derivatives in the starts, which fits of like models share.
#[derive(Clone, Debug, Default)]
pub struct StartSlopes {
    /// Differences that they were taken over, one an open coordinate, m or rad or per second.
    pub steps: Vec<f64>,
    /// One column an open coordinate: of every episode at once. Empty where only the differences are shared.
    pub columns: Vec<Vec<f64>>,
}

/// What a fit begins with.
pub struct Begin<'b> {
    /// Values and starts.
    pub point: Point,
    /// Coordinates of the starts that are fitted with the values.
    pub open: &'b Open,
    /// How far each of these may lie from where it begins (`starts::reach`).
    pub reach: &'b [f64],
    /// Derivatives in the starts of a model that is like this one: they do for a look, and a fit begins with their differences.
    pub like: Option<&'b StartSlopes>,
    /// Where the values stay.
    pub region: Option<&'b Region>,
}

impl<'b> Begin<'b> {
    /// From some values and starts on, of which some coordinates are open as far as they reach.
    #[must_use]
    pub fn at(point: Point, (open, reach): (&'b Open, &'b [f64])) -> Self {
        Self {
            point,
            open,
            reach,
            like: None,
            region: None,
        }
    }
}

/// Fits the unknowns and the starts' open coordinates, as far as it comes until work is stopped. Derivatives in the
/// starts are kept while steps win, for they cost a replay each and change little (a chord method).
///
/// # Errors
/// As [`Predictor::residuals`].
pub fn fit(
    predictor: &mut Predictor<'_>,
    (layout, unknowns): (&Layout, &[Unknown]),
    begin: Begin<'_>,
    (effort, progress): (Effort, &dyn Progress),
) -> Result<Fit> {
    let Begin {
        mut point,
        open,
        reach,
        like,
        region,
    } = begin;
    let bounds = bounds(predictor);
    let mut differences = Differences::new(unknowns.len(), open.len());
    if let Some(like) = like {
        differences.starts.clone_from(&like.steps);
    }
    let nearby = like.filter(|l| effort.iterations == 0 && !l.columns.is_empty());
    let nearby = nearby.map(|like| Linearisation {
        start_columns: like.columns.clone(),
        ..Linearisation::default()
    });
    let mut work = Steps {
        predictor,
        layout,
        unknowns,
        open,
        reach,
        free: (0..unknowns.len()).filter(|&i| unknowns[i].free).collect(),
        bounds,
        differences,
        region,
    };
    let mut line = work.first(&point, nearby.as_ref(), progress)?;
    let (mut best, mut damping) = (cost(&line.residuals), 1e-3);
    // Whether derivatives in the starts are those of another point.
    let mut stale = false;
    for _ in 0..effort.iterations {
        if progress.is_stopped() || work.free.is_empty() && open.is_empty() {
            break;
        }
        let stepped = work.stepped((&line, &point), &mut damping, best)?;
        let stands =
            (stepped.as_ref()).is_none_or(|(_, c)| best - c < effort.tolerance * c.max(1.0));
        let anew = stands && stale && !effort.chord;
        let moves = stepped.is_some();
        if let Some((next, value)) = stepped {
            (point, best) = (next, value);
        }
        if anew {
            line = work.line(&point, None)?;
            stale = false;
        } else if moves {
            line = work.line(&point, Some(&line))?;
            stale = !open.is_empty();
        }
        if stands && !anew {
            break;
        }
    }
    if stale && !effort.chord && !progress.is_stopped() {
        line = work.line(&point, None)?;
    }
    Ok(finish(work, point, line))
}

fn finish(work: Steps<'_, '_>, point: Point, line: Linearisation) -> Fit {
    let (unknowns, free) = (work.unknowns, work.free);
    let normal = Normal::new(&line, &work.bounds, 0.0, work.reach);
    let p = free.len();
    let inverse = inverse(&normal.information, 1e-14);
    // From shares of the range to the parameter's unit.
    let scale: Vec<f64> = free
        .iter()
        .map(|&i| slope(&unknowns[i].parameter, point.theta[i]))
        .collect();
    let covariance = DMatrix::from_fn(p, p, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
    let length = |(column, scale): (&Vec<f64>, &f64)| cost(column).sqrt() / scale.abs();
    let mut gains = &inverse * normal.projected(&line, &work.bounds);
    for (mut row, scale) in gains.row_iter_mut().zip(&scale) {
        row *= *scale;
    }
    Fit {
        shows: line.columns.iter().zip(&scale).map(length).collect(),
        gains,
        cost: cost(&line.residuals),
        residuals: line.residuals,
        point,
        covariance,
        free,
        starts: Arc::new(StartSlopes {
            steps: work.differences.starts,
            columns: line.start_columns,
        }),
    }
}
