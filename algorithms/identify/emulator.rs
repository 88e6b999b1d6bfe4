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
//! The loss is divided by the largest ratio of the sandwich to the naive covariance along any
//! direction (a temperature). Along other directions the sandwich knows more than that. With
//! `H = L L^T`, `w = L^-1 B^T W e` are the parts of the weighed residual that the unknowns move, and
//! the sandwich is their covariance. So each is divided by its own ratio ([`tempered`]): an unknown
//! that smooth readings determine keeps its narrow interval beside one that rough readings
//! determine. This is a function of the residual alone. Where the readings show only a product of
//! two unknowns, it is therefore constant along the curved valley, as the loss is.
//!
//! Where the emulator does not explain the observation within noise and roughness, all is divided
//! by the mismatch. Points are never selected by how well they fit, which would bias the result.

use crate::fisher::precision::{Precision, implied, inflation, tempered};
use asid_core::rng::Rng;
use nalgebra::{DMatrix, DVector};

use super::walk::Walk;
use crate::optimise::Gaussian;

/// Ridge on the regression, relative to the number of points.
const RIDGE: f64 = 1e-6;

/// The posterior is sought within this many standard deviations of the region's middle, where there
/// are points to fit.
pub const REACH: f64 = 3.0;

/// A quadratic model of the residuals over a region.
pub struct Emulator {
    region: Gaussian,
    /// `A^T W A`, features x features.
    gram: DMatrix<f64>,
    /// Best point within reach, standardised.
    best: DVector<f64>,
    /// The same, as wide as the sandwich.
    widened: DMatrix<f64>,
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

/// Quadratic features `1, u, u u^T` (upper triangle). Derivative of the features, `d phi / d u_k`.
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
        if count < f + n {
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
        let a = normal.cholesky()?.solve(&(phi.transpose() * &e));
        let epsilon = &e - &phi * &a;
        let freedom = (count - f) as f64;
        let spread: DVector<f64> =
            DVector::from_fn(m, |k, _| epsilon.column(k).norm_squared() / freedom);
        let precision = if correlated {
            Precision::correlated(&epsilon, freedom)
        } else {
            Precision::diagonal(&spread)
        };
        let gram = precision.weigh(&a) * a.transpose();
        let mut emulator = Self {
            region: region.clone(),
            widened: gram.clone(),
            gram,
            best: DVector::zeros(n),
            residual: 0.0,
            roughness: (spread.sum() / readings.max(1) as f64).sqrt(),
            misfit: 0.0,
        };
        let best = emulator.minimum(n);
        let best_features = DVector::from_vec(features(&best));
        // Residual at the best point in units of the noise; the mismatch also counts the roughness.
        let at_best = a.transpose() * &best_features;
        let raw = at_best.norm_squared() / readings.max(1) as f64;
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
        let inflated = if correlated {
            // A sample covariance cannot be tested on the points that it was computed from: each
            // half is evaluated with the covariance of the other.
            let share = freedom / count as f64;
            let half = |k: usize| {
                let rows: Vec<usize> = (k..count).step_by(2).collect();
                epsilon.select_rows(&rows)
            };
            let halves = [half(0), half(1)];
            let of = |weighing: &DMatrix<f64>, asked: &DMatrix<f64>| {
                let by = Precision::correlated(weighing, share * weighing.nrows() as f64);
                let freedom = share * asked.nrows() as f64;
                inflation(&by, &b, asked, freedom, &implied(&by, &b)?)
            };
            (of(&halves[0], &halves[1])? + of(&halves[1], &halves[0])?) * 0.5
        } else {
            inflation(&precision, &b, &epsilon, freedom, &lower)?
        };
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

    /// Loss at a point of the search space, as wide as the sandwich.
    #[must_use]
    pub fn loss(&self, x: &[f64]) -> f64 {
        half_square(&self.widened, &self.region.standardise(x))
    }

    /// The best point within reach, in standardised coordinates, by damped Newton steps.
    fn minimum(&self, n: usize) -> Vec<f64> {
        let mut u = vec![0.0; n];
        let mut loss = self.loss_at(&u);
        let mut damping = 1e-3
            * (0..n)
                .map(|i| self.gram[(1 + i, 1 + i)])
                .fold(1.0, f64::max);
        for _ in 0..60 {
            let phi = DVector::from_vec(features(&u));
            let slopes: Vec<DVector<f64>> = (0..n)
                .map(|k| DVector::from_vec(feature_slope(&u, k)))
                .collect();
            let g_phi = &self.gram * &phi;
            let gradient = DVector::from_fn(n, |k, _| slopes[k].dot(&g_phi));
            let hessian = DMatrix::from_fn(n, n, |i, j| slopes[i].dot(&(&self.gram * &slopes[j])));
            let Some(factor) = (hessian + DMatrix::identity(n, n) * damping).cholesky() else {
                break;
            };
            let step = factor.solve(&gradient);
            let next: Vec<f64> = (0..n)
                .map(|i| (u[i] - step[i]).clamp(-REACH, REACH))
                .collect();
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

    /// The best point of the search space.
    #[must_use]
    pub fn best(&self) -> Vec<f64> {
        self.region.unstandardise(self.best.as_slice())
    }

    /// Draws `count` equally weighted points of the posterior by a Metropolis walk.
    ///
    /// The walk stays inside the box and within reach of the region's middle.
    pub fn sample(&self, low: &[f64], high: &[f64], count: usize, rng: &mut Rng) -> Vec<Vec<f64>> {
        let n = self.region.mean().len();
        let inside = |u: &[f64]| {
            let x = self.region.unstandardise(u);
            u.iter().all(|v| v.abs() <= REACH)
                && x.iter()
                    .zip(low)
                    .zip(high)
                    .all(|((x, l), h)| x >= l && x <= h)
        };
        let mut u = self.best.as_slice().to_vec();
        if !inside(&u) {
            let x: Vec<f64> = self
                .region
                .unstandardise(&u)
                .iter()
                .zip(low)
                .zip(high)
                .map(|((x, l), h)| x.clamp(*l, *h))
                .collect();
            u = self.region.standardise(&x);
        }
        // Proposal steps follow the curvature at the best point, scaled for a good acceptance rate.
        let slopes: Vec<DVector<f64>> = (0..n)
            .map(|k| DVector::from_vec(feature_slope(&u, k)))
            .collect();
        let h = DMatrix::from_fn(n, n, |i, j| slopes[i].dot(&(&self.widened * &slopes[j])));
        let curvature = h + DMatrix::identity(n, n) * REACH.powi(-2);
        let Some(factor) = curvature
            .cholesky()
            .map(|c| c.inverse())
            .and_then(|c| c.cholesky())
        else {
            return vec![self.region.unstandardise(&u); count];
        };
        let walk = Walk {
            shape: factor.l(),
            inside: &inside,
            loss: &|u: &[f64]| half_square(&self.widened, u),
        };
        let drawn = walk.draws(&u, count, rng);
        drawn.iter().map(|u| self.region.unstandardise(u)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Streams;
    use rand_distr::{Distribution, StandardNormal};

    /// Fits one draw of noise from a linear simulator with 200 readings; returns the estimate and
    /// its standard deviation.
    ///
    /// Roughness has size `rough` and lasts `run` readings.
    fn fitted(seed: u64, rough: f64, run: usize, correlated: bool) -> (f64, f64) {
        let mut rng = Streams::new(seed).stream("e");
        let m = 200;
        let slope = 0.5;
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut luck = |rough: f64| -> Vec<f64> {
            let blocks: Vec<f64> = (0..m / run).map(|_| rough * normal()).collect();
            (0..m).map(|k| blocks[k / run]).collect()
        };
        let real = luck(rough);
        let noise = luck(0.0);
        let region = Gaussian::diagonal(&[0.2], &[1.0], &[-9.0], &[9.0]);
        let mut draws = Streams::new(seed).stream("d");
        let points: Vec<Vec<f64>> = (0..64).map(|_| region.sample(&mut draws)).collect();
        let mut sensor = Streams::new(seed).stream("n");
        let observed: Vec<f64> = (0..m)
            .map(|k| {
                let n: f64 = StandardNormal.sample(&mut sensor);
                real[k] + noise[k] + n
            })
            .collect();
        let residuals: Vec<Vec<f64>> = points
            .iter()
            .map(|x| {
                let l = luck(rough);
                (0..m).map(|k| slope * x[0] + l[k] - observed[k]).collect()
            })
            .collect();
        let p: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
        let r: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
        let emulator = Emulator::fit(&region, &p, &r, m, correlated).unwrap();
        let mut walk = Streams::new(seed).stream("w");
        let samples = emulator.sample(&[-9.0], &[9.0], 1000, &mut walk);
        let mean = samples.iter().map(|s| s[0]).sum::<f64>() / 1000.0;
        let var = samples.iter().map(|s| (s[0] - mean).powi(2)).sum::<f64>() / 1000.0;
        (mean, var.sqrt())
    }

    #[test]
    fn without_roughness_it_is_linear_regression() {
        // Truth 0, 200 readings of slope 0.5 and noise 1: standard deviation 1 / (0.5 sqrt 200) =
        // 0.141.
        for correlated in [false, true] {
            let (mean, std) = fitted(1, 0.0, 1, correlated);
            assert!(mean.abs() < 4.0 * 0.141, "{mean}");
            assert!((std / 0.141 - 1.0).abs() < 0.15, "{std}");
        }
    }

    #[test]
    fn intervals_hold_under_correlated_roughness() {
        // Roughness of 3 noise standard deviations that lasts 20 readings: ten independent pieces,
        // so the estimate has a standard deviation of 3 / (0.5 sqrt 10) = 1.9. Independent readings
        // would give 0.45.
        for correlated in [false, true] {
            let runs: Vec<(f64, f64)> = (0..60).map(|s| fitted(s, 3.0, 20, correlated)).collect();
            let covered = runs.iter().filter(|(m, s)| m.abs() < 1.96 * s).count();
            eprintln!(
                "{correlated} {covered} {}",
                runs.iter().map(|r| r.1).sum::<f64>() / 60.0
            );
            // A binomial of 60 at 0.95 is at least 51 with probability 0.998. The box of three
            // standard deviations of the region cuts the widest posteriors.
            assert!(covered >= 50, "{covered} of 60");
        }
    }

    #[test]
    fn what_takes_no_part_in_the_luck_keeps_its_weight_if_the_correlation_is_known() {
        // Roughness moves even readings up and odd ones down together; the unknown moves all up.
        // The two are orthogonal, so 200 readings of slope 0.5 determine the unknown to 0.141.
        // Without the correlation each reading has a standard deviation of sqrt(1 + 9), which gives
        // 0.447.
        let (m, slope, rough) = (200, 0.5, 3.0);
        let region = Gaussian::diagonal(&[0.2], &[1.0], &[-9.0], &[9.0]);
        let mut rng = Streams::new(3).stream("e");
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let side = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let real = rough * normal();
        let observed: Vec<f64> = (0..m).map(|k| real * side(k) + normal()).collect();
        let mut draws = Streams::new(3).stream("d");
        let points: Vec<Vec<f64>> = (0..64).map(|_| region.sample(&mut draws)).collect();
        let residuals: Vec<Vec<f64>> = points
            .iter()
            .map(|x| {
                let luck = rough * normal();
                let reading = |k: usize| slope * x[0] + luck * side(k) - observed[k];
                (0..m).map(reading).collect()
            })
            .collect();
        let p: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
        let r: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
        let [alone, together] = [false, true].map(|correlated| {
            let emulator = Emulator::fit(&region, &p, &r, m, correlated).unwrap();
            let mut walk = Streams::new(3).stream("w");
            let samples = emulator.sample(&[-9.0], &[9.0], 2000, &mut walk);
            let mean = samples.iter().map(|s| s[0]).sum::<f64>() / 2000.0;
            assert!(mean.abs() < 4.0 * 0.141, "{mean}");
            let variance = samples.iter().map(|s| (s[0] - mean).powi(2)).sum::<f64>() / 2000.0;
            variance.sqrt()
        });
        assert!(alone > 0.4, "{alone}");
        // A fifth of the roughness is treated as independent: sqrt(1 + 0.2 * 9) * 0.141.
        assert!(together < 0.27, "{together}");
    }

    #[test]
    fn each_unknown_is_as_wide_as_its_own_readings_scatter() {
        // `a` moves readings 1 to 100, which are smooth, and `b` readings 101 to 200, which a shift
        // of 0.6 moves together. Slopes are 0.5: `a` has a standard deviation of 1 / (0.5 sqrt 100)
        // = 0.2 and `b` of sqrt(0.2^2 + (0.6 / 0.5)^2) = 1.2.
        let (m, slope, rough) = (200, 0.5, 0.6);
        let region = Gaussian::diagonal(&[0.0; 2], &[1.0; 2], &[-9.0; 2], &[9.0; 2]);
        let mut rng = Streams::new(4).stream("e");
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let observed: Vec<f64> = (0..m).map(|_| normal()).collect();
        let mut draws = Streams::new(4).stream("d");
        let points: Vec<Vec<f64>> = (0..64).map(|_| region.sample(&mut draws)).collect();
        let residuals: Vec<Vec<f64>> = points
            .iter()
            .map(|x| {
                let luck = rough * normal();
                let simulated = |k: usize| {
                    if k < m / 2 {
                        slope * x[0]
                    } else {
                        slope * x[1] + luck
                    }
                };
                (0..m).map(|k| simulated(k) - observed[k]).collect()
            })
            .collect();
        let p: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
        let r: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
        let emulator = Emulator::fit(&region, &p, &r, m, false).unwrap();
        let mut walk = Streams::new(4).stream("w");
        let samples = emulator.sample(&[-9.0; 2], &[9.0; 2], 2000, &mut walk);
        let std = |i: usize| {
            let mean = samples.iter().map(|s| s[i]).sum::<f64>() / 2000.0;
            (samples.iter().map(|s| (s[i] - mean).powi(2)).sum::<f64>() / 2000.0).sqrt()
        };
        assert!((std(0) / 0.2 - 1.0).abs() < 0.3, "{}", std(0));
        // Slopes and roughness come from 64 points.
        assert!((std(1) / 1.2 - 1.0).abs() < 0.35, "{}", std(1));
    }

    /// The readings show two unknowns only through their product, smoothly, and a third one with a
    /// shift that moves all its readings.
    ///
    /// Along the valley of the product nothing is known, so the first unknown spreads over the box.
    /// A normal density about the minimum would hold it near the valley's tangent.
    #[test]
    fn a_curved_valley_stays_open_beside_an_unknown_that_scatters() {
        let (m, slope, rough) = (200, 0.5, 3.0);
        let region = Gaussian::diagonal(&[0.0; 3], &[1.0; 3], &[-9.0; 3], &[9.0; 3]);
        let mut rng = Streams::new(5).stream("e");
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut draws = Streams::new(5).stream("d");
        let points: Vec<Vec<f64>> = (0..96).map(|_| region.sample(&mut draws)).collect();
        let product = |x: &[f64]| (2.0 + x[0]) * (2.0 + x[1]) - 4.0;
        let residuals: Vec<Vec<f64>> = points
            .iter()
            .map(|x| {
                let luck = rough * normal();
                let half = |k: usize| k < m / 2;
                let simulated = |k| if half(k) { product(x) } else { x[2] + luck };
                (0..m).map(|k| slope * simulated(k)).collect()
            })
            .collect();
        let p: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
        let r: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
        let emulator = Emulator::fit(&region, &p, &r, m, false).unwrap();
        // Of the product, 100 readings of slope 0.5 tell 0.2.
        let off = |x: [f64; 3]| emulator.loss(&x) - emulator.loss(&[0.0; 3]);
        let across = off([0.1, 0.1, 0.0]);
        let wanted = 0.5 * (0.41_f64 / 0.2).powi(2);
        assert!((across / wanted - 1.0).abs() < 0.1, "{across} {wanted}");
        // Both points have the product of the middle.
        for x in [-1.0, 1.5] {
            let along = off([x, 4.0 / (2.0 + x) - 2.0, 0.0]);
            assert!(along.abs() < 0.2, "{x}: {along}");
        }
    }

    /// A linear simulator whose minimum lies 5 standard deviations of the region from its middle.
    /// The loss within reach is that of the sandwich about this minimum.
    #[test]
    fn a_minimum_beyond_reach_leaves_the_slope_of_the_sandwich() {
        let (m, slope, rough, minimum): (usize, f64, f64, f64) = (100, 0.5, 0.6, 5.0);
        let region = Gaussian::diagonal(&[0.0], &[1.0], &[-9.0], &[9.0]);
        // Every point twice, with a shift of all readings up and down: the regression is exact.
        let points: Vec<Vec<f64>> = (0..32)
            .map(|i| vec![0.2 * f64::from(i / 2) - 1.5])
            .collect();
        let residuals: Vec<Vec<f64>> = points
            .iter()
            .zip([rough, -rough].into_iter().cycle())
            .map(|(x, luck)| vec![slope * (x[0] - minimum) + luck; m])
            .collect();
        let p: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
        let r: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
        let emulator = Emulator::fit(&region, &p, &r, m, false).unwrap();
        assert!((emulator.best()[0] - REACH).abs() < 1e-6);
        // Of the noise, and of the shift: 32 points less 3 features tell its variance.
        let shift = rough.powi(2) * 32.0 / 29.0;
        let variance = (1.0 / m as f64 + shift) / slope.powi(2);
        let wanted = |x: f64| 0.5 * (x - minimum).powi(2) / variance;
        for x in [-2.0, 0.0, 2.0] {
            let rise = emulator.loss(&[x]) - emulator.loss(&[REACH]);
            let right = wanted(x) - wanted(REACH);
            assert!((rise / right - 1.0).abs() < 1e-3, "{x}: {rise} {right}");
        }
    }

    #[test]
    fn slopes_are_derivatives_of_features() {
        let u = [0.3, -0.7, 1.1];
        let h = 1e-6;
        for k in 0..3 {
            let (mut up, mut down) = (u, u);
            up[k] += h;
            down[k] -= h;
            for ((a, b), s) in features(&up)
                .iter()
                .zip(features(&down))
                .zip(feature_slope(&u, k))
            {
                assert!(((a - b) / (2.0 * h) - s).abs() < 1e-8);
            }
        }
    }
}
