//! Normal equations of a fit, in arrow form: the initial state of an episode acts on that episode
//! alone, and is eliminated there (Schur complement).

use nalgebra::linalg::{SVD, SymmetricEigen};
use nalgebra::{DMatrix, DVector};

use crate::linearise::Linearisation;

/// Normal equations with the initial states eliminated.
pub(crate) struct Normal {
    /// Information matrix, `free x free`.
    pub(crate) information: DMatrix<f64>,
    /// Gradient, `free`.
    pub(crate) gradient: DVector<f64>,
    /// For each episode: inverse of its block, its coupling, and its gradient.
    episodes: Vec<(DMatrix<f64>, DMatrix<f64>, DVector<f64>)>,
}

/// Maximum number of QR iterations of a singular value decomposition per row: it needs two or
/// three, and never ends if an entry is not finite.
const ITERATIONS: usize = 100;
/// Squared component of a unit vector from which on a value has a part in a direction: rounding
/// leaves less.
const PART: f64 = 1e-6;

/// Returns the pseudo-inverse of a symmetric matrix, scaled to a unit diagonal first.
///
/// Directions whose share is below `tolerance` are left out. It is zero if an entry is not finite:
/// such a matrix carries no information.
#[must_use]
pub(crate) fn inverse(matrix: &DMatrix<f64>, tolerance: f64) -> DMatrix<f64> {
    let n = matrix.nrows();
    if n == 0 {
        return DMatrix::zeros(0, 0);
    }
    let scale = |i: usize| 1.0 / matrix[(i, i)].abs().sqrt().max(1e-150);
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale(i) * scale(j));
    let parts = scaled
        .iter()
        .all(|x| x.is_finite())
        .then(|| SVD::try_new(scaled, true, true, 5.0 * f64::EPSILON, ITERATIONS * n))
        .flatten();
    let inverse = parts
        .and_then(|parts| parts.pseudo_inverse(tolerance).ok())
        .unwrap_or_else(|| DMatrix::zeros(n, n));
    DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale(i) * scale(j))
}

