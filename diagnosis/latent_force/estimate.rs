//! Trajectory, missing force and noise of all episodes, estimated by expectation maximisation.
//!
//! For given covariances, the smoother gives the trajectory and the missing force. The covariances
//! follow from these (Shumway and Stoffer 1982): `q` and `tau` from the force and its products over
//! a row, `r` from the residuals of the readings. A few rounds run between linearisations. Their
//! steps are lengthened, because EM is slow where a variance is small.

mod before;
mod missing;
mod read_as;
mod replay;
mod rest;
mod variances;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::context::Context;
use super::smoother::{NoiseModel, Problem, Smoothed, Start, Sums, smooth, told};
use super::step_map::LinearEpisode;
use super::tangent::{part_way, retract};
use super::walk::Walk;

pub use missing::{LEAST_LEFT, Missing, NOTHING};

/// Factor on a step of EM in the logarithm of a variance: between 1 and 2 EM still raises the
/// likelihood (Lange 1995).
const LENGTHENED: f64 = 1.7;

/// Trajectory, force and noise.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// States, `rows x (nq + nv)`, one array per walk.
    pub trajectory: Vec<Vec<f64>>,
    /// Initial states of segments according to their readings, `nq + nv`, one per walk, in the
    /// model at its values.
    pub read: Vec<Vec<f64>>,
    /// Covariances.
    pub noise: NoiseModel,
    /// Derivatives with respect to generalized forces of the model without effects, one array per
    /// walk; empty if all walks are segments.
    pub b: Vec<Vec<f64>>,
    /// Variance of the free force, `rows x nv`, one array per walk; empty for none.
    ///
    /// This force may hold a joint at rest, or stand for the state of a drive before the log.
    pub free: Vec<Vec<f64>>,
    /// Directions in which the replays of each segment scatter, `rows x ns x directions`; empty for
    /// none.
    pub scatter: Vec<Vec<f64>>,
    /// Smallest variance of the white part of each force.
    pub least_white: Vec<f64>,
    /// Whether readings along the smoothed walks tell of the force at each degree of freedom, in
    /// this model and in those that it was fitted from.
    ///
    /// The variances of any other force stay where they are put: nothing estimates them.
    pub told: Vec<bool>,
    /// For each segment: variance of its residuals relative to that of the readings; 1 for other
    /// walks.
    pub excess: Vec<f64>,
    /// For each segment: squared residuals of its last replay relative to those that its
    /// derivatives predicted, at least 1.
    ///
    /// Derivatives that mispredict carry less information about effects.
    pub misled: Vec<f64>,
    /// Number of times that segments were replayed; seeds the draws of each time.
    pub rolls: u64,
    /// The last smoothing, about the trajectory before it.
    pub smoothed: Vec<Smoothed>,
    /// Its log-likelihood.
    pub log_likelihood: f64,
}

/// Number of rows of a walk whose states a fit moves: a segment is replayed from its initial state.
fn moved(walk: &Walk) -> usize {
    if walk.segment.is_some() {
        1
    } else {
        walk.len()
    }
}

