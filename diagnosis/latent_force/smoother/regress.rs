//! The filter with columns: a linear regression in whitened innovations.

use nalgebra::{DMatrix, DVector};

use super::filter::Filter;
use super::matrix::multiply_columns;
use super::shown::Shown;
use super::{NoiseModel, Problem, Regression};

/// Number of innovations that are collected before their products are summed.
pub(super) const BLOCK: usize = 128;

/// Filters an episode with its `m` columns, or with some of them.
#[must_use]
pub fn regress(
    problem: Problem<'_>,
    noise: &NoiseModel,
    (m, some): (usize, Option<&[usize]>),
) -> Regression {
    let shown = Shown::of(problem.linear, m, some);
    let m = shown.len();
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
            column.copy_from_slice(&shown.readings[own..own + m]);
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
        multiply_columns(&filter.transition, &sensitivity, (nz, m), &mut next);
        let own = &shown.states[k * nx * m..(k + 1) * nx * m];
        next.iter_mut().zip(own).for_each(|(t, c)| *t += c);
        std::mem::swap(&mut sensitivity, &mut next);
    }
    let block = block.columns(0, filled);
    let innovations = innovations.rows(0, filled);
    out.gram.gemm(1.0, &block, &block.transpose(), 1.0);
    out.moment.gemv(1.0, &block, &innovations, 1.0);
    (out.gram, out.moment) = shown.spread(&out.gram, &out.moment);
    out.log_likelihood = filter.total();
    out
}
