//! A smooth local model (emulator) of a rough simulator, and the posterior under it.
//!
//! With contact, the trajectory is not a smooth function of the unknowns: a contact one step
//! earlier shifts it by a few millimetres. Two nearby points then differ by many times the sensors'
//! noise. The likelihood of a single simulation depends more on this random scatter than on the
//! unknowns, and the real machine scatters too.
//!
//! So the residuals `e(x)` of points spread over a region are regressed on quadratic features,
//! `e(x) = A phi(x) + epsilon`. The regression averages the scatter out, and its residuals measure
//! it. An observation differs from `A phi` by the sensors' noise (whitened: `1`) and one more draw
//! of `epsilon`, which has variance `s_k^2` at reading `k` and is correlated along the episode.
//!
//! With weights `W = 1 / (1 + s^2)` the loss is `phi^T A^T W A phi / 2`. The width of its minimum
//! ignores the correlation. The sandwich formula (White 1982) includes it:
//!
//! `H^-1 B^T W (1 + R) W B H^-1`, `H = B^T W B`, `B = de/dx`, `R = cov(epsilon)`
//!
//! The loss is divided by the largest ratio `v` of the sandwich to the naive covariance along any
//! direction (a temperature). Along other directions the sandwich is narrower than that. With
//! `H = L L^T`, `w = L^-1 B^T W e` is the part of the weighed residual that the unknowns move at the
//! best point. Its covariance `L^-1 B^T W (1 + R) W B L^-T` is the sandwich in the coordinates
//! `L^T x`. Along each principal axis of it, the square of `w` is divided by the ratio of that axis
//! instead of `v` ([`tempered`]): an unknown that smooth readings determine keeps its narrow
//! interval beside one that rough readings determine. What is left of the residual is divided by
//! `v`. The loss stays a function of the residual alone. Where the readings show only a product of
//! two unknowns, it is therefore constant along the curved valley.
//!
//! Where the emulator does not explain the observation within noise and roughness, all is divided
//! by the mismatch. Points are never selected by how well they fit, which would bias the result.

use crate::fisher::precision::{implied, tempered, weighed_squares};
use crate::fisher::roughness::Roughness;
use asid_core::rng::Rng;
use nalgebra::{DMatrix, DVector};

use super::evidence::Evidence;
use super::walk::Walk;
use crate::optimise::Gaussian;

/// Ridge on the regression, relative to the number of points.
const RIDGE: f64 = 1e-6;

/// The posterior is sought within this many standard deviations of the region's middle, where there
/// are points to fit.
pub const REACH: f64 = 3.0;

/// Steps towards the best point; the quadratic model of a few entries takes about ten.
const MINIMUM_STEPS: usize = 60;

/// Alternating projections onto the box and the reach, before what is left outside moves to the
/// middle. Each at least halves the distance unless the two sets meet at a small angle.
const PROJECTIONS: usize = 30;

/// An entry this close to a side of the box, in widths of the box, is at the side; above rounding.
const AT_SIDE: f64 = 1e-9;

/// A quadratic model of the residuals over a region.
pub struct Emulator {
    region: Gaussian,
    /// `A^T W A`, features x features.
    gram: DMatrix<f64>,
    /// The matrix of the widened loss, `phi^T G phi / 2`: as wide as the sandwich, and divided by the
    /// mismatch.
    widened: DMatrix<f64>,
    /// Best point within reach and in the box, standardised.
    best: DVector<f64>,
    /// The emulated whitened residual at the best point.
    left: DVector<f64>,
    /// Covariance of that residual by the scatter of the simulations, as a share of that of the
    /// roughness.
    scatter: f64,
    luck: Roughness,
    /// Root mean square of the emulated whitened residual at its best point.
    pub residual: f64,
    /// Root mean square of the roughness, in units of the sensors' noise.
    pub roughness: f64,
    /// Root mean square of the emulated residual at its best point, in units of noise and roughness
    /// together. Near 1 where the simulator explains the log, however rough it is.
    pub misfit: f64,
}

/// Number of features of `n` entries.
#[must_use]
pub fn features_len(n: usize) -> usize {
    1 + n + n * (n + 1) / 2
}

/// Quadratic features `1, u, u u^T` (upper triangle).
fn features(u: &[f64]) -> Vec<f64> {
    let mut phi = Vec::with_capacity(features_len(u.len()));
    phi.push(1.0);
    phi.extend_from_slice(u);
    for i in 0..u.len() {
        for j in i..u.len() {
            phi.push(u[i] * u[j]);
        }
    }
    phi
}

/// `d phi / d u_k`.
fn feature_slope(u: &[f64], k: usize) -> Vec<f64> {
    let mut slope = vec![0.0; features_len(u.len())];
    slope[1 + k] = 1.0;
    let mut at = 1 + u.len();
    for i in 0..u.len() {
        for j in i..u.len() {
            slope[at] = f64::from(u8::from(i == k)) * u[j] + f64::from(u8::from(j == k)) * u[i];
            at += 1;
        }
    }
    slope
}

