//! Derivatives of predictions: finite differences of rollouts, with all columns of a Jacobian in
//! one batch.
//!
//! An initial state acts on its own episode alone. One rollout of all episodes therefore perturbs
//! all of them at once.
//!
//! The step of a difference adapts from one linearisation to the next, so that the response is
//! visible and small.

use asid_core::layout::Layout;
use asid_core::parameter::Scale;
use asid_core::{Parameter, Result};

use crate::predict::{Point, Predictor};

/// Root mean square response of the residuals that the step of a difference aims at: visible, and
/// small against the noise.
const AIM: f64 = 0.3;
/// Root mean square response to the whole range, in units of the noise, below which a parameter has
/// no effect here and is held.
pub const NOTHING: f64 = 0.05;
/// Smallest and largest step of a difference, as a share of the range.
const STEPS: [f64; 2] = [1e-8, 0.02];

/// Ratio of the step to the one that the response asks for, from which on a column is computed
/// again: below it the response is small and visible.
const SETTLED: f64 = 4.0;

/// A value to be fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// The parameter: name, range, scale.
    pub parameter: Parameter,
    /// Whether it may move; otherwise it keeps its initial value.
    pub free: bool,
}

impl Unknown {
    /// Makes a parameter that may move, unless it has only two values: these have no derivative.
    #[must_use]
    pub fn free(parameter: Parameter) -> Self {
        Self {
            free: !parameter.is_binary(),
            parameter,
        }
    }
}

/// Steps of the finite differences, which adapt to the responses.
#[derive(Clone, Debug)]
pub struct Differences {
    /// Step of each parameter, as a share of its range.
    pub shares: Vec<f64>,
    /// Step of each open coordinate of the initial states, m or rad or per second.
    pub starts: Vec<f64>,
}

impl Differences {
    /// First guess for `n` parameters and `open` coordinates of the initial states.
    #[must_use]
    pub fn new(n: usize, open: usize) -> Self {
        Self {
            shares: vec![1e-4; n],
            starts: vec![START_STEP; open],
        }
    }

    /// Returns which columns to compute again because their steps differ too much from the present
    /// ones.
    ///
    /// Columns of the `free` parameters come first, then those of the initial states.
    #[must_use]
    pub fn due_since(&self, before: &Self, free: &[usize]) -> Vec<bool> {
        let is_off = |a: f64, b: f64| (a / b).max(b / a) >= SETTLED;
        let parameters = free
            .iter()
            .map(|&i| is_off(before.shares[i], self.shares[i]));
        let starts = before.starts.iter().zip(&self.starts);
        parameters
            .chain(starts.map(|(a, b)| is_off(*a, *b)))
            .collect()
    }
}

/// Moves a value by a share of its range, to the side where there is room.
///
/// Returns the new value and the share by which it actually moved.
fn nudged(parameter: &Parameter, value: f64, share: f64) -> (f64, f64) {
    let u = parameter.to_unit(value).clamp(0.0, 1.0);
    let to = if (0.0..=1.0).contains(&(u + share)) {
        u + share
    } else {
        u - share
    };
    (parameter.from_unit(to), to - u)
}

/// Residuals and derivatives of the prediction at a point, per unit range of each parameter.
///
/// Columns of the free parameters come first, then those of the coordinates of the initial states.
#[derive(Clone, Debug, Default)]
pub struct Linearisation {
    /// Residuals at the point.
    pub residuals: Vec<f64>,
    /// One column per free parameter.
    pub columns: Vec<Vec<f64>>,
    /// One column per open coordinate, for all episodes at once.
    pub start_columns: Vec<Vec<f64>>,
}

/// Unknown coordinates of the initial states, the same for all episodes of a set.
pub type Open = Vec<usize>;

/// First step of an initial state's coordinates, m or rad or per second.
const START_STEP: f64 = 1e-5;
/// Smallest and largest step of an initial state's coordinates, m or rad or per second.
const START_STEPS: [f64; 2] = [1e-6, 1e-2];

/// Which columns are computed again; the others are taken from a nearby linearisation.
///
/// Free parameters come first, then coordinates of the initial states.
#[derive(Clone, Copy)]
pub struct Anew<'l> {
    /// One flag per column.
    pub due: &'l [bool],
    /// Source of the other columns.
    pub nearby: &'l Linearisation,
}

