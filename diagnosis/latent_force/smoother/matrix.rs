//! Products of the small row-major square matrices in filters and smoothers.
//!
//! Most have 3 to 66 rows, and half of their entries are zero. Small ones use loops that skip the
//! zeros, larger ones nalgebra's blocked product.

use nalgebra::{DMatrixView, DMatrixViewMut};

/// Width from which a blocked product beats loops that skip zeros, measured on transitions of
/// machines of 1 to 22 degrees of freedom.
const BLOCKED: usize = 16;
/// Partial sums that a dot product accumulates in parallel: with one, each addition waits for the
/// one before.
const LANES: usize = 8;

/// Computes the product `out = a b` of row-major square matrices.
pub(super) fn multiply(a: &[f64], b: &[f64], n: usize, out: &mut [f64]) {
    multiply_columns(a, b, (n, n), out);
}

/// Computes `out = a b'`.
pub(super) fn multiply_abt(a: &[f64], b: &[f64], n: usize, out: &mut [f64]) {
    if n >= BLOCKED {
        let b = view(b, n).transpose();
        DMatrixViewMut::from_slice(out, n, n).gemm(1.0, &b, &view(a, n), 0.0);
        return;
    }
    for i in 0..n {
        let row = &a[i * n..(i + 1) * n];
        for j in 0..n {
            out[i * n + j] = dot(row, &b[j * n..(j + 1) * n]);
        }
    }
}

/// Computes `out = a s`, of a row-major square matrix and a matrix of `m` columns.
pub(super) fn multiply_columns(a: &[f64], s: &[f64], (n, m): (usize, usize), out: &mut [f64]) {
    if n >= BLOCKED {
        // In column-major order these are transposed, and `(a s)' = s' a'`.
        let s = DMatrixView::from_slice(s, m, n);
        DMatrixViewMut::from_slice(out, m, n).gemm(1.0, &s, &view(a, n), 0.0);
        return;
    }
    out.fill(0.0);
    for i in 0..n {
        let target = &mut out[i * m..(i + 1) * m];
        for (l, &x) in a[i * n..(i + 1) * n].iter().enumerate() {
            if x != 0.0 {
                let row = &s[l * m..(l + 1) * m];
                target.iter_mut().zip(row).for_each(|(t, s)| *t += x * s);
            }
        }
    }
}

/// Computes `out = a' b`.
pub(super) fn multiply_atb(a: &[f64], b: &[f64], n: usize, out: &mut [f64]) {
    if n >= BLOCKED {
        let a = view(a, n).transpose();
        DMatrixViewMut::from_slice(out, n, n).gemm(1.0, &view(b, n), &a, 0.0);
        return;
    }
    out.fill(0.0);
    for (l, row) in a.chunks_exact(n).enumerate() {
        let right = &b[l * n..(l + 1) * n];
        for (i, &x) in row.iter().enumerate().filter(|(_, x)| **x != 0.0) {
            let target = &mut out[i * n..(i + 1) * n];
            target.iter_mut().zip(right).for_each(|(t, y)| *t += x * y);
        }
    }
}

/// Views a row-major square matrix in column-major order, as its transpose.
fn view(a: &[f64], n: usize) -> DMatrixView<'_, f64> {
    DMatrixView::from_slice(a, n, n)
}

/// Returns the dot product.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (mut x, mut y) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let mut sums = [0.0; LANES];
    for (x, y) in x.by_ref().zip(y.by_ref()) {
        for (s, (x, y)) in sums.iter_mut().zip(x.iter().zip(y)) {
            *s += x * y;
        }
    }
    let rest = x.remainder().iter().zip(y.remainder());
    sums.iter().sum::<f64>() + rest.map(|(x, y)| x * y).sum::<f64>()
}

/// Symmetrises a row-major square matrix: each pair of entries becomes its mean.
pub(super) fn symmetrise(p: &mut [f64], n: usize) {
    for i in 0..n {
        for j in 0..i {
            let mean = 0.5 * (p[i * n + j] + p[j * n + i]);
            p[i * n + j] = mean;
            p[j * n + i] = mean;
        }
    }
}
