//! Kalman filter and smoother with the missing force as a hidden state.
//!
//! Relative to a trajectory `x_k`, the true state is `x_k` changed by `d_k` (tangent coordinates),
//! and
//!
//! ```text
//! d_{k+1} = A_k d_k + B_k (w_k + e_k) + f(x_k) - x_{k+1}
//! w_{k+1} = rho_k w_k + noise,   variance q (1 - rho_k^2),   rho_k = exp(-dt_k / tau)
//! e_k     = noise,               variance white + free_k
//! y_k     = h(x_k) + H_k d_k + noise,   variance r
//! ```
//!
//! `w_k` is the generalized force that the model lacks: a first-order process at each degree of
//! freedom. This is a latent force model (Alvarez, Luengo and Lawrence 2009) in state-space form
//! (Hartikainen and Sarkka 2010). `e_k` is independent from row to row. `white` covers forces that
//! change at once, such as friction where a joint reverses. `free_k` is known and non-zero in some
//! rows only. It covers the force that may hold a joint at rest, and the force of a drive whose
//! state before the log is unknown.
//!
//! Readings are processed one at a time, so no matrix is inverted. The forward pass is in
//! `filter.rs`. Smoothing is the adjoint recursion of Bryson and Frazier (Bierman 1977), which
//! inverts no matrix either, in `adjoint.rs`. Columns (the change of `f` and `h` per unit of an
//! effect) pass through the same filter: in whitened innovations, all effects form one linear
//! regression.

mod adjoint;
mod blocks;
mod filter;
mod matrix;
mod regress;
mod segment;
mod shown;

use nalgebra::{DMatrix, DVector};

use super::step_map::LinearEpisode;
use super::walk::Walk;

use adjoint::backward;
use blocks::Blocks;
use filter::{Filter, Step};

/// Covariances of the latent force and of the readings.
#[derive(Clone, Debug, PartialEq)]
pub struct NoiseModel {
    /// Stationary variance of the missing force, one per degree of freedom.
    pub q: Vec<f64>,
    /// Its correlation time, s, one per degree of freedom.
    pub tau: Vec<f64>,
    /// Variance of the white part of the missing force, independent from row to row; one per degree
    /// of freedom.
    pub white: Vec<f64>,
    /// Variance of each entry of a reading.
    pub r: Vec<f64>,
}

impl NoiseModel {
    /// Returns the model with all variances of the missing force scaled, those of the white part to
    /// no less than `least`.
    #[must_use]
    pub fn scaled(&self, factor: f64, least: &[f64]) -> Self {
        let white = self.white.iter().zip(least);
        Self {
            q: self.q.iter().map(|q| q * factor).collect(),
            white: white.map(|(q, least)| (q * factor).max(*least)).collect(),
            ..self.clone()
        }
    }

    /// Returns the model with the variances of the force at one degree of freedom scaled, that of
    /// its white part to no less than `least`.
    #[must_use]
    pub fn scaled_at(&self, dof: usize, factor: f64, least: &[f64]) -> Self {
        let mut scaled = self.clone();
        scaled.q[dof] *= factor;
        scaled.white[dof] = (scaled.white[dof] * factor).max(least[dof]);
        scaled
    }
}

/// Prior of an episode's initial state: mean and variances of its change from the trajectory's
/// first state.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// Mean, `nx`.
    pub mean: Vec<f64>,
    /// Variances, `nx`.
    pub variance: Vec<f64>,
    /// Variances of a state of which nothing is known, `nx`.
    ///
    /// The filter restarts with them behind a row that the engine could not step: an initial state
    /// that the log gives says nothing of the state there.
    pub unknown: Vec<f64>,
}

/// One episode as the filter sees it.
#[derive(Clone, Copy)]
pub struct Problem<'a> {
    /// Its rows.
    pub walk: &'a Walk,
    /// Its linearisation.
    pub linear: &'a LinearEpisode,
    /// Derivatives of the next state with respect to generalized forces, `(rows - 1) x nx x nv`.
    pub b: &'a [f64],
    /// Prior of its initial state.
    pub start: &'a Start,
    /// Variance of the free force in each row, `rows x nv`; empty for none.
    pub free: &'a [f64],
    /// For a segment: directions in which its replays scatter, `rows x ns x directions`; empty for
    /// none.
    pub scatter: &'a [f64],
}

/// Sums from which the noise model is estimated.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sums {
    /// Number of steps from a row to the next.
    pub steps: f64,
    /// Sum of the steps' durations, s.
    pub seconds: f64,
    /// For each force: sum of squares at the later row, of squares at the earlier row, and of
    /// products.
    pub force: Vec<[f64; 3]>,
    /// For each force: sum of squares of its white part.
    pub white: Vec<f64>,
    /// For each entry of a reading: sum of squared residuals, and their number.
    pub reading: Vec<[f64; 2]>,
}

impl Sums {
    /// Adds the sums of another episode.
    pub fn add(&mut self, other: &Self) {
        self.steps += other.steps;
        self.seconds += other.seconds;
        if self.force.is_empty() {
            self.force = vec![[0.0; 3]; other.force.len()];
            self.white = vec![0.0; other.white.len()];
            self.reading = vec![[0.0; 2]; other.reading.len()];
        }
        for (a, b) in self.force.iter_mut().zip(&other.force) {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        }
        self.white
            .iter_mut()
            .zip(&other.white)
            .for_each(|(a, b)| *a += b);
        for (a, b) in self.reading.iter_mut().zip(&other.reading) {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        }
    }
}