/// Linearises the predictions.
///
/// # Errors
/// As [`Predictor::residuals`].
pub fn linearise(
    predictor: &mut Predictor<'_>,
    layout: &Layout,
    unknowns: &[Unknown],
    point: &Point,
    open: &Open,
    differences: &mut Differences,
) -> Result<Linearisation> {
    linearise_anew(
        predictor,
        layout,
        unknowns,
        (point, open),
        differences,
        None,
    )
}

/// Linearises the predictions, computing only the columns that `anew` marks as due; all columns if
/// it is `None`.
///
/// # Errors
/// As [`Predictor::residuals`].
pub fn linearise_anew(
    predictor: &mut Predictor<'_>,
    layout: &Layout,
    unknowns: &[Unknown],
    (point, open): (&Point, &Open),
    differences: &mut Differences,
    anew: Option<Anew<'_>>,
) -> Result<Linearisation> {
    let free: Vec<usize> = (0..unknowns.len()).filter(|&i| unknowns[i].free).collect();
    let is_due = |column: usize| anew.is_none_or(|a| a.due[column]);
    let mut points = vec![point.clone()];
    let mut moved = vec![0.0; free.len()];
    for (k, &i) in free.iter().enumerate().filter(|(k, _)| is_due(*k)) {
        let mut other = point.clone();
        let (value, share) = nudged(
            &unknowns[i].parameter,
            point.theta[i],
            differences.shares[i],
        );
        other.theta[i] = value;
        moved[k] = share;
        points.push(other);
    }
    let starts = open.iter().zip(&differences.starts).enumerate();
    for (_, (&coordinate, &step)) in starts.filter(|(j, _)| is_due(free.len() + j)) {
        let mut other = point.clone();
        for start in &mut other.starts {
            start.shift(layout, coordinate, step);
        }
        points.push(other);
    }
    let present = predictor.present().iter().filter(|p| **p).count().max(1) as f64;
    let mut residuals = predictor.residuals(&points)?.into_iter();
    let base = residuals.next().unwrap_or_default();
    let mut next = |step: f64| -> (Vec<f64>, f64) {
        let other = residuals.next().unwrap_or_default();
        let mut square = 0.0;
        let pairs = base.iter().zip(&other);
        let change = pairs.map(|(a, b)| {
            let d = a - b;
            if !d.is_finite() {
                return 0.0;
            }
            square += d * d;
            d / step
        });
        (change.collect(), (square / present).sqrt())
    };
    let mut columns = Vec::with_capacity(free.len());
    for (k, &i) in free.iter().enumerate() {
        if let Some(anew) = anew.filter(|_| !is_due(k)) {
            columns.push(anew.nearby.columns[k].clone());
            continue;
        }
        let (column, response) = next(moved[k]);
        columns.push(column);
        let h = &mut differences.shares[i];
        *h = (*h * towards_aim(response)).clamp(STEPS[0], STEPS[1]);
    }
    let mut start_columns = Vec::with_capacity(open.len());
    for (j, h) in differences.starts.iter_mut().enumerate() {
        if let Some(anew) = anew.filter(|_| !is_due(free.len() + j)) {
            start_columns.push(anew.nearby.start_columns[j].clone());
            continue;
        }
        let (column, response) = next(*h);
        start_columns.push(column);
        *h = (*h * towards_aim(response)).clamp(START_STEPS[0], START_STEPS[1]);
    }
    Ok(Linearisation {
        residuals: base,
        columns,
        start_columns,
    })
}

/// Returns the factor that brings the step of a difference towards the aimed response.
fn towards_aim(response: f64) -> f64 {
    if response > 0.0 {
        (AIM / response).clamp(1e-3, 1e3)
    } else {
        100.0
    }
}

/// Returns the change of the value per share of the range.
#[must_use]
pub fn slope(parameter: &Parameter, value: f64) -> f64 {
    let [low, high] = parameter.range;
    match parameter.scale {
        Scale::Log => value * (high / low).ln(),
        Scale::Linear | Scale::Binary(_) => high - low,
    }
}
