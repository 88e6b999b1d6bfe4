//! The forward pass: a Kalman filter from the first row to the last, one reading at a time.
//!
//! The backward pass is in `adjoint.rs`.

use super::matrix::{dot, multiply, multiply_abt, symmetrise};
use super::{NoiseModel, Problem};

/// Ratio of an innovation's variance to its reading's own variance above which rounding is removed
/// from the covariance.
///
/// There it has lost 6 of a double's 16 digits. An initial state known within metres and read to 10
/// um has a ratio of 1e11; rows within a walk stay far below.
pub(super) const FINE: f64 = 1e6;

/// One processed reading of a row.
pub(super) struct Taken {
    /// Its entry.
    pub(super) entry: usize,
    /// The innovation and its variance.
    pub(super) innovation: f64,
    pub(super) variance: f64,
    /// Covariance of the state with the reading, `nz`.
    pub(super) gain: Vec<f64>,
}

/// One row of the forward pass.
pub(super) struct Step {
    /// Covariance before the row's readings.
    pub(super) predicted: Vec<f64>,
    /// Mean and covariance after the row's readings.
    pub(super) mean: Vec<f64>,
    pub(super) covariance: Vec<f64>,
    pub(super) taken: Vec<Taken>,
    /// Whether the filter restarts at the next row.
    pub(super) breaks: bool,
}

/// The forward recursion.
pub(super) struct Filter<'a> {
    pub(super) problem: Problem<'a>,
    pub(super) noise: &'a NoiseModel,
    pub(super) nx: usize,
    pub(super) nv: usize,
    pub(super) nz: usize,
    pub(super) ns: usize,
    pub(super) mean: Vec<f64>,
    pub(super) covariance: Vec<f64>,
    pub(super) transition: Vec<f64>,
    pub(super) scratch: Vec<f64>,
    /// For each entry: log-likelihood of its readings, and their number.
    pub(super) log_likelihood: Vec<[f64; 2]>,
}

impl<'a> Filter<'a> {
    pub(super) fn new(problem: Problem<'a>, noise: &'a NoiseModel) -> Self {
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
        filter.begin(&problem.start.variance);
        filter.mean[..nx].copy_from_slice(&problem.start.mean);
        filter
    }

    /// Centres the state on the trajectory, with some variances of the state and the stationary
    /// ones of the force.
    fn begin(&mut self, variances: &[f64]) {
        self.mean.fill(0.0);
        self.covariance.fill(0.0);
        for (i, v) in variances.iter().enumerate() {
            self.covariance[i * self.nz + i] = *v;
        }
        for (j, q) in self.noise.q.iter().enumerate() {
            self.covariance[(self.nx + j) * (self.nz + 1)] = *q;
        }
    }

    /// Returns the log-likelihood of all readings.
    ///
    /// The first readings of a late sensor show the machine before the first row, and no state here
    /// predicts them. Of two that show the same row, only the later one is taken. Each of the
    /// others counts as the mean of its entry's readings. So models with and without a delay are
    /// compared on equally many readings.
    pub(super) fn total(&self) -> f64 {
        let early = |i: usize| self.problem.linear.early.get(i).copied().unwrap_or(0.0);
        let entries = self.log_likelihood.iter().enumerate();
        entries
            .map(|(i, [sum, n])| sum * (1.0 + early(i) / n.max(1.0)))
            .sum()
    }

    /// Derivatives of an entry of row `k` with respect to the state.
    pub(super) fn slope(&self, k: usize, entry: usize) -> &'a [f64] {
        let at = (k * self.ns + entry) * self.nx;
        &self.problem.linear.h[at..at + self.nx]
    }

    /// Processes the reading of an entry; returns `None` where it is missing.
    pub(super) fn take(&mut self, k: usize, entry: usize) -> Option<Taken> {
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

    /// Removes the rounding error from a covariance `P` that a precise reading has just made small.
    ///
    /// With `K = gain / s`, `P` satisfies `P h = r K`. The smallest symmetric change along `K`
    /// restores this.
    pub(super) fn restore(&mut self, h: &[f64], gain: &[f64], (s, r): (f64, f64)) {
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

    /// Whether the engine stepped row `k` to the next without failing.
    pub(super) fn carries(&self, k: usize) -> bool {
        let defect = &self.problem.linear.defect[k * self.nx..(k + 1) * self.nx];
        defect.iter().all(|x| x.is_finite())
    }

    /// Returns the correlation of each force between row `k` and the next.
    pub(super) fn correlation(&self, k: usize) -> impl Iterator<Item = f64> + 'a {
        let time = &self.problem.walk.time;
        let dt = time[k + 1] - time[k];
        self.noise.tau.iter().map(move |tau| (-dt / tau).exp())
    }

    /// Fills in the transition matrix of row `k`.
    pub(super) fn set_transition(&mut self, k: usize) {
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

    /// Propagates mean and covariance from row `k` to the next.
    pub(super) fn predict(&mut self, k: usize) {
        let (nx, nv, nz) = (self.nx, self.nv, self.nz);
        if !self.carries(k) {
            self.begin(&self.problem.start.unknown);
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
        multiply_abt(&self.scratch, &self.transition, nz, &mut self.covariance);
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
