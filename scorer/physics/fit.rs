//! Output-error fits: unknowns and open initial states by nonlinear least squares over replays.
//!
//! The method is Levenberg-Marquardt (Marquardt 1963) with Marquardt's scaling and forward
//! differences. Huber's weights (Huber 1964) keep outliers from deciding. Each log has its own
//! initial state: its Jacobian columns are nonzero only in the rows of its log. One replay
//! therefore shifts the initial states of all logs at once.

use asid_core::Layout;
use asid_core::Result;
use nalgebra::{DMatrix, DVector};

use super::logs::Logs;
use super::model::{Point, Replays, World};

/// Maximum number of linearisations of a fit: from a label's values it takes three to six, from the
/// off values of an effect some more.
const MOST_ROUNDS: usize = 20;
/// Relative decrease of the cost below which a fit has converged.
const ENDED: f64 = 1e-4;
/// Residual, in robust standard deviations, above which a reading counts linearly and not squared.
///
/// Huber's 1.345 costs 5 % of efficiency and is meant for more outliers than a log has.
const HUBER: f64 = 3.0;
/// Finite-difference step of an initial position: m or rad.
const POSITION_STEP: f64 = 1e-5;
/// Finite-difference step of an initial velocity: m/s or rad/s.
const SPEED_STEP: f64 = 1e-4;
/// Points that are replayed at once.
const CAPACITY: usize = 8;
/// Damping at which a step is given up: the step is then a ten-thousandth of the Gauss-Newton step.
const STUCK: f64 = 1e4;
/// Factors of the finite-difference steps, used one after the other.
///
/// The time at which a simulated impact falls within its time step changes the speed after it a
/// little. Predictions are therefore rough in every unknown. Small steps then show the roughness,
/// and larger ones the slope.
const STRETCHES: [f64; 3] = [1.0, 30.0, 600.0];

/// A fit.
pub struct Fit<'a> {
    layout: &'a Layout,
    replays: Replays,
    ranges: Vec<[f64; 2]>,
    steps: Vec<f64>,
    /// Indices of the unknowns that are fitted.
    free: Vec<usize>,
    /// Coordinates of the initial states that are fitted.
    open: Vec<usize>,
    /// Factor of the finite-difference steps.
    stretch: f64,
}

/// Residuals of each log; NaN for a missing reading.
type Residuals = Vec<Vec<f64>>;

impl<'a> Fit<'a> {
    /// Fits all unknowns of a world and the `open` coordinates of the initial states.
    ///
    /// # Errors
    /// If the engine cannot set an unknown.
    pub fn new(layout: &'a Layout, world: &World, open: Vec<usize>) -> Result<Self> {
        Ok(Self {
            layout,
            replays: Replays::new(world, CAPACITY)?,
            ranges: world.unknowns.iter().map(|u| u.range).collect(),
            steps: world.unknowns.iter().map(|u| u.step).collect(),
            free: (0..world.unknowns.len()).collect(),
            open,
            stretch: 1.0,
        })
    }

    /// Restricts the fit to the initial states.
    #[must_use]
    pub fn starts_only(mut self) -> Self {
        self.free.clear();
        self
    }

    /// Predicted readings at a point, one array per log.
    ///
    /// # Errors
    /// If a value is not physical or the engine fails.
    pub fn predict(&mut self, logs: &mut Logs, point: &Point) -> Result<Vec<Vec<f64>>> {
        let points = std::slice::from_ref(point);
        Ok(self.replays.readings(logs, points)?.swap_remove(0))
    }

    /// Residuals at each of the points; `None` if a simulation diverges.
    fn residuals(&mut self, logs: &mut Logs, points: &[Point]) -> Result<Vec<Option<Residuals>>> {
        let readings = self.replays.readings(logs, points)?;
        let whole = |logs: &[Vec<f64>]| logs.iter().flatten().all(|x| x.is_finite());
        let residual = |r: &Vec<Vec<f64>>| whole(r).then(|| logs.residuals(r));
        Ok(readings.iter().map(residual).collect())
    }