/// Returns which values have a part in the directions that [`inverse`] leaves out, as two values
/// have that only show together.
///
/// A value that does not show at all has no part in them. None has if an entry is not finite.
#[must_use]
pub(crate) fn left_out(matrix: &DMatrix<f64>, tolerance: f64) -> Vec<bool> {
    let mut shares = vec![0.0; matrix.nrows()];
    let shown: Vec<usize> = (0..shares.len())
        .filter(|&i| matrix[(i, i)] != 0.0)
        .collect();
    let n = shown.len();
    let scale = |i: usize| 1.0 / matrix[(i, i)].abs().sqrt().max(1e-150);
    let scaled = DMatrix::from_fn(n, n, |i, j| {
        let (i, j) = (shown[i], shown[j]);
        matrix[(i, j)] * scale(i) * scale(j)
    });
    let is_finite = n > 0 && scaled.iter().all(|x| x.is_finite());
    let parts = is_finite
        .then(|| SymmetricEigen::try_new(scaled, 5.0 * f64::EPSILON, ITERATIONS * n))
        .flatten();
    if let Some(parts) = parts {
        for k in (0..n).filter(|&k| parts.eigenvalues[k] <= tolerance) {
            for (row, &i) in shown.iter().enumerate() {
                shares[i] += parts.eigenvectors[(row, k)].powi(2);
            }
        }
    }
    shares.iter().map(|share| *share > PART).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

impl Normal {
    /// Builds the equations from the rows before a replay diverges: after that residuals are
    /// infinite, and columns 0.
    ///
    /// Each coordinate of an initial state has a normal prior about its present value, with its
    /// `reach` as standard deviation; none if `reach` is empty.
    pub(crate) fn new(
        line: &Linearisation,
        bounds: &[std::ops::Range<usize>],
        damping: f64,
        reach: &[f64],
    ) -> Self {
        let finite = |x: &f64| if x.is_finite() { *x } else { 0.0 };
        let residuals: Vec<f64> = line.residuals.iter().map(finite).collect();
        let p = line.columns.len();
        let mut information = DMatrix::zeros(p, p);
        let mut gradient = DVector::zeros(p);
        for i in 0..p {
            gradient[i] = dot(&line.columns[i], &residuals);
            for j in 0..=i {
                let x = dot(&line.columns[i], &line.columns[j]);
                information[(i, j)] = x;
                information[(j, i)] = x;
            }
        }
        let m = line.start_columns.len();
        let mut episodes = Vec::new();
        if m > 0 {
            for range in bounds {
                let part = |c: &Vec<f64>| c[range.clone()].to_vec();
                let starts: Vec<Vec<f64>> = line.start_columns.iter().map(part).collect();
                let columns: Vec<Vec<f64>> = line.columns.iter().map(part).collect();
                let r = &residuals[range.clone()];
                let mut block = DMatrix::from_fn(m, m, |i, j| dot(&starts[i], &starts[j]));
                let coupling = DMatrix::from_fn(p, m, |i, j| dot(&columns[i], &starts[j]));
                let g = DVector::from_fn(m, |i, _| dot(&starts[i], r));
                for i in 0..m {
                    let prior = reach.get(i).map_or(0.0, |reach| reach.powi(-2));
                    block[(i, i)] += damping * block[(i, i)] + prior.max(1e-9);
                }
                let inverse = inverse(&block, 1e-12);
                information -= &coupling * &inverse * coupling.transpose();
                gradient -= &coupling * &inverse * &g;
                episodes.push((inverse, coupling, g));
            }
        }
        Self {
            information,
            gradient,
            episodes,
        }
    }

    /// Returns the change of the gradient per unit of each residual with the initial states
    /// refitted, `free x residuals`.
    ///
    /// These are the columns less their components along those of the initial states.
    pub(crate) fn projected(
        &self,
        line: &Linearisation,
        bounds: &[std::ops::Range<usize>],
    ) -> DMatrix<f64> {
        let p = line.columns.len();
        let mut out = DMatrix::from_fn(p, line.residuals.len(), |k, r| line.columns[k][r]);
        for (range, (inverse, coupling, _)) in bounds.iter().zip(&self.episodes) {
            let by_starts = coupling * inverse;
            for r in range.clone() {
                for (j, start) in line.start_columns.iter().enumerate() {
                    for k in 0..p {
                        out[(k, r)] -= by_starts[(k, j)] * start[r];
                    }
                }
            }
        }
        out
    }

    /// Returns the step of the free parameters; those in `held` do not move.
    pub(crate) fn step(&self, damping: f64, held: &[bool]) -> DVector<f64> {
        let p = self.gradient.len();
        // There are initial states alone.
        if p == 0 {
            return DVector::zeros(0);
        }
        let mut a = self.information.clone();
        let mut g = self.gradient.clone();
        for i in 0..p {
            a[(i, i)] += damping * self.information[(i, i)].abs() + 1e-12;
            if held[i] {
                for j in 0..p {
                    a[(i, j)] = 0.0;
                    a[(j, i)] = 0.0;
                }
                a[(i, i)] = 1.0;
                g[i] = 0.0;
            }
        }
        a.lu().solve(&g).unwrap_or_else(|| DVector::zeros(p))
    }

    /// Returns the step of an episode's initial state, given that of the parameters.
    pub(crate) fn start_step(&self, episode: usize, step: &DVector<f64>) -> DVector<f64> {
        let (inverse, coupling, g) = &self.episodes[episode];
        inverse * (g - coupling.transpose() * step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom, for a window of a hopper whose replay had failed: the decomposition never ended,
    /// and no answer came.
    #[test]
    fn the_inverse_of_what_is_no_number_is_zero_and_comes() {
        let matrix = DMatrix::from_row_slice(2, 2, &[2.0, f64::NAN, f64::NAN, 3.0]);
        assert_eq!(inverse(&matrix, 1e-12), DMatrix::zeros(2, 2));
        let matrix = DMatrix::from_row_slice(2, 2, &[f64::INFINITY, 1.0, 1.0, 3.0]);
        assert_eq!(inverse(&matrix, 1e-12), DMatrix::zeros(2, 2));
        let matrix = DMatrix::from_row_slice(2, 2, &[4.0, 0.0, 0.0, 0.0]);
        let expected = DMatrix::from_row_slice(2, 2, &[0.25, 0.0, 0.0, 0.0]);
        assert!((inverse(&matrix, 1e-12) - expected).amax() < 1e-15);
    }

    /// Two values with opposite columns, one that shows by itself and one that does not show.
    #[test]
    fn values_that_only_show_together_are_left_out() {
        let columns = DMatrix::from_row_slice(2, 4, &[3.0, -6.0, 0.0, 0.0, 0.0, 0.0, 1e-3, 0.0]);
        let matrix = columns.tr_mul(&columns);
        assert_eq!(left_out(&matrix, 1e-14), [true, true, false, false]);
        let apart = DMatrix::from_row_slice(2, 2, &[9.0, -17.9, -17.9, 36.0]);
        assert_eq!(left_out(&apart, 1e-14), [false, false]);
        let none = DMatrix::from_element(2, 2, f64::NAN);
        assert_eq!(left_out(&none, 1e-14), [false, false]);
        assert!(left_out(&DMatrix::zeros(0, 0), 1e-14).is_empty());
    }

    /// Symptom, for the spin of a ball about the normal of its floor: a step of ten thousand rad/s,
    /// which left nothing of the log.
    #[test]
    fn a_coordinate_that_hardly_shows_steps_no_further_than_it_reaches() {
        let line = Linearisation {
            residuals: vec![3.0, 3.0],
            columns: Vec::new(),
            start_columns: vec![vec![3.0, -3.0], vec![1e-3, 1e-3]],
        };
        let (rows, none) = (0..2, DVector::zeros(0));
        let step = |reach: &[f64]| {
            let normal = Normal::new(&line, std::slice::from_ref(&rows), 0.0, reach);
            normal.start_step(0, &none)[1]
        };
        assert!(step(&[]) > 1e3);
        // A derivative of 1e-3 per unit, and residuals of 3: 2 * 3e-3 over 2e-6 + 1 / 20^2.
        assert!((step(&[1.0, 20.0]) - 6e-3 / (2e-6 + 2.5e-3)).abs() < 1e-6);
    }

    /// Symptom, for a fish whose smoothed initial state made the replay diverge: the step was NaN,
    /// and the engine refused it.
    #[test]
    fn a_replay_that_diverges_steps_by_the_rows_before_it() {
        let line = Linearisation {
            residuals: vec![1.0, 2.0, f64::INFINITY],
            columns: vec![vec![2.0, 0.0, 0.0]],
            start_columns: vec![vec![0.0, 4.0, 0.0]],
        };
        let rows = 0..3;
        let normal = Normal::new(&line, std::slice::from_ref(&rows), 0.0, &[]);
        let step = normal.step(0.0, &[false]);
        assert!((step[0] - 0.5).abs() < 1e-9, "{step}");
        let start = normal.start_step(0, &step);
        assert!((start[0] - 0.5).abs() < 1e-9, "{start}");
    }
}
