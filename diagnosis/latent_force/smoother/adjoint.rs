//! The backward pass: the adjoint recursion of Bryson and Frazier, from the last row to the first.
//!
//! With `P` and `m` of the forward pass, the smoothed state is `m - P lambda` and its covariance
//! `P - P Lambda P`. The adjoint variables `lambda` and `Lambda` absorb each reading and are
//! propagated back through each transition (Bierman 1977).
//!
//! States are smoothed from the filtered state *after* the row's readings. From the predicted
//! state, a wide prior and a precise reading would leave a small difference of two large numbers.

use super::Smoothed;
use super::filter::{Filter, Step};
use super::matrix::{dot, multiply, multiply_atb, symmetrise};

/// Smooths an episode whose forward pass took these steps.
pub(super) fn backward(filter: &mut Filter<'_>, steps: &[Step]) -> Smoothed {
    let mut pass = Adjoint::new(filter, steps.len());
    let mut later: Option<Later> = None;
    for (k, step) in steps.iter().enumerate().rev() {
        if k + 1 < steps.len() {
            if step.breaks {
                pass.forget();
            } else {
                pass.sum_white(k);
                pass.transport(k);
            }
        }
        pass.smooth(k, step);
        pass.sum_readings(k, step);
        if let Some(later) = later.take().filter(|_| !step.breaks) {
            pass.sum_forces(k, step, &later);
        }
        pass.take_up(k, step);
        later = Some(pass.later(k, step));
    }
    pass.out
}

/// Values of the later row that the sums of a row need.
struct Later {
    /// Rows of `P Lambda` that belong to the forces, before that row's readings, `nv x nz`.
    correction: Vec<f64>,
    /// Smoothed forces and their variances, `nv`.
    force: Vec<f64>,
    variance: Vec<f64>,
}

/// The adjoint variables at a row, and what has been smoothed so far.
struct Adjoint<'f, 'a> {
    filter: &'f mut Filter<'a>,
    /// `lambda`, `nz`.
    vector: Vec<f64>,
    /// `Lambda`, `nz x nz`.
    matrix: Vec<f64>,
    scratch: Vec<f64>,
    out: Smoothed,
}

impl<'f, 'a> Adjoint<'f, 'a> {
    fn new(filter: &'f mut Filter<'a>, rows: usize) -> Self {
        let nz = filter.nz;
        let out = Smoothed {
            log_likelihood: filter.total(),
            ..Smoothed::unmoved(rows, filter.noise)
        };
        Self {
            filter,
            vector: vec![0.0; nz],
            matrix: vec![0.0; nz * nz],
            scratch: vec![0.0; nz * nz],
            out,
        }
    }

    /// Resets the adjoint variables, where later rows carry no information about this one.
    fn forget(&mut self) {
        self.vector.fill(0.0);
        self.matrix.fill(0.0);
    }

    /// Adds to the sums the expected square of the forces' white part between row `k` and the next.
    fn sum_white(&mut self, k: usize) {
        let (nx, nv, nz) = (self.filter.nx, self.filter.nv, self.filter.nz);
        for j in 0..nv {
            let v = self.filter.noise.white[j];
            let b = |i: usize| self.filter.problem.b[(k * nx + i) * nv + j];
            let along: f64 = (0..nx).map(|i| b(i) * self.vector[i]).sum();
            let bent: f64 = (0..nx)
                .map(|i| {
                    let row = &self.matrix[i * nz..i * nz + nx];
                    b(i) * row.iter().enumerate().map(|(l, x)| x * b(l)).sum::<f64>()
                })
                .sum();
            self.out.sums.white[j] += (v * along).powi(2) + (v - v * v * bent).max(0.0);
        }
    }

    /// Propagates the adjoint variables back through the transition of row `k`, which the filter
    /// holds from here on.
    fn transport(&mut self, k: usize) {
        let nz = self.filter.nz;
        self.filter.set_transition(k);
        let f = &self.filter.transition;
        let mut vector = vec![0.0; nz];
        for (row, &l) in f.chunks_exact(nz).zip(&self.vector) {
            vector.iter_mut().zip(row).for_each(|(n, x)| *n += l * x);
        }
        self.vector = vector;
        multiply(&self.matrix, f, nz, &mut self.scratch);
        multiply_atb(f, &self.scratch, nz, &mut self.matrix);
        symmetrise(&mut self.matrix, nz);
    }

