//! Derivatives of predictions: differences of rollouts, all columns of a Jacobian in one batch. A start acts on
//! its own episode only, so that one rollout of all episodes moves all of them at once.
//!
//! A difference aims at a response that is seen and small: it adapts from one linearisation to the next.

use asid_core::layout::Layout;
use asid_core::parameter::Scale;
use asid_core::{Parameter, Result};

use crate::predict::{Point, Predictor};

/// Response of the residuals, root mean square, that a difference aims at.
const AIM: f64 = 0.3;
/// Response to the whole range, root mean square in units of the noise, below which a
/// parameter does nothing here, and is left where it is.
pub const NOTHING: f64 = 0.05;
/// Smallest and largest difference, as a share of the range.
const STEPS: [f64; 2] = [1e-8, 0.02];

/// Factor to the difference that its response asks for from which on a column is taken anew: within it the response is small and is seen.
const SETTLED: f64 = 4.0;

/// A value to fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// The parameter: name, range, scale.
    pub parameter: Parameter,
    /// Whether it may move; one that may not keeps its start value.
    pub free: bool,
}

impl Unknown {
    /// A parameter that may move.
    #[must_use]
    pub fn free(parameter: Parameter) -> Self {
        Self {
            parameter,
            free: true,
        }
    }
}

/// Differences to take derivatives with; they adapt.
#[derive(Clone, Debug)]
pub struct Differences {
    /// Of each parameter, as a share of its range.
    pub shares: Vec<f64>,
    /// Of each open coordinate of the starts, m or rad or per second.
    pub starts: Vec<f64>,
}

impl Differences {
    /// A first guess for `n` parameters and `open` coordinates of the starts.
    #[must_use]
    pub fn new(n: usize, open: usize) -> Self {
        Self {
            shares: vec![1e-4; n],
            starts: vec![START_STEP; open],
        }
    }

    /// Which columns were taken over differences other than these by so much that they are to be taken anew: first those of the
    /// `free` parameters, then those of the starts.
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

/// Value moved by a share of the range, to whichever side there is room; and the share
/// that it was really moved by.
fn nudged(parameter: &Parameter, value: f64, share: f64) -> (f64, f64) {
    let u = parameter.to_unit(value).clamp(0.0, 1.0);
    let to = if (0.0..=1.0).contains(&(u + share)) {
        u + share
    } else {
        u - share
    };
    (parameter.from_unit(to), to - u)
}

/// Derivatives of the prediction at a point, in units of each parameter's range:
/// residuals there and the columns, first the free parameters, then the coordinates of
/// the starts.
#[derive(Clone, Debug, Default)]
pub struct Linearisation {
    /// Residuals at the point.
    pub residuals: Vec<f64>,
    /// One column a free parameter.
    pub columns: Vec<Vec<f64>>,
    /// One column an open coordinate: of every episode at once.
    pub start_columns: Vec<Vec<f64>>,
}

/// Coordinates of the starts that are not known: the same for all episodes of a set.
pub type Open = Vec<usize>;

/// First difference of a start's coordinates, m or rad or per second.
const START_STEP: f64 = 1e-5;
/// Smallest and largest difference of a start's coordinates, m or rad or per second.
const START_STEPS: [f64; 2] = [1e-6, 1e-2];

/// Columns that are taken anew, free parameters first, then coordinates of the starts; the others are those of a linearisation nearby.
#[derive(Clone, Copy)]
pub struct Anew<'l> {
    /// One flag a column.
    pub due: &'l [bool],
    /// Where the other columns are from.
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

/// The same, with some columns taken `anew` alone; all where it says none.
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

/// Factor by which a difference is changed, by its response.
fn towards_aim(response: f64) -> f64 {
    if response > 0.0 {
        (AIM / response).clamp(1e-3, 1e3)
    } else {
        100.0
    }
}

/// Change of the value per share of the range.
#[must_use]
pub fn slope(parameter: &Parameter, value: f64) -> f64 {
    let [low, high] = parameter.range;
    match parameter.scale {
        Scale::Log => value * (high / low).ln(),
        Scale::Linear | Scale::Binary(_) => high - low,
    }
}
