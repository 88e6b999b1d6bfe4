//! A segment: no force is missing along it, and only its initial state is unknown.
//!
//! Its derivatives are those of its whole replay, because those of a contact over single rows
//! reflect contact points that appear and vanish. Every reading is linear in the change of the
//! initial state and in the columns. The filter is then a least-squares problem in `nx` unknowns
//! with a prior.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::{NoiseModel, Problem, Regression, Smoothed};

/// Relative increases of the normal equations' diagonal that give the shorter steps of an initial
/// state (Levenberg-Marquardt damping).
const DAMPINGS: [f64; 2] = [1.0, 100.0];

/// Readings of a segment in units of their standard deviations, with their derivatives.
struct Rows {
    /// Entry of each reading.
    entry: Vec<usize>,
    /// Residuals of the readings.
    left: DVector<f64>,
    /// Derivatives with respect to the initial state, then directions of scatter,
    /// `readings x (nx + directions)`.
    start: DMatrix<f64>,
    /// Derivatives with respect to the columns' coefficients, `readings x m`.
    columns: DMatrix<f64>,
    /// Sum of the logarithms of the readings' standard deviations.
    log_deviation: f64,
}

impl Rows {
    fn of(problem: Problem<'_>, noise: &NoiseModel, m: usize) -> Self {
        let linear = problem.linear;
        let (nx, ns) = (problem.start.mean.len(), noise.r.len());
        let scattered = problem.scatter.len() / (linear.rows * ns).max(1);
        let (mut entry, mut left) = (Vec::new(), Vec::new());
        let (mut start, mut columns) = (Vec::new(), Vec::new());
        let mut log_deviation = 0.0;
        for k in 0..linear.rows {
            for i in 0..ns {
                let at = k * ns + i;
                let reading = linear.residual[at];
                if !reading.is_finite() {
                    continue;
                }
                let deviation = noise.r[i].sqrt();
                let own = &linear.h[at * nx..(at + 1) * nx];
                start.extend(own.iter().map(|x| x / deviation));
                let own = &problem.scatter[at * scattered..(at + 1) * scattered];
                start.extend(own.iter().map(|x| x / deviation));
                let own = &linear.reading_columns[at * m..(at + 1) * m];
                columns.extend(own.iter().map(|x| x / deviation));
                left.push(reading / deviation);
                log_deviation += deviation.ln();
                entry.push(i);
            }
        }
        let n = entry.len();
        Self {
            entry,
            left: DVector::from_vec(left),
            start: DMatrix::from_row_slice(n, nx + scattered, &start),
            columns: DMatrix::from_row_slice(n, m, &columns),
            log_deviation,
        }
    }

    /// Returns the normal equations of the initial state and the scatter: derivatives, Cholesky
    /// factor and right-hand side.
    ///
    /// Unknowns are in units of their priors' standard deviations. The diagonal is increased by a
    /// fraction `damping` of itself (Marquardt 1963).
    fn normal(
        &self,
        problem: Problem<'_>,
        damping: f64,
    ) -> (DMatrix<f64>, Option<Cholesky<f64, Dyn>>, DVector<f64>) {
        let start = problem.start;
        let n = self.start.ncols();
        let deviation: Vec<f64> = start.variance.iter().map(|v| v.sqrt()).collect();
        let mut scaled = self.start.clone();
        for (mut column, d) in scaled.column_iter_mut().zip(&deviation) {
            column *= *d;
        }
        let mut gram = scaled.transpose() * &scaled + DMatrix::identity(n, n);
        (0..n).for_each(|i| gram[(i, i)] *= 1.0 + damping);
        let mut right = scaled.transpose() * &self.left;
        for (i, (mean, deviation)) in start.mean.iter().zip(&deviation).enumerate() {
            right[i] += mean / deviation;
        }
        (scaled, gram.cholesky(), right)
    }
}

