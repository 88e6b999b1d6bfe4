//! The adjoint recursion of Bryson and Frazier, from the last row to the first.

use super::filter::{Filter, Step, dot, multiply, multiply_transposing, symmetrise};
use super::{Smoothed, Sums};

/// The adjoint recursion from the last row to the first. States are corrected from where their own row's readings leave
/// them: from before these, what a wide start and a fine reading have in common would be the difference of two
/// large numbers.
pub(super) fn backward(filter: &mut Filter<'_>, steps: &[Step]) -> Smoothed {
    let (nx, nv, nz, ns) = (filter.nx, filter.nv, filter.nz, filter.ns);
    let rows = steps.len();
    let mut out = Smoothed {
        log_likelihood: filter.total(),
        change: vec![0.0; rows * nx],
        damped: Vec::new(),
        root: nalgebra::DMatrix::zeros(0, 0),
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
                multiply_transposing(f, &scratch, nz, &mut curvature);
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