/// `phi^T G phi / 2` at a standardised point.
fn half_square(g: &DMatrix<f64>, u: &[f64]) -> f64 {
    let phi = DVector::from_vec(features(u));
    0.5 * phi.dot(&(g * &phi))
}

impl Emulator {
    /// Fits the residuals of points in a region; `None` where there are too few points.
    ///
    /// `readings` is the number of residual entries that are present. Readings are weighted by the
    /// variance of their roughness or, if `correlated`, by its whole covariance along the episode.
    #[must_use]
    pub fn fit(
        region: &Gaussian,
        points: &[&[f64]],
        residuals: &[&[f64]],
        readings: usize,
        correlated: bool,
    ) -> Option<Self> {
        let n = region.mean().len();
        let f = features_len(n);
        let count = points.len();
        // At least one more than there are features, so that the roughness has a degree of freedom.
        if count < f + n.max(1) {
            return None;
        }
        let m = residuals[0].len();
        let whitened: Vec<Vec<f64>> = points.iter().map(|x| region.standardise(x)).collect();
        let phi = DMatrix::from_fn(count, f, {
            let rows: Vec<Vec<f64>> = whitened.iter().map(|u| features(u)).collect();
            move |i, j| rows[i][j]
        });
        let e = DMatrix::from_fn(count, m, |i, k| residuals[i][k]);
        let normal = phi.transpose() * &phi + DMatrix::identity(f, f) * (RIDGE * count as f64);
        let normal = normal.cholesky()?;
        let a = normal.solve(&(phi.transpose() * &e));
        let luck = Roughness::new(&e - &phi * &a, (count - f) as f64);
        let precision = luck.precision(correlated);
        let gram = weighed_squares(&precision, &a);
        let mut emulator = Self {
            region: region.clone(),
            widened: gram.clone(),
            gram,
            best: DVector::zeros(n),
            left: DVector::zeros(m),
            scatter: 0.0,
            residual: 0.0,
            roughness: luck.size(readings),
            misfit: 0.0,
            luck,
        };
        let best = emulator.minimum();
        let best_features = DVector::from_vec(features(&best));
        // Residual at the best point in units of the noise; the mismatch also counts the roughness.
        emulator.left = a.tr_mul(&best_features);
        emulator.scatter = best_features.dot(&normal.solve(&best_features));
        let raw = emulator.left.norm_squared() / readings.max(1) as f64;
        emulator.residual = raw.sqrt();
        let mismatch = 2.0 * emulator.loss_at(&best) / (readings as f64 - n as f64).max(1.0);
        emulator.misfit = mismatch.max(0.0).sqrt();
        // Slopes of the residuals at the best point, for the ratio of the two covariances.
        let b = DMatrix::from_fn(m, n, {
            let slopes: Vec<DVector<f64>> = (0..n)
                .map(|k| a.transpose() * DVector::from_vec(feature_slope(&best, k)))
                .collect();
            move |i, k| slopes[k][i]
        });
        let lower = implied(&precision, &b)?;
        let inflated = emulator.luck.inflation(&b, correlated)?;
        let (most, further) = tempered(&inflated)?;
        let moved = precision.weigh(&b.transpose()) * a.transpose();
        let moved = lower.solve_lower_triangular(&moved)?;
        let widened = &emulator.gram / most + moved.tr_mul(&(further * &moved));
        emulator.widened = widened / mismatch.max(1.0);
        emulator.best = DVector::from_vec(best);
        Some(emulator)
    }

    fn loss_at(&self, u: &[f64]) -> f64 {
        half_square(&self.gram, u)
    }

    /// Loss at a point of the search space, as wide as the sandwich and divided by the mismatch.
    #[must_use]
    pub fn loss(&self, x: &[f64]) -> f64 {
        half_square(&self.widened, &self.region.standardise(x))
    }