/// Smooths a segment, which changes only its initial state; no force is missing.
pub(super) fn smooth(problem: Problem<'_>, noise: &NoiseModel) -> Smoothed {
    let rows = Rows::of(problem, noise, 0);
    let start = problem.start;
    let nx = start.mean.len();
    let (scaled, factor, right) = rows.normal(problem, 0.0);
    let mut out = Smoothed {
        log_likelihood: f64::NAN,
        promised: vec![0.0; noise.r.len()],
        ..Smoothed::unmoved(problem.linear.rows, noise)
    };
    let Some(factor) = factor else {
        return out;
    };
    let change = factor.solve(&right);
    for (i, v) in start.variance.iter().enumerate() {
        out.change[i] = change[i] * v.sqrt();
    }
    let left = &rows.left - &scaled * &change;
    // The residuals of a replay contain the scatter.
    let replayed = &rows.left - scaled.columns(0, nx) * change.rows(0, nx);
    // Variance of each prediction: the squared length of `L^-1 x`.
    let lower = factor.l();
    let spread = lower.solve_lower_triangular(&scaled.transpose());
    for (k, &entry) in rows.entry.iter().enumerate() {
        let variance = spread.as_ref().map_or(0.0, |s| s.column(k).norm_squared());
        let sums = &mut out.sums.reading[entry];
        sums[0] += (left[k] * left[k] + variance) * noise.r[entry];
        sums[1] += 1.0;
        out.promised[entry] += (replayed[k] * replayed[k] + variance) * noise.r[entry];
    }
    out.log_likelihood = log_likelihood(&rows, problem, &factor, &right);
    let deviations = start.variance.iter().map(|v| v.sqrt());
    let units = DMatrix::from_diagonal(&DVector::from_iterator(nx, deviations));
    if let Some(inverse) = lower.transpose().try_inverse() {
        out.root = units * inverse.rows(0, nx);
    }
    for damping in DAMPINGS {
        if let (_, Some(factor), right) = rows.normal(problem, damping) {
            let change = factor.solve(&right);
            let deviations = start.variance.iter().map(|v| v.sqrt());
            let change = change.iter().zip(deviations).map(|(c, d)| c * d);
            out.damped.push(change.collect());
        }
    }
    out
}

fn log_likelihood(
    rows: &Rows,
    problem: Problem<'_>,
    factor: &Cholesky<f64, Dyn>,
    right: &DVector<f64>,
) -> f64 {
    let start = problem.start;
    let prior: f64 = start
        .mean
        .iter()
        .zip(&start.variance)
        .map(|(m, v)| m * m / v)
        .sum();
    let squares = rows.left.norm_squared() + prior - right.dot(&factor.solve(right));
    let determinant: f64 = factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum();
    -0.5 * squares - determinant - rows.log_deviation
}

