//! Bounded least squares over open-loop rollouts (Levenberg-Marquardt); the episodes' initial
//! states are nuisance parameters.
//!
//! Derivatives are finite differences of rollouts ([`crate::linearise`]). Trial steps with several
//! dampings are one batch.

mod region;
mod steps;

use std::sync::Arc;

use asid_core::layout::Layout;
use asid_core::{Progress, Result};
use nalgebra::DMatrix;

use crate::linearise::{Differences, Linearisation, Open, Unknown, slope};
use crate::normal::{Normal, inverse, left_out};
use crate::predict::{Point, Predictor};

pub use region::Region;
use steps::Steps;

/// Information of a combination of parameters, relative to that of each of them, up to which it is
/// rounding: some tens of the last digits.
const UNRESOLVED: f64 = 1e-14;

/// How long and how finely a fit searches.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Maximum number of iterations.
    pub iterations: usize,
    /// Relative change of the cost below which a step counts as no progress.
    pub tolerance: f64,
    /// Whether derivatives with respect to the initial states are computed once and kept to the
    /// end: over a short window they hardly change.
    pub chord: bool,
}

impl Effort {
    /// No iteration: cost and derivatives at the given point.
    pub const LOOK: Self = Self {
        iterations: 0,
        tolerance: 1e-3,
        chord: false,
    };
    /// Fit of initial states on the first part of an episode, where derivatives hardly change.
    pub const START: Self = Self {
        iterations: 6,
        tolerance: 1e-3,
        chord: true,
    };
    /// A short fit.
    pub const BRIEF: Self = Self {
        iterations: 6,
        tolerance: 1e-3,
        chord: false,
    };
}

/// Result of a fit.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The best point.
    pub point: Point,
    /// Sum of squared residuals at the best point.
    pub cost: f64,
    /// Residuals at the best point.
    pub residuals: Vec<f64>,
    /// Norm of the Jacobian column of each free parameter at the last linearisation, per unit of
    /// the parameter.
    pub shows: Vec<f64>,
    /// Change of each free parameter per unit of each residual with the initial states refitted,
    /// `free x residuals`, in the parameter's unit.
    pub gains: DMatrix<f64>,
    /// Covariance of the free parameters for residuals of unit variance, in the parameters' units.
    ///
    /// A combination that the residuals do not show has no variance here.
    pub covariance: DMatrix<f64>,
    /// Whether each free parameter has a part in such a combination.
    pub unresolved: Vec<bool>,
    /// Indices of the free parameters.
    pub free: Vec<usize>,
    /// Derivatives with respect to the initial states at the last linearisation.
    pub starts: Arc<StartSlopes>,
}

impl Fit {
    /// Returns how far each free parameter moves, to first order, if the residuals change by
    /// `change`; in the parameter's unit.
    ///
    /// Entries that are not finite, as after a replay diverged, do not count.
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

/// Returns the sum of squares.
#[must_use]
pub fn cost(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| r * r).sum()
}

/// Returns the range of each episode in a residual vector.
#[must_use]
pub fn bounds(predictor: &Predictor<'_>) -> Vec<std::ops::Range<usize>> {
    let logs = predictor.logs();
    (0..logs.episodes.len())
        .map(|e| logs.offset(e)..logs.offset(e + 1))
        .collect()
}

/// Derivatives with respect to the initial states, which fits of similar models share.
#[derive(Clone, Debug, Default)]
pub struct StartSlopes {
    /// Steps of their finite differences, one per open coordinate, m or rad or per second.
    pub steps: Vec<f64>,
    /// One column per open coordinate, for all episodes at once; empty where only the steps are
    /// shared.
    pub columns: Vec<Vec<f64>>,
}

/// Where a fit begins, and within which limits.
pub struct Begin<'b> {
    /// Values and initial states.
    pub point: Point,
    /// Coordinates of the initial states that are fitted together with the values.
    pub open: &'b Open,
    /// How far each of these may lie from its first guess (`starts::reach`).
    pub reach: &'b [f64],
    /// Derivatives with respect to the initial states, from a similar model.
    ///
    /// They replace the first linearisation's own if no iteration follows. Otherwise only the steps
    /// of their differences are used.
    pub like: Option<&'b StartSlopes>,
    /// Region that the values may not leave.
    pub region: Option<&'b Region>,
}

impl<'b> Begin<'b> {
    /// Begins at some values and initial states, whose open coordinates are fitted within their
    /// reach.
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

/// Fits the unknowns and the open coordinates of the initial states until they converge or the work
/// is stopped.
///
/// Derivatives with respect to the initial states are kept while steps succeed: each costs a
/// replay, and they change little (a chord method).
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
    // Whether the derivatives with respect to the initial states belong to an earlier point.
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
    let inverse = inverse(&normal.information, UNRESOLVED);
    // Converts shares of the range to the parameter's unit.
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
        unresolved: left_out(&normal.information, UNRESOLVED),
        free,
        starts: Arc::new(StartSlopes {
            steps: work.differences.starts,
            columns: line.start_columns,
        }),
    }
}