/// A smoothed episode.
#[derive(Clone, Debug, Default)]
pub struct Smoothed {
    /// Natural log-likelihood of its readings, up to a constant of `ln 2 pi` per reading.
    pub log_likelihood: f64,
    /// Change of the trajectory, `rows x nx`.
    pub change: Vec<f64>,
    /// For a segment: damped changes of its initial state, each `nx`, for where the whole step goes
    /// too far.
    pub damped: Vec<Vec<f64>>,
    /// For a segment: predicted sum of squared residuals of each entry in a replay from the changed
    /// initial state.
    pub promised: Vec<f64>,
    /// For a segment: a square root of the posterior covariance of its initial state, `nx` rows;
    /// empty for other walks.
    pub root: DMatrix<f64>,
    /// Variances of the change, `rows x nx`.
    pub change_variance: Vec<f64>,
    /// Missing force, `rows x nv`.
    pub force: Vec<f64>,
    /// Variances of the missing force, `rows x nv`.
    pub force_variance: Vec<f64>,
    /// Sums for the noise model.
    pub sums: Sums,
}

impl Smoothed {
    /// Returns an episode of `rows` rows in which the state change, the force and the sums are
    /// zero.
    fn unmoved(rows: usize, noise: &NoiseModel) -> Self {
        let (nv, ns) = (noise.q.len(), noise.r.len());
        let nx = 2 * nv;
        Self {
            change: vec![0.0; rows * nx],
            root: DMatrix::zeros(0, 0),
            change_variance: vec![0.0; rows * nx],
            force: vec![0.0; rows * nv],
            force_variance: vec![0.0; rows * nv],
            sums: Sums {
                force: vec![[0.0; 3]; nv],
                white: vec![0.0; nv],
                reading: vec![[0.0; 2]; ns],
                ..Sums::default()
            },
            ..Self::default()
        }
    }
}

/// Linear regression from a filter pass with columns: `X'X`, `X'y` and the log-likelihood without
/// the columns.
#[derive(Clone, Debug)]
pub struct Regression {
    /// Log-likelihood at the trajectory and the present parameters.
    pub log_likelihood: f64,
    /// `X'X`, `m x m`.
    pub gram: DMatrix<f64>,
    /// `X'y`, `m`.
    pub moment: DVector<f64>,
}

impl Regression {
    /// Adds the regression of another episode.
    pub fn add(&mut self, other: &Self) {
        self.log_likelihood += other.log_likelihood;
        self.gram += &other.gram;
        self.moment += &other.moment;
    }
}

/// Returns whether the readings of an episode tell of the force at each degree of freedom.
///
/// The episode is no segment.
///
/// They do if one that is present depends on a coordinate that the force moves, directly or over
/// others.
#[must_use]
pub fn told(problem: Problem<'_>, noise: &NoiseModel) -> Vec<bool> {
    blocks::told(problem, noise)
}

/// Returns the log-likelihood of an episode that is not a segment.
#[must_use]
pub fn log_likelihood(problem: Problem<'_>, noise: &NoiseModel) -> f64 {
    match Blocks::of(problem, noise) {
        Some(blocks) => blocks.log_likelihood(problem, noise),
        None => log_likelihood_of_one(problem, noise),
    }
}

/// Returns the log-likelihood of an episode, treated as one block.
fn log_likelihood_of_one(problem: Problem<'_>, noise: &NoiseModel) -> f64 {
    let mut filter = Filter::new(problem, noise);
    for k in 0..problem.linear.rows {
        for entry in 0..filter.ns {
            filter.take(k, entry);
        }
        if k + 1 < problem.linear.rows {
            filter.predict(k);
        }
    }
    filter.total()
}

/// Returns the linear regression of an episode on its `m` columns.
#[must_use]
pub fn regress(problem: Problem<'_>, noise: &NoiseModel, m: usize) -> Regression {
    if problem.walk.segment.is_some() {
        segment::regress(problem, noise, m)
    } else {
        regress_some(problem, noise, (m, None))
    }
}

fn regress_some(
    problem: Problem<'_>,
    noise: &NoiseModel,
    columns: (usize, Option<&[usize]>),
) -> Regression {
    match Blocks::of(problem, noise) {
        Some(blocks) => blocks.regress(problem, noise, columns),
        None => regress::regress(problem, noise, columns),
    }
}

/// As [`regress`], on some of the columns only, for an episode that is not a segment.
///
/// The products are those of the selected columns, in their order.
#[must_use]
pub fn regress_on(
    problem: Problem<'_>,
    noise: &NoiseModel,
    (m, columns): (usize, &[usize]),
) -> Regression {
    regress_some(problem, noise, (m, Some(columns)))
}

/// Smooths an episode.
#[must_use]
pub fn smooth(problem: Problem<'_>, noise: &NoiseModel) -> Smoothed {
    if problem.walk.segment.is_some() {
        return segment::smooth(problem, noise);
    }
    match Blocks::of(problem, noise) {
        Some(blocks) => blocks.smooth(problem, noise),
        None => smooth_one(problem, noise),
    }
}

/// Smooths an episode that is not a segment, as one block.
fn smooth_one(problem: Problem<'_>, noise: &NoiseModel) -> Smoothed {
    let mut filter = Filter::new(problem, noise);
    let rows = problem.linear.rows;
    let mut steps: Vec<Step> = Vec::with_capacity(rows);
    for k in 0..rows {
        let predicted = filter.covariance.clone();
        let taken = (0..filter.ns).filter_map(|i| filter.take(k, i)).collect();
        let breaks = k + 1 < rows && !filter.carries(k);
        steps.push(Step {
            predicted,
            mean: filter.mean.clone(),
            covariance: filter.covariance.clone(),
            taken,
            breaks,
        });
        if k + 1 < rows {
            filter.predict(k);
        }
    }
    backward(&mut filter, &steps)
}

#[cfg(test)]
mod tests;