    /// The best point within reach and in the box, in standardised coordinates.
    ///
    /// Damped Gauss-Newton steps (Levenberg-Marquardt) in the coordinates of the search space, in
    /// which the box has one entry a side: an entry at a side from which the loss falls outwards
    /// keeps its place.
    fn minimum(&self) -> Vec<f64> {
        let n = self.region.mean().len();
        if n == 0 {
            return Vec::new();
        }
        let (low, high) = self.region.bounds();
        // Columns `du / dx_j`.
        let columns: Vec<DVector<f64>> = (0..n)
            .map(|j| {
                let mut beside = self.region.mean().to_vec();
                beside[j] += 1.0;
                DVector::from_vec(self.region.standardise(&beside))
            })
            .collect();
        let to_u = DMatrix::from_columns(&columns);
        let mut u = vec![0.0; n];
        let mut loss = self.loss_at(&u);
        let mut damping = 1e-3;
        for _ in 0..MINIMUM_STEPS {
            let x = self.region.unstandardise(&u);
            let phi = DVector::from_vec(features(&u));
            let slopes: Vec<DVector<f64>> = (0..n)
                .map(|k| DVector::from_vec(feature_slope(&u, k)))
                .collect();
            let g_phi = &self.gram * &phi;
            let gradient = to_u.tr_mul(&DVector::from_fn(n, |k, _| slopes[k].dot(&g_phi)));
            let free: Vec<usize> = (0..n)
                .filter(|&i| {
                    let margin = AT_SIDE * (high[i] - low[i]);
                    let held = (x[i] <= low[i] + margin && gradient[i] > 0.0)
                        || (x[i] >= high[i] - margin && gradient[i] < 0.0);
                    !held
                })
                .collect();
            let curvature =
                DMatrix::from_fn(n, n, |i, j| slopes[i].dot(&(&self.gram * &slopes[j])));
            let curvature = to_u.tr_mul(&curvature) * &to_u;
            let mut of_free = curvature.select_rows(&free).select_columns(&free);
            for i in 0..free.len() {
                of_free[(i, i)] = of_free[(i, i)] * (1.0 + damping) + f64::MIN_POSITIVE;
            }
            let Some(factor) = of_free.cholesky() else {
                break;
            };
            let step = factor.solve(&gradient.select_rows(&free));
            let mut next = x;
            for (k, &i) in free.iter().enumerate() {
                next[i] -= step[k];
            }
            let next = self.nearest(&self.region.standardise(&next));
            let next_loss = self.loss_at(&next);
            if next_loss < loss {
                (u, loss) = (next, next_loss);
                damping *= 0.3;
            } else {
                damping *= 5.0;
            }
        }
        u
    }

    /// Whether a standardised point is within reach and in the box.
    fn inside(&self, u: &[f64]) -> bool {
        let (low, high) = self.region.bounds();
        let x = self.region.unstandardise(u);
        let mut entries = x.iter().zip(low.iter().zip(high));
        u.iter().all(|v| v.abs() <= REACH) && entries.all(|(x, (l, h))| x >= l && x <= h)
    }

    /// A point within reach and in the box that is close to a standardised one, by alternating
    /// projections: to clamp an entry of the search space moves correlated standardised ones, and
    /// the reverse. The region's middle is inside of both.
    fn nearest(&self, u: &[f64]) -> Vec<f64> {
        let (low, high) = self.region.bounds();
        let mut u = u.to_vec();
        for _ in 0..PROJECTIONS {
            if self.inside(&u) {
                return u;
            }
            for v in &mut u {
                *v = v.clamp(-REACH, REACH);
            }
            let x = self.region.unstandardise(&u);
            let x: Vec<f64> = x
                .iter()
                .zip(low.iter().zip(high))
                .map(|(x, (l, h))| x.clamp(*l, *h))
                .collect();
            u = self.region.standardise(&x);
        }
        // By as little as rounding needs, and by more where the sets meet at a small angle.
        let mut share = f64::EPSILON;
        while !self.inside(&u) && share < 1.0 {
            u.iter_mut().for_each(|v| *v *= 1.0 - share);
            share *= 2.0;
        }
        u
    }

    /// What is left of the readings at the best point, for a comparison with other models.
    ///
    /// `present` readings are there, and `narrowing` is the sum of the logarithms of posterior over
    /// prior standard deviations.
    #[must_use]
    pub fn evidence(&self, present: usize, narrowing: f64) -> Evidence {
        Evidence {
            residual: self.left.as_slice().to_vec(),
            present,
            roughness: self.luck.clone(),
            scatter: self.scatter,
            narrowing,
        }
    }

    /// The best point of the search space.
    #[must_use]
    pub fn best(&self) -> Vec<f64> {
        self.region.unstandardise(self.best.as_slice())
    }

    /// Draws `count` equally weighted points of the posterior by an ensemble of walkers.
    ///
    /// The walkers stay in the region's box and within reach of its middle.
    pub fn sample(&self, count: usize, rng: &mut Rng) -> Vec<Vec<f64>> {
        let n = self.region.mean().len();
        let u = self.best.as_slice();
        // The walkers begin with the curvature at the best point.
        let slopes: Vec<DVector<f64>> = (0..n)
            .map(|k| DVector::from_vec(feature_slope(u, k)))
            .collect();
        let h = DMatrix::from_fn(n, n, |i, j| slopes[i].dot(&(&self.widened * &slopes[j])));
        let curvature = h + DMatrix::identity(n, n) * REACH.powi(-2);
        let shape = curvature
            .cholesky()
            .map(|c| c.inverse())
            .and_then(|c| c.cholesky())
            .map_or_else(|| DMatrix::identity(n, n), |factor| factor.l());
        let walk = Walk {
            shape,
            inside: &|u: &[f64]| self.inside(u),
            loss: &|u: &[f64]| half_square(&self.widened, u),
        };
        let drawn = walk.draws(u, count, rng);
        drawn.iter().map(|u| self.region.unstandardise(u)).collect()
    }
}

#[cfg(test)]
mod tests;