    /// Stores the smoothed state and force of row `k`, with their variances.
    fn smooth(&mut self, k: usize, step: &Step) {
        let (nx, nv, nz) = (self.filter.nx, self.filter.nv, self.filter.nz);
        multiply(&step.covariance, &self.matrix, nz, &mut self.scratch);
        let row = |i: usize| &step.covariance[i * nz..(i + 1) * nz];
        let mean = |i: usize| step.mean[i] - dot(row(i), &self.vector);
        let variance = |i: usize| {
            let product = &self.scratch[i * nz..(i + 1) * nz];
            let column: f64 = (0..nz).map(|l| product[l] * row(l)[i]).sum();
            (row(i)[i] - column).max(0.0)
        };
        for i in 0..nx {
            self.out.change[k * nx + i] = mean(i);
            self.out.change_variance[k * nx + i] = variance(i);
        }
        for j in 0..nv {
            self.out.force[k * nv + j] = mean(nx + j);
            self.out.force_variance[k * nv + j] = variance(nx + j);
        }
    }

    /// Adds the squared residuals of row `k`, with their variances, to the sums.
    fn sum_readings(&mut self, k: usize, step: &Step) {
        let (nx, nz, ns) = (self.filter.nx, self.filter.nz, self.filter.ns);
        for taken in &step.taken {
            let h = self.filter.slope(k, taken.entry);
            let mut v = vec![0.0; nz];
            for (v, row) in v.iter_mut().zip(step.covariance.chunks_exact(nz)) {
                *v = dot(&row[..nx], h);
            }
            let rows = self.matrix.chunks_exact(nz).zip(&v);
            let bent: f64 = rows.map(|(row, x)| x * dot(row, &v)).sum();
            let spread = (dot(&v[..nx], h) - bent).max(0.0);
            let reading = self.filter.problem.linear.residual[k * ns + taken.entry];
            let left = reading - dot(&self.out.change[k * nx..(k + 1) * nx], h);
            let sums = &mut self.out.sums.reading[taken.entry];
            sums[0] += left * left + spread;
            sums[1] += 1.0;
        }
    }

    /// Adds to the sums the expected squares and products of the forces of row `k` and the next.
    fn sum_forces(&mut self, k: usize, step: &Step, later: &Later) {
        let (nx, nv, nz) = (self.filter.nx, self.filter.nv, self.filter.nz);
        let time = &self.filter.problem.walk.time;
        self.out.sums.steps += 1.0;
        self.out.sums.seconds += time[k + 1] - time[k];
        let transition = &self.filter.transition;
        for j in 0..nv {
            let carried = |l: usize| -> f64 {
                let row = &transition[l * nz..(l + 1) * nz];
                let column = |i: usize| step.covariance[i * nz + nx + j];
                (0..nz).map(|i| row[i] * column(i)).sum()
            };
            let column: Vec<f64> = (0..nz).map(carried).collect();
            let correction = &later.correction[j * nz..(j + 1) * nz];
            let cross = column[nx + j] - dot(correction, &column);
            let (w0, w1) = (self.out.force[k * nv + j], later.force[j]);
            let sums = &mut self.out.sums.force[j];
            sums[0] += w1 * w1 + later.variance[j];
            sums[1] += w0 * w0 + self.out.force_variance[k * nv + j];
            sums[2] += w1 * w0 + cross;
        }
    }

    /// Absorbs the readings of row `k` into the adjoint variables, the last one first.
    fn take_up(&mut self, k: usize, step: &Step) {
        let (nx, nz) = (self.filter.nx, self.filter.nz);
        for taken in step.taken.iter().rev() {
            let h = self.filter.slope(k, taken.entry);
            let s = taken.variance;
            let along = dot(&taken.gain, &self.vector) / s;
            for (l, h) in self.vector.iter_mut().zip(h) {
                *l -= h * (taken.innovation / s + along);
            }
            let rows = self.matrix.chunks_exact(nz);
            let u: Vec<f64> = rows.map(|row| dot(row, &taken.gain) / s).collect();
            let c = dot(&u, &taken.gain) / s + 1.0 / s;
            for i in 0..nz {
                let hi = if i < nx { h[i] } else { 0.0 };
                let row = &mut self.matrix[i * nz..(i + 1) * nz];
                for (x, u) in row.iter_mut().zip(&u) {
                    *x -= hi * u;
                }
                for (x, h) in row[..nx].iter_mut().zip(h) {
                    *x += (hi * c - u[i]) * h;
                }
            }
        }
    }

    /// Returns the values of row `k` that the row before needs.
    fn later(&self, k: usize, step: &Step) -> Later {
        let (nx, nv, nz) = (self.filter.nx, self.filter.nv, self.filter.nz);
        let mut correction = vec![0.0; nv * nz];
        for (j, target) in correction.chunks_exact_mut(nz).enumerate() {
            let p = &step.predicted[(nx + j) * nz..(nx + j + 1) * nz];
            for (&p, row) in p.iter().zip(self.matrix.chunks_exact(nz)) {
                target.iter_mut().zip(row).for_each(|(t, x)| *t += p * x);
            }
        }
        let of = |all: &[f64]| all[k * nv..(k + 1) * nv].to_vec();
        Later {
            correction,
            force: of(&self.out.force),
            variance: of(&self.out.force_variance),
        }
    }
}
