//! Least squares over open-loop rollouts: Levenberg and Marquardt's method, within bounds,
//! with the episodes' starts as nuisance parameters of their own.
//!
//! Derivatives are differences of rollouts. All columns of a Jacobian are one batch, and
//! so are the trial steps with several dampings. A start acts on its own episode only, so
//! that one rollout of all episodes moves all of them at once, and the normal equations
//! have arrow form: starts are eliminated episode by episode (Schur's complement).

use asid_core::layout::Layout;
use asid_core::parameter::Scale;
use asid_core::{Parameter, Result};
use nalgebra::{DMatrix, DVector};

use crate::predict::{Point, Predictor};

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
    /// To the end.
    pub const FULL: Self = Self {
        iterations: 25,
        tolerance: 1e-4,
        chord: false,
    };
    /// A quick look.
    pub const BRIEF: Self = Self {
        iterations: 6,
        tolerance: 1e-3,
        chord: false,
    };
}

impl Effort {
    /// The same where predictions scatter: no step is finer than the scatter, and each is dear.
    #[must_use]
    pub fn rough(self) -> Self {
        Self {
            iterations: self.iterations.min(6),
            tolerance: self.tolerance.max(3e-3),
            ..self
        }
    }
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

/// Response of the residuals, root mean square, that a difference aims at.
pub const AIM: f64 = 0.3;
/// The least multiple of what scatter alone makes that a difference aims at.
pub const ABOVE_SCATTER: f64 = 5.0;
/// First difference where predictions scatter, as a share of the range.
pub const ROUGH_START: f64 = 1e-2;
/// Multiples of the difference that a derivative is taken over where predictions scatter.
const STENCIL: [f64; 2] = [-1.0, 1.0];
/// Response to the whole range, root mean square in units of the noise, below which a
/// parameter does nothing here, and is left where it is.
pub const NOTHING: f64 = 0.05;
/// Shift of a start that shows how predictions scatter, m or rad.
pub const PROBE: f64 = 1e-9;
/// Smallest and largest difference, as a share of the range; the last where predictions scatter.
const STEPS: [f64; 3] = [1e-8, 0.02, 0.1];

/// Sum of squares.
#[must_use]
pub fn cost(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| r * r).sum()
}

/// Looks over the range of each free parameter in turn for a better point to start from:
/// `n` values of each, evenly on its scale.
///
/// # Errors
/// As [`Predictor::residuals`].
pub fn scan(
    predictor: &mut Predictor<'_>,
    unknowns: &[Unknown],
    point: Point,
    n: usize,
) -> Result<Point> {
    let mut point = point;
    for (i, unknown) in unknowns.iter().enumerate() {
        if !unknown.free || n == 0 {
            continue;
        }
        let mut points = vec![point.clone()];
        for k in 0..n {
            let mut other = point.clone();
            other.theta[i] = unknown.parameter.from_unit((k as f64 + 0.5) / n as f64);
            points.push(other);
        }
        let costs: Vec<f64> = predictor
            .residuals(&points)?
            .iter()
            .map(|r| cost(r))
            .collect();
        let lowest = (0..costs.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b]));
        point = points.swap_remove(lowest.unwrap_or(0));
    }
    Ok(point)
}

/// Differences to take derivatives with; they adapt.
#[derive(Clone, Debug)]
pub struct Differences {
    /// Of each parameter, as a share of its range.
    pub shares: Vec<f64>,
    /// Of each open coordinate of the starts, m or rad or per second.
    pub starts: Vec<f64>,
    /// Derivatives in the starts, where they are not taken anew.
    pub kept: Option<Vec<Vec<f64>>>,
}

impl Differences {
    /// A first guess for `n` parameters and `open` coordinates of the starts.
    #[must_use]
    pub fn new(n: usize, open: usize) -> Self {
        Self {
            shares: vec![1e-4; n],
            starts: vec![START_STEP; open],
            kept: None,
        }
    }

    /// A first guess where predictions scatter.
    #[must_use]
    pub fn rough(n: usize, open: usize) -> Self {
        Self {
            shares: vec![ROUGH_START; n],
            starts: vec![ROUGH_START_STEP; open],
            kept: None,
        }
    }
}