impl Estimate {
    /// Returns the problem of each walk; `starts` as [`Context::starts`] returns them.
    pub fn problems<'p>(
        &'p self,
        context: &'p Context<'_>,
        linear: &'p [LinearEpisode],
        starts: &'p [Start],
    ) -> impl IndexedParallelIterator<Item = Problem<'p>> {
        context
            .walks
            .par_iter()
            .zip(linear)
            .zip(&self.b)
            .zip(starts)
            .zip(&self.free)
            .zip(&self.scatter)
            .map(|(((((walk, linear), b), start), free), scatter)| Problem {
                walk,
                linear,
                b,
                start,
                free,
                scatter,
            })
    }

    /// Returns the noise of a walk, with the variances of the missing force or of a segment's
    /// residuals scaled.
    #[must_use]
    pub fn noise_along(&self, context: &Context<'_>, walk: usize, scale: f64) -> NoiseModel {
        if context.walks[walk].segment.is_none() {
            return self.noise.scaled(scale, &self.least_white);
        }
        let excess = (scale * self.excess[walk]).max(1.0);
        let none = vec![0.0; self.noise.q.len()];
        NoiseModel {
            q: none.clone(),
            white: none,
            r: self.noise.r.iter().map(|r| r * excess).collect(),
            tau: self.noise.tau.clone(),
        }
    }

    /// Scales the variances of the missing force and of the segments' residuals.
    pub fn rescale(&mut self, scale: f64) {
        self.noise = self.noise.scaled(scale, &self.least_white);
        self.excess
            .iter_mut()
            .for_each(|x| *x = (scale * *x).max(1.0));
    }

    /// Returns roots of the posterior covariance of each segment's initial state, `nx` rows; empty
    /// for other walks.
    ///
    /// The noise is that of the readings alone, so the covariance is that of a correct model.
    #[must_use]
    pub fn start_roots(
        &self,
        context: &Context<'_>,
        linear: &[LinearEpisode],
    ) -> Vec<DMatrix<f64>> {
        let starts = context.starts(&self.trajectory, &self.read);
        let right = Self {
            excess: vec![1.0; self.excess.len()],
            scatter: vec![Vec::new(); self.scatter.len()],
            ..self.clone()
        };
        let problems = right.problems(context, linear, &starts).enumerate();
        problems
            .map(|(w, p)| match context.walks[w].segment {
                Some(_) => smooth(p, &right.noise_along(context, w, 1.0)).root,
                None => DMatrix::zeros(0, 0),
            })
            .collect()
    }

    /// Smooths about the present trajectory, fits the noise over some rounds, and moves the
    /// trajectory.
    pub fn improve(&mut self, context: &Context<'_>, linear: &[LinearEpisode], rounds: usize) {
        let starts = context.starts(&self.trajectory, &self.read);
        let mut length = LENGTHENED;
        let mut before = (f64::NEG_INFINITY, self.noise.clone(), self.excess.clone());
        for round in 0..rounds.max(1) {
            let smoothed: Vec<Smoothed> = self
                .problems(context, linear, &starts)
                .enumerate()
                .map(|(w, p)| smooth(p, &self.noise_along(context, w, 1.0)))
                .collect();
            let mut sums = Sums::default();
            let along = context.walks.iter().zip(&smoothed);
            along
                .filter(|(w, _)| w.segment.is_none())
                .for_each(|(_, s)| sums.add(&s.sums));
            let likelihood: f64 = smoothed.iter().map(|s| s.log_likelihood).sum();
            if likelihood.is_nan() || likelihood < before.0 {
                // A lengthened step went too far.
                (self.noise, self.excess) = (before.1.clone(), before.2.clone());
                length = 1.0;
                continue;
            }
            self.log_likelihood = likelihood;
            self.smoothed = smoothed;
            before = (likelihood, self.noise.clone(), self.excess.clone());
            if round + 1 < rounds {
                self.update_noise(context, &sums, length);
                self.update_excess(context);
            }
        }
        let layout = &context.plant().layout;
        let (nx, width) = (2 * layout.nv, layout.nq + layout.nv);
        let each: Vec<Vec<bool>> = self
            .problems(context, linear, &starts)
            .filter(|problem| problem.walk.segment.is_none())
            .map(|problem| told(problem, &self.noise))
            .collect();
        if !each.is_empty() {
            for (dof, own) in self.told.iter_mut().enumerate() {
                *own &= each.iter().any(|told| told[dof]);
            }
        }
        let pairs = self.trajectory.iter_mut().zip(&self.smoothed);
        for ((states, smoothed), walk) in pairs.zip(&context.walks) {
            let changes = smoothed.change.chunks_exact(nx).take(moved(walk));
            for (state, change) in states.chunks_exact_mut(width).zip(changes) {
                if change.iter().all(|x| x.is_finite()) {
                    retract(layout, state, change);
                }
            }
        }
    }

    /// Returns a point part of the way from here to the result of one or several
    /// [improvements](Estimate::improve), `there`.
    #[must_use]
    pub fn towards(&self, context: &Context<'_>, there: &Self, part: f64) -> Self {
        let layout = &context.plant().layout;
        let width = layout.nq + layout.nv;
        let mut out = there.clone();
        let pairs = self.trajectory.iter().zip(&mut out.trajectory);
        for ((from, to), walk) in pairs.zip(&context.walks) {
            let each = from.chunks_exact(width).zip(to.chunks_exact_mut(width));
            each.take(moved(walk))
                .for_each(|(from, to)| part_way(layout, from, to, part));
        }
        let pairs = self.read.iter().zip(&mut out.read);
        pairs.for_each(|(from, to)| part_way(layout, from, to, part));
        let between = |a: &[f64], b: &[f64]| -> Vec<f64> {
            let pairs = a.iter().zip(b);
            pairs
                .map(|(a, b)| (a.ln() + part * (b / a).ln()).exp())
                .collect()
        };
        out.noise = NoiseModel {
            q: between(&self.noise.q, &there.noise.q),
            tau: between(&self.noise.tau, &there.noise.tau),
            white: between(&self.noise.white, &there.noise.white),
            r: between(&self.noise.r, &there.noise.r),
        };
        out
    }
}
