//! Kalman filter and smoother with the missing force as a hidden state.
//!
//! About a trajectory `x_k` the true state is `x_k` moved by `d_k` (tangent coordinates), and
//!
//! ```text
//! d_{k+1} = A_k d_k + B_k (w_k + e_k) + f(x_k) - x_{k+1}
//! w_{k+1} = rho_k w_k + noise,   variance q (1 - rho_k^2),   rho_k = exp(-dt_k / tau)
//! y_k     = h(x_k) + H_k d_k + noise,   variance r
//! ```
//!
//! `e_k` is the part of it that is another one in each row: what changes at once, as friction does where a joint turns
//! round, is no rare event of a slow process.
//! `w` is the generalized force that the model lacks, one a degree of freedom (a latent force model, Alvarez,
//! Luengo and Lawrence 2009, in state-space form, Hartikainen and Sarkka 2010); `e_k` is a force of known variance
//! that only some rows have: what may hold a joint at rest. Readings are taken one by one, so that no matrix is
//! inverted; smoothing is by Bryson and Frazier's adjoint recursion (Bierman 1977), which inverts none either.
//! Columns (what a unit of an effect adds to `f` and `h`) go through the same filter: in whitened innovations all
//! effects are one linear regression.

use nalgebra::{DMatrix, DVector};

use super::step_map::LinearEpisode;
use super::walk::Walk;

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
    /// Its variances, `rows x nx`.
    pub change_variance: Vec<f64>,
    /// Missing force, `rows x nv`.
    pub force: Vec<f64>,
    /// Its variances, `rows x nv`.
    pub force_variance: Vec<f64>,
    /// Sums for the noise model.
    pub sums: Sums,
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

/// Ratio of an innovation's variance to its reading's own from which on rounding is taken out of the covariance: it has
/// lost 6 of a double's 16 digits there. A start within metres that is read to 10 um has a ratio of 1e11; rows
/// within a walk stay far below.
const FINE: f64 = 1e6;

/// A row-major square matrix product `out = a b`.
fn multiply(a: &[f64], b: &[f64], n: usize, out: &mut [f64]) {
    out.fill(0.0);
    for i in 0..n {
        let row = &mut out[i * n..(i + 1) * n];
        for (l, &x) in a[i * n..(i + 1) * n].iter().enumerate() {
            if x != 0.0 {
                let other = &b[l * n..(l + 1) * n];
                row.iter_mut().zip(other).for_each(|(o, y)| *o += x * y);
            }
        }
    }
}