/// Value moved by a share of the range, to whichever side there is room; and the share
/// that it was really moved by.
#[must_use]
pub fn nudged(parameter: &Parameter, value: f64, share: f64) -> (f64, f64) {
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

/// First difference of a start's coordinates, m or rad or per second; where predictions scatter;
/// smallest and largest.
const START_STEP: f64 = 1e-5;
const ROUGH_START_STEP: f64 = 1e-3;
const START_STEPS: [f64; 2] = [1e-6, 1e-2];

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
    let free: Vec<usize> = (0..unknowns.len()).filter(|&i| unknowns[i].free).collect();
    let rough = predictor.is_rough();
    let stencil: &[f64] = if rough { &STENCIL } else { &[1.0] };
    let mut points = vec![point.clone()];
    if rough {
        let mut other = point.clone();
        for start in &mut other.starts {
            (0..2 * layout.nv).for_each(|c| start.shift(layout, c, PROBE));
        }
        points.push(other);
    }
    let mut moved = Vec::with_capacity(free.len() * stencil.len());
    for &i in &free {
        for by in stencil {
            let mut other = point.clone();
            let share = by * differences.shares[i];
            let (value, share) = nudged(&unknowns[i].parameter, point.theta[i], share);
            other.theta[i] = value;
            moved.push(share);
            points.push(other);
        }
    }
    let mut start_steps = differences.starts.clone();
    if differences.kept.is_some() {
        start_steps.clear();
    }
    for (&coordinate, &step) in open.iter().zip(&start_steps) {
        let mut other = point.clone();
        for start in &mut other.starts {
            start.shift(layout, coordinate, step);
        }
        points.push(other);
    }
    let present = predictor.present().iter().filter(|p| **p).count().max(1) as f64;
    let mut residuals = predictor.residuals(&points)?.into_iter();
    let base = residuals.next().unwrap_or_default();
    let mut next = || -> (Vec<f64>, f64) {
        let other = residuals.next().unwrap_or_default();
        let mut square = 0.0;
        let change: Vec<f64> = base
            .iter()
            .zip(&other)
            .map(|(a, b)| {
                let d = a - b;
                if !d.is_finite() {
                    return 0.0;
                }
                square += d * d;
                d
            })
            .collect();
        (change, (square / present).sqrt())
    };
    let aim = if rough {
        AIM.max(ABOVE_SCATTER * next().1)
    } else {
        AIM
    };
    let mut columns = Vec::with_capacity(free.len());
    for (k, &i) in free.iter().enumerate() {
        // Least squares over the stencil, through the point itself.
        let shares = &moved[k * stencil.len()..(k + 1) * stencil.len()];
        let square: f64 = shares.iter().map(|s| s * s).sum();
        let mut column = vec![0.0; base.len()];
        let mut response: f64 = 0.0;
        for &share in shares {
            let (change, size) = next();
            response = response.max(size);
            for (c, d) in column.iter_mut().zip(&change) {
                *c += d * share / square;
            }
        }
        columns.push(column);
        let h = &mut differences.shares[i];
        *h = if response > 0.0 {
            *h * (aim / response).clamp(1e-3, 1e3)
        } else {
            *h * 100.0
        }
        .clamp(STEPS[0], if rough { STEPS[2] } else { STEPS[1] });
    }
    let mut start_columns = differences.kept.clone().unwrap_or_default();
    for (h, step) in differences.starts.iter_mut().zip(&start_steps) {
        let (change, response) = next();
        start_columns.push(change.iter().map(|d| d / step).collect());
        let factor = if response > 0.0 {
            aim / response
        } else {
            100.0
        };
        *h = (step * factor.clamp(1e-3, 1e3)).clamp(START_STEPS[0], START_STEPS[1]);
    }
    Ok(Linearisation {
        residuals: base,
        columns,
        start_columns,
    })
}

/// Normal equations with the starts eliminated.
struct Normal {
    /// `free x free`.
    information: DMatrix<f64>,
    /// `free`.
    gradient: DVector<f64>,
    /// For each episode: inverse of its block, its coupling, and its gradient.
    episodes: Vec<(DMatrix<f64>, DMatrix<f64>, DVector<f64>)>,
}

/// Pseudo-inverse of a symmetric matrix, scaled to a unit diagonal first: directions whose
/// share is below `tolerance` stay out.
#[must_use]
pub fn inverse(matrix: &DMatrix<f64>, tolerance: f64) -> DMatrix<f64> {
    let n = matrix.nrows();
    if n == 0 {
        return DMatrix::zeros(0, 0);
    }
    let scale = |i: usize| 1.0 / matrix[(i, i)].abs().sqrt().max(1e-150);
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale(i) * scale(j));
    let inverse = scaled
        .pseudo_inverse(tolerance)
        .unwrap_or_else(|_| DMatrix::zeros(n, n));
    DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale(i) * scale(j))
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