    /// The point of least cost near `start`; `start` itself if its simulation diverges.
    ///
    /// # Errors
    /// If a value is not physical or the engine fails.
    pub fn run(&mut self, logs: &mut Logs, start: Point) -> Result<Point> {
        let mut here = start;
        if self.free.is_empty() && self.open.is_empty() {
            return Ok(here);
        }
        for stretch in STRETCHES {
            self.stretch = stretch;
            here = self.descend(logs, here)?;
        }
        self.stretch = 1.0;
        Ok(here)
    }

    /// Runs Levenberg-Marquardt with one size of finite differences.
    fn descend(&mut self, logs: &mut Logs, start: Point) -> Result<Point> {
        let mut here = start;
        let mut damping = 1e-3;
        for _ in 0..MOST_ROUNDS {
            let mut points = vec![here.clone()];
            points.extend(self.neighbours(&here));
            let mut all = self.residuals(logs, &points)?;
            let Some(at) = all[0].take() else {
                return Ok(here);
            };
            let scale = robust_deviation(&at).max(1.0);
            let (normal, gradient) = self.normal_equations(&here, &at, &all[1..], scale);
            let before = cost(&at, scale);
            let mut after = before;
            while damping < STUCK {
                let step = damped_step(&normal, &gradient, damping);
                let next = self.moved(&here, &step);
                let found = self.residuals(logs, std::slice::from_ref(&next))?;
                let reached = found[0].as_ref().map_or(f64::INFINITY, |r| cost(r, scale));
                if reached < before {
                    (here, after, damping) = (next, reached, damping / 9.0);
                    break;
                }
                damping *= 8.0;
            }
            if before - after < ENDED * before {
                break;
            }
        }
        Ok(here)
    }

    /// The sum of squares at a point, and the one that its linearisation predicts for a step within
    /// the ranges.
    ///
    /// `None` if the simulation diverges.
    ///
    /// # Errors
    /// If a value is not physical or the engine fails.
    pub fn promise(&mut self, logs: &mut Logs, here: &Point) -> Result<Option<[f64; 2]>> {
        let mut points = vec![here.clone()];
        points.extend(self.neighbours(here));
        let mut all = self.residuals(logs, &points)?;
        let Some(at) = all[0].take() else {
            return Ok(None);
        };
        // Without Huber's weights, so that predictions from different points can be compared.
        let scale = f64::INFINITY;
        let (normal, gradient) = self.normal_equations(here, &at, &all[1..], scale);
        let mut step = damped_step(&normal, &gradient, 1e-6);
        for (i, &u) in self.free.iter().enumerate() {
            let [low, high] = self.ranges[u];
            step[i] = (here.values[u] + step[i]).clamp(low, high) - here.values[u];
        }
        let before = cost(&at, scale);
        let after = before - 2.0 * gradient.dot(&step) + step.dot(&(&normal * &step));
        Ok(Some([before, after.clamp(0.0, before)]))
    }

    /// Sum of squares at a point, infinite if the simulation diverges, and the number of readings.
    ///
    /// # Errors
    /// If a value is not physical or the engine fails.
    pub fn squares(&mut self, logs: &mut Logs, here: &Point) -> Result<(f64, usize)> {
        let mut all = self.residuals(logs, std::slice::from_ref(here))?;
        let Some(at) = all[0].take() else {
            return Ok((f64::INFINITY, 1));
        };
        let present = || at.iter().flatten().filter(|r| r.is_finite());
        Ok((present().map(|r| r * r).sum(), present().count()))
    }

    /// Finite-difference step of an unknown: away from a near upper bound, and at most half of the
    /// range.
    fn step(&self, unknown: usize, value: f64) -> f64 {
        let [low, high] = self.ranges[unknown];
        let step = (self.stretch * self.steps[unknown]).min(0.5 * (high - low));
        if value + step > high { -step } else { step }
    }

    fn start_step(&self, coordinate: usize) -> f64 {
        if coordinate < self.layout.nv {
            self.stretch * POSITION_STEP
        } else {
            self.stretch * SPEED_STEP
        }
    }