/// `out = a b'`.
fn multiply_transposed(a: &[f64], b: &[f64], n: usize, out: &mut [f64]) {
    for i in 0..n {
        let row = &a[i * n..(i + 1) * n];
        for j in 0..n {
            out[i * n + j] = dot(row, &b[j * n..(j + 1) * n]);
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn symmetrise(p: &mut [f64], n: usize) {
    for i in 0..n {
        for j in 0..i {
            let mean = 0.5 * (p[i * n + j] + p[j * n + i]);
            p[i * n + j] = mean;
            p[j * n + i] = mean;
        }
    }
}

/// One reading of a row as it was taken.
struct Taken {
    /// Its entry.
    entry: usize,
    /// Innovation and its variance.
    innovation: f64,
    variance: f64,
    /// Covariance of the state with the reading, `nz`.
    gain: Vec<f64>,
}

/// A row on the way forward.
struct Step {
    /// Covariance before its readings.
    predicted: Vec<f64>,
    /// Mean and covariance after them.
    mean: Vec<f64>,
    covariance: Vec<f64>,
    taken: Vec<Taken>,
    /// Whether the next row begins anew.
    breaks: bool,
}

/// The forward recursion.
struct Filter<'a> {
    problem: Problem<'a>,
    noise: &'a NoiseModel,
    nx: usize,
    nv: usize,
    nz: usize,
    ns: usize,
    mean: Vec<f64>,
    covariance: Vec<f64>,
    transition: Vec<f64>,
    scratch: Vec<f64>,
    /// Of each entry: logarithm of the likelihood of its readings, and how many.
    log_likelihood: Vec<[f64; 2]>,
}

impl<'a> Filter<'a> {
    fn new(problem: Problem<'a>, noise: &'a NoiseModel) -> Self {
        let nv = noise.q.len();
        let (nx, nz, ns) = (2 * nv, 3 * nv, noise.r.len());
        let mut filter = Self {
            problem,
            noise,
            nx,
            nv,
            nz,
            ns,
            mean: vec![0.0; nz],
            covariance: vec![0.0; nz * nz],
            transition: vec![0.0; nz * nz],
            scratch: vec![0.0; nz * nz],
            log_likelihood: vec![[0.0; 2]; ns],
        };
        filter.begin();
        filter.mean[..nx].copy_from_slice(&problem.start.mean);
        filter
    }

    /// Sets the state to the prior about the trajectory.
    fn begin(&mut self) {
        self.mean.fill(0.0);
        self.covariance.fill(0.0);
        for (i, v) in self.problem.start.variance.iter().enumerate() {
            self.covariance[i * self.nz + i] = *v;
        }
        for (j, q) in self.noise.q.iter().enumerate() {
            self.covariance[(self.nx + j) * (self.nz + 1)] = *q;
        }
    }

    /// Logarithm of the likelihood of all readings. One that tells of before the first row counts as the others of its entry
    /// on average, so that a model in which a sensor is late is compared on as many readings as one in which it is not.
    fn total(&self) -> f64 {
        let early = |i: usize| self.problem.linear.early.get(i).copied().unwrap_or(0.0);
        let entries = self.log_likelihood.iter().enumerate();
        entries
            .map(|(i, [sum, n])| sum * (1.0 + early(i) / n.max(1.0)))
            .sum()
    }

    /// Slope of an entry of row `k` in the state.
    fn slope(&self, k: usize, entry: usize) -> &'a [f64] {
        let at = (k * self.ns + entry) * self.nx;
        &self.problem.linear.h[at..at + self.nx]
    }

    /// Takes an entry's reading, where there is one.
    fn take(&mut self, k: usize, entry: usize) -> Option<Taken> {
        let reading = self.problem.linear.residual[k * self.ns + entry];
        if !reading.is_finite() {
            return None;
        }
        let (nx, nz) = (self.nx, self.nz);
        let h = self.slope(k, entry);
        let gain: Vec<f64> = self
            .covariance
            .chunks_exact(nz)
            .map(|row| dot(&row[..nx], h))
            .collect();
        let variance = dot(&gain[..nx], h) + self.noise.r[entry];
        let innovation = reading - dot(&self.mean[..nx], h);
        let own = &mut self.log_likelihood[entry];
        own[0] -= 0.5 * (innovation * innovation / variance + variance.ln());
        own[1] += 1.0;
        for (m, g) in self.mean.iter_mut().zip(&gain) {
            *m += g * innovation / variance;
        }
        for (row, &g) in self.covariance.chunks_exact_mut(nz).zip(&gain) {
            let share = g / variance;
            row.iter_mut().zip(&gain).for_each(|(p, g)| *p -= share * g);
        }
        if variance > FINE * self.noise.r[entry] {
            self.restore(h, &gain, (variance, self.noise.r[entry]));
        }
        Some(Taken {
            entry,
            innovation,
            variance,
            gain,
        })
    }

    /// Takes the rounding error out of a covariance `P` that a fine reading has just made small: with `K = gain / s`
    /// it satisfies `P h = r K`, and the least symmetric change along `K` makes it so again.
    fn restore(&mut self, h: &[f64], gain: &[f64], (s, r): (f64, f64)) {
        let (nx, nz) = (self.nx, self.nz);
        let error: Vec<f64> = self
            .covariance
            .chunks_exact(nz)
            .zip(gain)
            .map(|(row, g)| dot(&row[..nx], h) - r * g / s)
            .collect();
        // In units of `h gain`, so that `along` has a product of 1 with `h`.
        let scale = dot(&gain[..nx], h);
        let along: Vec<f64> = gain.iter().map(|g| g / scale).collect();
        let twice = dot(&error[..nx], h);
        for (i, row) in self.covariance.chunks_exact_mut(nz).enumerate() {
            for (l, p) in row.iter_mut().enumerate() {
                *p -= error[i] * along[l] + along[i] * (error[l] - twice * along[l]);
            }
        }
    }

    /// Whether the engine carried row `k` to the next.
    fn carries(&self, k: usize) -> bool {
        let defect = &self.problem.linear.defect[k * self.nx..(k + 1) * self.nx];
        defect.iter().all(|x| x.is_finite())
    }

    /// Correlation of each force from row `k` to the next.
    fn correlation(&self, k: usize) -> impl Iterator<Item = f64> + 'a {
        let time = &self.problem.walk.time;
        let dt = time[k + 1] - time[k];
        self.noise.tau.iter().map(move |tau| (-dt / tau).exp())
    }

    /// Fills in the transition of row `k`.
    fn set_transition(&mut self, k: usize) {
        let (nx, nv, nz) = (self.nx, self.nv, self.nz);
        self.transition.fill(0.0);
        for i in 0..nx {
            let a = &self.problem.linear.a[(k * nx + i) * nx..(k * nx + i + 1) * nx];
            let b = &self.problem.b[(k * nx + i) * nv..(k * nx + i + 1) * nv];
            self.transition[i * nz..i * nz + nx].copy_from_slice(a);
            self.transition[i * nz + nx..(i + 1) * nz].copy_from_slice(b);
        }
        for (j, rho) in self.correlation(k).enumerate() {
            self.transition[(nx + j) * (nz + 1)] = rho;
        }
    }

    /// Carries mean and covariance from row `k` to the next.
    fn predict(&mut self, k: usize) {
        let (nx, nv, nz) = (self.nx, self.nv, self.nz);
        if !self.carries(k) {
            self.begin();
            return;
        }
        self.set_transition(k);
        let mean: Vec<f64> = self
            .transition
            .chunks_exact(nz)
            .map(|row| dot(row, &self.mean))
            .collect();
        self.mean = mean;
        let defect = &self.problem.linear.defect[k * nx..(k + 1) * nx];
        for (m, d) in self.mean.iter_mut().zip(defect) {
            *m += d;
        }
        multiply(&self.transition, &self.covariance, nz, &mut self.scratch);
        multiply_transposed(&self.scratch, &self.transition, nz, &mut self.covariance);
        for (j, rho) in self.correlation(k).enumerate() {
            self.covariance[(nx + j) * (nz + 1)] += self.noise.q[j] * (1.0 - rho * rho);
        }
        let free = self.problem.free.get(k * nv..(k + 1) * nv).unwrap_or(&[]);
        for (j, white) in self.noise.white.iter().enumerate() {
            let variance = white + free.get(j).unwrap_or(&0.0);
            let b = |i: usize| self.problem.b[(k * nx + i) * nv + j];
            for i in 0..nx {
                let bi = b(i) * variance;
                for l in 0..nx {
                    self.covariance[i * nz + l] += bi * b(l);
                }
            }
        }
        symmetrise(&mut self.covariance, nz);
    }
}