impl Normal {
    fn new(line: &Linearisation, bounds: &[std::ops::Range<usize>], damping: f64) -> Self {
        let p = line.columns.len();
        let mut information = DMatrix::zeros(p, p);
        let mut gradient = DVector::zeros(p);
        for i in 0..p {
            gradient[i] = dot(&line.columns[i], &line.residuals);
            for j in 0..=i {
                let x = dot(&line.columns[i], &line.columns[j]);
                information[(i, j)] = x;
                information[(j, i)] = x;
            }
        }
        let m = line.start_columns.len();
        let mut episodes = Vec::new();
        if m > 0 {
            for range in bounds {
                let part = |c: &Vec<f64>| c[range.clone()].to_vec();
                let starts: Vec<Vec<f64>> = line.start_columns.iter().map(part).collect();
                let columns: Vec<Vec<f64>> = line.columns.iter().map(part).collect();
                let r = &line.residuals[range.clone()];
                let mut block = DMatrix::from_fn(m, m, |i, j| dot(&starts[i], &starts[j]));
                let coupling = DMatrix::from_fn(p, m, |i, j| dot(&columns[i], &starts[j]));
                let g = DVector::from_fn(m, |i, _| dot(&starts[i], r));
                for i in 0..m {
                    block[(i, i)] += damping * block[(i, i)] + 1e-9;
                }
                let inverse = inverse(&block, 1e-12);
                information -= &coupling * &inverse * coupling.transpose();
                gradient -= &coupling * &inverse * &g;
                episodes.push((inverse, coupling, g));
            }
        }
        Self {
            information,
            gradient,
            episodes,
        }
    }

    /// Step of the free parameters; those in `held` do not move.
    fn step(&self, damping: f64, held: &[bool]) -> DVector<f64> {
        let p = self.gradient.len();
        // Starts alone.
        if p == 0 {
            return DVector::zeros(0);
        }
        let mut a = self.information.clone();
        let mut g = self.gradient.clone();
        for i in 0..p {
            a[(i, i)] += damping * self.information[(i, i)].abs() + 1e-12;
            if held[i] {
                for j in 0..p {
                    a[(i, j)] = 0.0;
                    a[(j, i)] = 0.0;
                }
                a[(i, i)] = 1.0;
                g[i] = 0.0;
            }
        }
        a.lu().solve(&g).unwrap_or_else(|| DVector::zeros(p))
    }

    /// Steps of an episode's start, given that of the parameters.
    fn start_step(&self, episode: usize, step: &DVector<f64>) -> DVector<f64> {
        let (inverse, coupling, g) = &self.episodes[episode];
        inverse * (g - coupling.transpose() * step)
    }
}

/// Places of the episodes in a residual vector.
fn bounds(predictor: &Predictor<'_>) -> Vec<std::ops::Range<usize>> {
    let logs = predictor.logs();
    (0..logs.episodes.len())
        .map(|e| logs.offset(e)..logs.offset(e + 1))
        .collect()
}

/// Fits the unknowns and the starts' open coordinates from `point` on.
///
/// # Errors
/// As [`Predictor::residuals`].
pub fn fit(
    predictor: &mut Predictor<'_>,
    layout: &Layout,
    unknowns: &[Unknown],
    point: Point,
    open: &Open,
    effort: Effort,
) -> Result<Fit> {
    let free: Vec<usize> = (0..unknowns.len()).filter(|&i| unknowns[i].free).collect();
    let bounds = bounds(predictor);
    let (mut differences, effort) = if predictor.is_rough() {
        (
            Differences::rough(unknowns.len(), open.len()),
            effort.rough(),
        )
    } else {
        (Differences::new(unknowns.len(), open.len()), effort)
    };
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

/// Change of the value per share of the range.
#[must_use]
pub fn slope(parameter: &Parameter, value: f64) -> f64 {
    let [low, high] = parameter.range;
    match parameter.scale {
        Scale::Log => value * (high / low).ln(),
        Scale::Linear | Scale::Binary(_) => high - low,
    }
}
