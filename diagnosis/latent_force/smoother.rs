//! Kalman filter and smoother with the missing force as a hidden state.
//!
//! About a trajectory `x_k` the true state is `x_k` moved by `d_k` (tangent coordinates), and
//!
//! ```text
//! d_{k+1} = A_k d_k + B_k (w_k + e_k) + f(x_k) - x_{k+1}
//! w_{k+1} = rho_k w_k + noise,   variance q (1 - rho_k^2),   rho_k = exp(-dt_k / tau)
//! e_k     = noise,               variance white + free_k
//! y_k     = h(x_k) + H_k d_k + noise,   variance r
//! ```
//!
//! `w_k` is the generalized force that the model lacks, a first-order process at each degree of freedom (a latent force
//! model, Alvarez, Luengo and Lawrence 2009, in state-space form, Hartikainen and Sarkka 2010). `e_k` is independent from row to
//! row: `white` covers what changes at once, as friction does where a joint turns round, and `free_k`, known and of some rows only,
//! the force that may hold a joint at rest, or that a drive makes of what was before the log.
//!
//! Readings are taken one by one, so that no matrix is inverted. The forward pass is in `filter.rs`; smoothing is by the adjoint
//! recursion of Bryson and Frazier (Bierman 1977), which inverts none either, in `adjoint.rs`.
//! Columns (what a unit of an effect adds to `f` and `h`) go through the same filter: in whitened innovations all
//! effects are one linear regression.

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
    /// Stationary variance of the missing force, one a degree of freedom.
    pub q: Vec<f64>,
    /// Its correlation time, s, one a degree of freedom.
    pub tau: Vec<f64>,
    /// Variance of the part of the missing force that is another one in each row, one a degree of freedom.
    pub white: Vec<f64>,
    /// Variance of each entry of a reading.
    pub r: Vec<f64>,
}

impl NoiseModel {
    /// The same with all variances of the missing force scaled, those of the white part not below `least`.
    #[must_use]
    pub fn scaled(&self, factor: f64, least: &[f64]) -> Self {
        let white = self.white.iter().zip(least);
        Self {
            q: self.q.iter().map(|q| q * factor).collect(),
            white: white.map(|(q, least)| (q * factor).max(*least)).collect(),
            ..self.clone()
        }
    }

    /// The same with the variances of one missing force scaled, that of its white part not below `least`.
    #[must_use]
    pub fn scaled_at(&self, dof: usize, factor: f64, least: &[f64]) -> Self {
        let mut scaled = self.clone();
        scaled.q[dof] *= factor;
        scaled.white[dof] = (scaled.white[dof] * factor).max(least[dof]);
        scaled
    }
}

/// Where an episode begins: mean of the change from the trajectory's first state, and its variances.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// Mean, `nx`.
    pub mean: Vec<f64>,
    /// Variances, `nx`.
    pub variance: Vec<f64>,
}

/// One episode as the filter sees it.
#[derive(Clone, Copy)]
pub struct Problem<'a> {
    /// Its rows.
    pub walk: &'a Walk,
    /// Its linearisation.
    pub linear: &'a LinearEpisode,
    /// Slopes in generalized forces, `(rows - 1) x nx x nv`.
    pub b: &'a [f64],
    /// Where it begins.
    pub start: &'a Start,
    /// Variance of the force that is free in a row, `rows x nv`; empty where there is none.
    pub free: &'a [f64],
    /// Of a segment: directions in which its replays scatter, `rows x ns x directions`; empty for none.
    pub scatter: &'a [f64],
}

/// Sums that the noise model is estimated from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sums {
    /// Rows with a row before them, and their times, s.
    pub steps: f64,
    /// Sum of the steps' durations, s.
    pub seconds: f64,
    /// Of each force: squares at the later row, at the earlier, and products.
    pub force: Vec<[f64; 3]>,
    /// Of each force: squares of its white part.
    pub white: Vec<f64>,
    /// Of each entry of a reading: squares of what is left, and how many.
    pub reading: Vec<[f64; 2]>,
}

impl Sums {
    /// Adds those of another episode.
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
    /// Logarithm of the likelihood of its readings, natural, up to `ln 2 pi` a reading.
    pub log_likelihood: f64,
    /// Change of the trajectory, `rows x nx`.
    pub change: Vec<f64>,
    /// Of a segment: shorter changes of its start, each `nx`, where the whole goes too far.
    pub damped: Vec<Vec<f64>>,
    /// Of a segment: sum of squares that a replay from the changed start should leave of each entry, where slopes tell.
    pub promised: Vec<f64>,
    /// Of a segment: a root of the posterior covariance of its start, `nx` rows; empty for other walks.
    pub root: DMatrix<f64>,
    /// Its variances, `rows x nx`.
    pub change_variance: Vec<f64>,
    /// Missing force, `rows x nv`.
    pub force: Vec<f64>,
    /// Its variances, `rows x nv`.
    pub force_variance: Vec<f64>,
    /// Sums for the noise model.
    pub sums: Sums,
}

impl Smoothed {
    /// An episode of some rows along which nothing is changed or missing, with nothing summed.
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

/// The linear regression that a filter pass with columns makes: `X'X`, `X'y` and the likelihood without them.
#[derive(Clone, Debug)]
pub struct Regression {
    /// Logarithm of the likelihood at the trajectory and the present parameters.
    pub log_likelihood: f64,
    /// `X'X`, `m x m`.
    pub gram: DMatrix<f64>,
    /// `X'y`, `m`.
    pub moment: DVector<f64>,
}

impl Regression {
    /// Adds that of another episode.
    pub fn add(&mut self, other: &Self) {
        self.log_likelihood += other.log_likelihood;
        self.gram += &other.gram;
        self.moment += &other.moment;
    }
}

/// Logarithm of the likelihood of an episode that is no segment.
#[must_use]
pub fn log_likelihood(problem: Problem<'_>, noise: &NoiseModel) -> f64 {
    match Blocks::of(problem, noise) {
        Some(blocks) => blocks.log_likelihood(problem, noise),
        None => log_likelihood_of_one(problem, noise),
    }
}

/// The same of an episode that is taken as one block.
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

/// The linear regression of an episode with its columns.
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

/// The same with some of its columns, of an episode that is no segment; its products are among those alone, in their order.
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

/// Smooths an episode that is no segment as one block.
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