/// Logarithm of the likelihood of an episode.
#[must_use]
pub fn log_likelihood(problem: Problem<'_>, noise: &NoiseModel) -> f64 {
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

/// Smooths an episode.
#[must_use]
pub fn smooth(problem: Problem<'_>, noise: &NoiseModel) -> Smoothed {
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

/// The adjoint recursion from the last row to the first. States are corrected from where their own row's readings leave
/// them: from before these, what a wide start and a fine reading have in common would be the difference of two
/// large numbers.
fn backward(filter: &mut Filter<'_>, steps: &[Step]) -> Smoothed {
    let (nx, nv, nz, ns) = (filter.nx, filter.nv, filter.nz, filter.ns);
    let rows = steps.len();
    let mut out = Smoothed {
        log_likelihood: filter.total(),
        change: vec![0.0; rows * nx],
        change_variance: vec![0.0; rows * nx],
        force: vec![0.0; rows * nv],
        force_variance: vec![0.0; rows * nv],
        sums: Sums {
            force: vec![[0.0; 3]; nv],
            white: vec![0.0; nv],
            reading: vec![[0.0; 2]; ns],
            ..Sums::default()
        },
    };
    let mut lambda = vec![0.0; nz];
    let mut curvature = vec![0.0; nz * nz];
    let mut product = vec![0.0; nz * nz];
    let mut scratch = vec![0.0; nz * nz];
    // Of the row after: the forces' rows of `P Lambda` before its readings, and its forces with their variances.
    let mut later: Option<(Vec<f64>, Vec<f64>, Vec<f64>)> = None;
    for k in (0..rows).rev() {
        let step = &steps[k];
        if k + 1 < rows {
            if !step.breaks {
                for j in 0..nv {
                    let v = filter.noise.white[j];
                    let b = |i: usize| filter.problem.b[(k * nx + i) * nv + j];
                    let along: f64 = (0..nx).map(|i| b(i) * lambda[i]).sum();
                    let bent: f64 = (0..nx)
                        .map(|i| {
                            let row = &curvature[i * nz..i * nz + nx];
                            b(i) * row.iter().enumerate().map(|(l, x)| x * b(l)).sum::<f64>()
                        })
                        .sum();
                    out.sums.white[j] += (v * along).powi(2) + (v - v * v * bent).max(0.0);
                }
            }
            if step.breaks {
                lambda.fill(0.0);
                curvature.fill(0.0);
            } else {
                filter.set_transition(k);
                let f = &filter.transition;
                let mut next = vec![0.0; nz];
                for (row, &l) in f.chunks_exact(nz).zip(&lambda) {
                    next.iter_mut().zip(row).for_each(|(n, x)| *n += l * x);
                }
                lambda = next;
                multiply(&curvature, f, nz, &mut scratch);
                // `F' (Lambda F)`, row by row of `F`.
                curvature.fill(0.0);
                for (l, row) in f.chunks_exact(nz).enumerate() {
                    let right = &scratch[l * nz..(l + 1) * nz];
                    for (i, &x) in row.iter().enumerate().filter(|(_, x)| **x != 0.0) {
                        let target = &mut curvature[i * nz..(i + 1) * nz];
                        target.iter_mut().zip(right).for_each(|(t, y)| *t += x * y);
                    }
                }
                symmetrise(&mut curvature, nz);
            }
        }
        multiply(&step.covariance, &curvature, nz, &mut product);
        let p = |i: usize, j: usize| step.covariance[i * nz + j];
        let smoothed =
            |i: usize| step.mean[i] - dot(&step.covariance[i * nz..(i + 1) * nz], &lambda);
        let variance = |i: usize| {
            let row = &product[i * nz..(i + 1) * nz];
            let column: f64 = (0..nz).map(|l| row[l] * p(l, i)).sum();
            (p(i, i) - column).max(0.0)
        };
        for i in 0..nx {
            out.change[k * nx + i] = smoothed(i);
            out.change_variance[k * nx + i] = variance(i);
        }
        for j in 0..nv {
            out.force[k * nv + j] = smoothed(nx + j);
            out.force_variance[k * nv + j] = variance(nx + j);
        }
        for taken in &step.taken {
            let h = filter.slope(k, taken.entry);
            let mut v = vec![0.0; nz];
            for (v, row) in v.iter_mut().zip(step.covariance.chunks_exact(nz)) {
                *v = dot(&row[..nx], h);
            }
            let bent: f64 = curvature
                .chunks_exact(nz)
                .zip(&v)
                .map(|(row, x)| x * dot(row, &v))
                .sum();
            let spread = (dot(&v[..nx], h) - bent).max(0.0);
            let reading = filter.problem.linear.residual[k * ns + taken.entry];
            let left = reading - dot(&out.change[k * nx..(k + 1) * nx], h);
            let sums = &mut out.sums.reading[taken.entry];
            sums[0] += left * left + spread;
            sums[1] += 1.0;
        }
        if let Some((after, force, spread)) = later.take().filter(|_| !step.breaks) {
            let time = &filter.problem.walk.time;
            out.sums.steps += 1.0;
            out.sums.seconds += time[k + 1] - time[k];
            // `filter.transition` is that of this row still.
            let f = &filter.transition;
            for j in 0..nv {
                let column: Vec<f64> = (0..nz)
                    .map(|l| {
                        let row = &f[l * nz..(l + 1) * nz];
                        (0..nz)
                            .map(|i| row[i] * step.covariance[i * nz + nx + j])
                            .sum()
                    })
                    .collect();
                let cross = column[nx + j] - dot(&after[j * nz..(j + 1) * nz], &column);
                let (w0, w1) = (out.force[k * nv + j], force[j]);
                let sums = &mut out.sums.force[j];
                sums[0] += w1 * w1 + spread[j];
                sums[1] += w0 * w0 + out.force_variance[k * nv + j];
                sums[2] += w1 * w0 + cross;
            }
        }
        for taken in step.taken.iter().rev() {
            let h = filter.slope(k, taken.entry);
            let s = taken.variance;
            let along = dot(&taken.gain, &lambda) / s;
            for (l, h) in lambda.iter_mut().zip(h) {
                *l -= h * (taken.innovation / s + along);
            }
            let u: Vec<f64> = curvature
                .chunks_exact(nz)
                .map(|row| dot(row, &taken.gain) / s)
                .collect();
            let c = dot(&u, &taken.gain) / s + 1.0 / s;
            for i in 0..nz {
                let hi = if i < nx { h[i] } else { 0.0 };
                let row = &mut curvature[i * nz..(i + 1) * nz];
                for (x, u) in row.iter_mut().zip(&u) {
                    *x -= hi * u;
                }
                for (x, h) in row[..nx].iter_mut().zip(h) {
                    *x += (hi * c - u[i]) * h;
                }
            }
        }
        // Rows of `P Lambda` for the forces.
        let mut rows_of_force = vec![0.0; nv * nz];
        for (j, target) in rows_of_force.chunks_exact_mut(nz).enumerate() {
            let p = &step.predicted[(nx + j) * nz..(nx + j + 1) * nz];
            for (&p, row) in p.iter().zip(curvature.chunks_exact(nz)) {
                target.iter_mut().zip(row).for_each(|(t, x)| *t += p * x);
            }
        }
        later = Some((
            rows_of_force,
            out.force[k * nv..(k + 1) * nv].to_vec(),
            out.force_variance[k * nv..(k + 1) * nv].to_vec(),
        ));
    }
    out
}

/// Innovations that are collected before they are added up.
const BLOCK: usize = 128;

/// Filters an episode with its columns.
#[must_use]
pub fn regress(problem: Problem<'_>, noise: &NoiseModel, m: usize) -> Regression {
    let mut filter = Filter::new(problem, noise);
    let (nx, nz, ns) = (filter.nx, filter.nz, filter.ns);
    let mut out = Regression {
        log_likelihood: 0.0,
        gram: DMatrix::zeros(m, m),
        moment: DVector::zeros(m),
    };
    // Sensitivity of the state to each column, `nz x m`.
    let mut sensitivity = vec![0.0; nz * m];
    let mut next = vec![0.0; nz * m];
    let mut block = DMatrix::<f64>::zeros(m, BLOCK);
    let mut innovations = DVector::<f64>::zeros(BLOCK);
    let mut filled = 0;
    let mut column = vec![0.0; m];
    for k in 0..problem.linear.rows {
        for entry in 0..ns {
            let Some(taken) = filter.take(k, entry) else {
                continue;
            };
            let own = (k * ns + entry) * m;
            column.copy_from_slice(&problem.linear.reading_columns[own..own + m]);
            let h = filter.slope(k, entry);
            for (i, &h) in h.iter().enumerate().filter(|(_, h)| **h != 0.0) {
                let row = &sensitivity[i * m..(i + 1) * m];
                column.iter_mut().zip(row).for_each(|(c, s)| *c += h * s);
            }
            let deviation = taken.variance.sqrt();
            for (x, c) in block.column_mut(filled).iter_mut().zip(&column) {
                *x = c / deviation;
            }
            innovations[filled] = taken.innovation / deviation;
            filled += 1;
            if filled == BLOCK {
                out.gram.gemm(1.0, &block, &block.transpose(), 1.0);
                out.moment.gemv(1.0, &block, &innovations, 1.0);
                filled = 0;
            }
            for (i, g) in taken.gain.iter().enumerate() {
                let gain = g / taken.variance;
                let row = &mut sensitivity[i * m..(i + 1) * m];
                row.iter_mut()
                    .zip(&column)
                    .for_each(|(s, c)| *s -= gain * c);
            }
        }
        if k + 1 == problem.linear.rows {
            break;
        }
        let carries = filter.carries(k);
        filter.predict(k);
        if !carries {
            sensitivity.fill(0.0);
            continue;
        }
        next.fill(0.0);
        for i in 0..nz {
            let target = &mut next[i * m..(i + 1) * m];
            for l in 0..nz {
                let f = filter.transition[i * nz + l];
                if f != 0.0 {
                    let row = &sensitivity[l * m..(l + 1) * m];
                    target.iter_mut().zip(row).for_each(|(t, s)| *t += f * s);
                }
            }
            if i < nx {
                let at = (k * nx + i) * m;
                let own = &problem.linear.state_columns[at..at + m];
                target.iter_mut().zip(own).for_each(|(t, c)| *t += c);
            }
        }
        std::mem::swap(&mut sensitivity, &mut next);
    }
    let block = block.columns(0, filled);
    let innovations = innovations.rows(0, filled);
    out.gram.gemm(1.0, &block, &block.transpose(), 1.0);
    out.moment.gemv(1.0, &block, &innovations, 1.0);
    out.log_likelihood = filter.total();
    out
}

#[cfg(test)]
mod tests;