/// Returns the regression of a segment, with its initial state projected out.
pub(super) fn regress(problem: Problem<'_>, noise: &NoiseModel, m: usize) -> Regression {
    let rows = Rows::of(problem, noise, m);
    let (scaled, factor, right) = rows.normal(problem, 0.0);
    let gram = rows.columns.transpose() * &rows.columns;
    let moment = rows.columns.transpose() * &rows.left;
    let Some(factor) = factor else {
        return Regression {
            log_likelihood: f64::NAN,
            gram,
            moment,
        };
    };
    let cross = scaled.transpose() * &rows.columns;
    let solved = factor.solve(&cross);
    Regression {
        log_likelihood: log_likelihood(&rows, problem, &factor, &right),
        gram: gram - cross.transpose() * &solved,
        moment: moment - solved.transpose() * right,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::super::{NoiseModel, Problem, Start};
    use super::*;
    use crate::latent_force::step_map::LinearEpisode;
    use crate::latent_force::walk::Walk;

    const ROWS: usize = 6;

    /// A segment of one degree of freedom: a position read with a standard deviation of 0.2, an
    /// unknown initial state, and one column.
    struct Case {
        walk: Walk,
        linear: LinearEpisode,
        start: Start,
        noise: NoiseModel,
    }

    impl Case {
        fn new() -> Self {
            let time: Vec<f64> = (0..ROWS).map(|k| 0.1 * k as f64).collect();
            let mut residual: Vec<f64> = time.iter().map(|t| 0.3 - t + 4.0 * t * t).collect();
            // The first row belongs to the lead.
            residual[0] = f64::NAN;
            Self {
                linear: LinearEpisode {
                    rows: ROWS,
                    residual,
                    h: time.iter().flat_map(|t| [1.0, *t]).collect(),
                    reading_columns: time.iter().map(|t| 0.5 * t * t).collect(),
                    ..LinearEpisode::default()
                },
                walk: Walk {
                    episode: 0,
                    rows: (0..ROWS).collect(),
                    substeps: vec![1; ROWS - 1],
                    ctrl: Vec::new(),
                    at_steps: Vec::new(),
                    segment: Some(1),
                    time,
                },
                start: Start {
                    mean: vec![0.1, -0.2],
                    variance: vec![0.5, 2.0],
                    unknown: vec![0.5, 2.0],
                },
                noise: NoiseModel {
                    q: vec![0.0],
                    tau: vec![1.0],
                    white: vec![0.0],
                    r: vec![0.04],
                },
            }
        }

        fn problem(&self) -> Problem<'_> {
            Problem {
                walk: &self.walk,
                linear: &self.linear,
                b: &[],
                start: &self.start,
                free: &[],
                scatter: &[],
            }
        }

        /// Returns the covariance of all readings that count with the initial state unknown, their
        /// residuals at its mean, and the column.
        fn dense(&self) -> (DMatrix<f64>, DVector<f64>, DVector<f64>) {
            let n = ROWS - 1;
            let h = DMatrix::from_row_slice(n, 2, &self.linear.h[2..]);
            let open = DMatrix::from_diagonal(&DVector::from_row_slice(&self.start.variance));
            let covariance = &h * open * h.transpose() + DMatrix::identity(n, n) * 0.04;
            let mean = &h * DVector::from_row_slice(&self.start.mean);
            let left = DVector::from_row_slice(&self.linear.residual[1..]) - mean;
            let column = DVector::from_row_slice(&self.linear.reading_columns[1..]);
            (covariance, left, column)
        }
    }

    #[test]
    fn the_start_is_projected_out_as_from_the_joint_normal_distribution() {
        let case = Case::new();
        let (covariance, left, column) = case.dense();
        let inverse = covariance.clone().try_inverse().unwrap();
        let found = regress(case.problem(), &case.noise, 1);
        let want = (column.transpose() * &inverse * &column)[0];
        assert!((found.gram[(0, 0)] - want).abs() < 1e-10 * want);
        let want = (column.transpose() * &inverse * &left)[0];
        assert!((found.moment[0] - want).abs() < 1e-10 * want.abs());
        let squares = (left.transpose() * &inverse * &left)[0];
        let want = -0.5 * (squares + covariance.determinant().ln());
        assert!((found.log_likelihood - want).abs() < 1e-9);
    }

    #[test]
    fn its_start_is_the_posterior_mean_and_a_damped_step_is_shorter() {
        let case = Case::new();
        let (covariance, left, _) = case.dense();
        let h = DMatrix::from_row_slice(ROWS - 1, 2, &case.linear.h[2..]);
        let open = DMatrix::from_diagonal(&DVector::from_row_slice(&case.start.variance));
        let gain = open * h.transpose() * covariance.try_inverse().unwrap();
        let want = DVector::from_row_slice(&case.start.mean) + gain * left;
        let found = smooth(case.problem(), &case.noise);
        for i in 0..2 {
            assert!((found.change[i] - want[i]).abs() < 1e-10);
        }
        let length = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
        let mut before = length(&found.change[..2]);
        for damped in &found.damped {
            assert!(length(damped) < before);
            before = length(damped);
        }
        // Squared residuals and their uncertainty count five readings.
        assert_eq!(found.sums.reading[0][1], 5.0);
    }
}