    /// One point per replay: each moved unknown, then each coordinate moved in all initial states.
    fn neighbours(&self, here: &Point) -> Vec<Point> {
        let unknowns = self.free.iter().map(|&u| {
            let mut point = here.clone();
            point.values[u] += self.step(u, here.values[u]);
            point
        });
        let starts = self.open.iter().map(|&c| {
            let mut point = here.clone();
            let step = self.start_step(c);
            point
                .starts
                .iter_mut()
                .for_each(|s| s.shift(self.layout, c, step));
            point
        });
        unknowns.chain(starts).collect()
    }

    /// Normal equations. The columns are the unknowns, then log by log the coordinates of the
    /// initial states.
    fn normal_equations(
        &self,
        here: &Point,
        at: &Residuals,
        moved: &[Option<Residuals>],
        scale: f64,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let (k, m) = (self.free.len(), self.open.len());
        let size = k + m * at.len();
        let mut normal = DMatrix::zeros(size, size);
        let mut gradient = DVector::zeros(size);
        let unknowns = self.free.iter().map(|&u| self.step(u, here.values[u]));
        let steps: Vec<f64> = unknowns
            .chain(self.open.iter().map(|&c| self.start_step(c)))
            .collect();
        let mut row = vec![0.0; k + m];
        for (l, residuals) in at.iter().enumerate() {
            let place = |j: usize| if j < k { j } else { k + l * m + j - k };
            for (i, &r) in residuals.iter().enumerate().filter(|(_, r)| r.is_finite()) {
                let weight = (HUBER * scale / r.abs()).min(1.0);
                for ((x, moved), step) in row.iter_mut().zip(moved).zip(&steps) {
                    // The residual falls as the prediction grows.
                    *x = moved.as_ref().map_or(0.0, |r1| (r - r1[l][i]) / step);
                }
                for a in (0..k + m).filter(|&a| row[a] != 0.0) {
                    gradient[place(a)] += weight * row[a] * r;
                    for b in 0..=a {
                        normal[(place(a), place(b))] += weight * row[a] * row[b];
                    }
                }
            }
        }
        normal.fill_upper_triangle_with_lower_triangle();
        (normal, gradient)
    }

    fn moved(&self, here: &Point, step: &DVector<f64>) -> Point {
        let mut point = here.clone();
        for (i, &u) in self.free.iter().enumerate() {
            let [low, high] = self.ranges[u];
            point.values[u] = (point.values[u] + step[i]).clamp(low, high);
        }
        for (l, start) in point.starts.iter_mut().enumerate() {
            for (i, &c) in self.open.iter().enumerate() {
                let at = self.free.len() + l * self.open.len() + i;
                start.shift(self.layout, c, step[at]);
            }
        }
        point
    }
}

/// Robust standard deviation of the residuals, from their median absolute value.
#[must_use]
pub fn robust_deviation(residuals: &[Vec<f64>]) -> f64 {
    /// Ratio of a normal variable's standard deviation to its median absolute value.
    const NORMAL: f64 = 1.482_602_218_505_602;
    let sizes = residuals.iter().flatten().filter(|r| r.is_finite());
    let sizes: Vec<f64> = sizes.map(|r| r.abs()).collect();
    crate::statistics::median(&sizes).map_or(0.0, |m| NORMAL * m)
}

/// Huber's cost, in units of half the squared noise.
fn cost(residuals: &[Vec<f64>], scale: f64) -> f64 {
    let bend = HUBER * scale;
    let one = |r: f64| {
        if r.abs() <= bend {
            r * r
        } else {
            bend * (2.0 * r.abs() - bend)
        }
    };
    let present = residuals.iter().flatten().filter(|r| r.is_finite());
    present.map(|r| one(*r)).sum()
}

fn damped_step(normal: &DMatrix<f64>, gradient: &DVector<f64>, damping: f64) -> DVector<f64> {
    let mut damped = normal.clone();
    let largest = normal.diagonal().max().max(f64::MIN_POSITIVE);
    for i in 0..damped.nrows() {
        // A direction that the logs do not determine does not move.
        damped[(i, i)] += damping * normal[(i, i)] + 1e-12 * largest;
    }
    match damped.cholesky() {
        Some(factor) => factor.solve(gradient),
        None => DVector::zeros(gradient.len()),
    }
}
