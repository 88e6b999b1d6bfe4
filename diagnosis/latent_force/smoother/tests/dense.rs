//! The recursions compared with the same normal distribution, written as dense matrices.
//!
//! All unknowns form one vector `z` of independent normal numbers: the initial state, the force at
//! the first row, the increment of the force in each row, and each row's white and free forces.
//! States, forces and readings are `L z + c`, so conditioning on the readings is one linear solve.

use super::*;

/// The joint distribution of all states, forces and readings of a case, with its posterior.
struct Dense {
    /// Changes of the state: `L z + c`, one per row.
    states: Vec<(DMatrix<f64>, DVector<f64>)>,
    /// Forces `L z`, one per row, and white forces, one per step.
    forces: Vec<DMatrix<f64>>,
    whites: Vec<DMatrix<f64>>,
    /// Response of the readings to the columns, `readings x m`.
    columns: DMatrix<f64>,
    /// Covariance of the readings, and their difference from their mean.
    covariance: DMatrix<f64>,
    surprise: DVector<f64>,
    /// Mean and covariance of `z` given the readings.
    mean: DVector<f64>,
    posterior: DMatrix<f64>,
}

impl Dense {
    fn new(case: &Case) -> Self {
        let (linear, noise, m) = (&case.linear, &case.noise, case.m);
        let (nv, ns, rows) = (noise.q.len(), noise.r.len(), linear.rows);
        let nx = 2 * nv;
        // z: the initial state, the first force, and for each step the increment of the force, the
        // white force and the free force.
        let size = nx + nv + 3 * nv * (rows - 1);
        let mut prior = vec![0.0; size];
        prior[..nx].copy_from_slice(&case.start.variance);
        prior[nx..nx + nv].copy_from_slice(&noise.q);
        let mut mean = DVector::zeros(size);
        mean.rows_mut(0, nx).copy_from_slice(&case.start.mean);
        let pick = |first: usize, n: usize| {
            DMatrix::from_fn(n, size, |i, j| f64::from(u8::from(j == first + i)))
        };
        let matrix = |x: &[f64], k: usize, p: usize, n: usize| {
            DMatrix::from_row_slice(p, n, &x[k * p * n..(k + 1) * p * n])
        };
        let mut states = vec![(pick(0, nx), DVector::zeros(nx))];
        let mut forces = vec![pick(nx, nv)];
        let mut whites = Vec::new();
        let mut responses = vec![DMatrix::zeros(nx, m)];
        for k in 0..rows - 1 {
            let dt = case.walk.time[k + 1] - case.walk.time[k];
            let at = nx + nv + 3 * nv * k;
            let rho = DVector::from_fn(nv, |j, _| (-dt / noise.tau[j]).exp());
            for j in 0..nv {
                prior[at + j] = noise.q[j] * (1.0 - rho[j] * rho[j]);
                prior[at + nv + j] = noise.white[j];
                prior[at + 2 * nv + j] = case.free.get(k * nv + j).copied().unwrap_or(0.0);
            }
            let (a, b) = (matrix(&linear.a, k, nx, nx), matrix(&case.b, k, nx, nv));
            let white = pick(at + nv, nv);
            let force = &forces[k] + &white + pick(at + 2 * nv, nv);
            let (state, offset) = &states[k];
            let defect = DVector::from_row_slice(&linear.defect[k * nx..(k + 1) * nx]);
            let next = (&a * state + &b * force, &a * offset + defect);
            states.push(next);
            responses.push(&a * &responses[k] + matrix(&linear.state_columns, k, nx, m));
            forces.push(DMatrix::from_diagonal(&rho) * &forces[k] + pick(at, nv));
            whites.push(white);
        }
        let prior = DMatrix::from_diagonal(&DVector::from_vec(prior));
        let present: Vec<(usize, usize)> = (0..rows)
            .flat_map(|k| (0..ns).map(move |s| (k, s)))
            .filter(|(k, s)| linear.residual[k * ns + s].is_finite())
            .collect();
        let n = present.len();
        let mut readings = DMatrix::zeros(n, size);
        let mut columns = DMatrix::zeros(n, m);
        let mut surprise = DVector::zeros(n);
        let mut reading_noise = DVector::zeros(n);
        for (i, &(k, s)) in present.iter().enumerate() {
            let h = DMatrix::from_row_slice(1, nx, &linear.h[(k * ns + s) * nx..][..nx]);
            let (state, offset) = &states[k];
            readings.set_row(i, &(&h * state).row(0));
            let own =
                DMatrix::from_row_slice(1, m, &linear.reading_columns[(k * ns + s) * m..][..m]);
            columns.set_row(i, &(&h * &responses[k] + own).row(0));
            surprise[i] = linear.residual[k * ns + s] - (&h * offset)[0];
            reading_noise[i] = noise.r[s];
        }
        surprise -= &readings * &mean;
        let covariance =
            &readings * &prior * readings.transpose() + DMatrix::from_diagonal(&reading_noise);
        let inverse = covariance.clone().try_inverse().unwrap();
        let gain = &prior * readings.transpose() * inverse;
        Self {
            mean: mean + &gain * &surprise,
            posterior: &prior - &gain * &readings * &prior,
            states,
            forces,
            whites,
            columns,
            covariance,
            surprise,
        }
    }

    /// Log-likelihood, up to a constant of `ln 2 pi` per reading.
    fn log_likelihood(&self) -> f64 {
        let factor = self.covariance.clone().cholesky().unwrap();
        let log_determinant: f64 = factor.l().diagonal().iter().map(|x| 2.0 * x.ln()).sum();
        -0.5 * (self.surprise.dot(&factor.solve(&self.surprise)) + log_determinant)
    }

    /// Posterior mean and variance of entry `i` of `L z + c`.
    fn entry(&self, map: &DMatrix<f64>, i: usize, offset: f64) -> (f64, f64) {
        let row = map.row(i);
        (
            (row * &self.mean)[0] + offset,
            (row * &self.posterior * row.transpose())[0],
        )
    }

    /// Posterior expectation of the product of entries `i` of two maps.
    fn product(&self, a: &DMatrix<f64>, b: &DMatrix<f64>, i: usize) -> f64 {
        let (a, b) = (a.row(i), b.row(i));
        (a * &self.mean)[0] * (b * &self.mean)[0] + (a * &self.posterior * b.transpose())[0]
    }
}

#[test]
fn smoothing_is_conditioning_of_the_joint_normal_distribution() {
    for case in cases() {
        let nv = case.noise.q.len();
        let nx = 2 * nv;
        let (dense, smoothed) = (Dense::new(&case), smooth(case.problem(), &case.noise));
        for k in 0..case.linear.rows {
            let (map, offset) = &dense.states[k];
            for i in 0..nx {
                let (mean, variance) = dense.entry(map, i, offset[i]);
                assert_same(smoothed.change[k * nx + i], mean, "change");
                assert_same(
                    smoothed.change_variance[k * nx + i],
                    variance,
                    "its variance",
                );
            }
            for j in 0..nv {
                let (mean, variance) = dense.entry(&dense.forces[k], j, 0.0);
                assert_same(smoothed.force[k * nv + j], mean, "force");
                assert_same(
                    smoothed.force_variance[k * nv + j],
                    variance,
                    "its variance",
                );
            }
        }
        assert_same(
            smoothed.log_likelihood,
            dense.log_likelihood(),
            "log-likelihood",
        );
        let alone = log_likelihood(case.problem(), &case.noise);
        assert_same(alone, dense.log_likelihood(), "log-likelihood alone");
    }
}

#[test]
fn the_regression_is_generalised_least_squares() {
    for case in cases() {
        let dense = Dense::new(&case);
        let found = regress(case.problem(), &case.noise, case.m);
        let factor = dense.covariance.clone().cholesky().unwrap();
        let gram = dense.columns.transpose() * factor.solve(&dense.columns);
        let moment = dense.columns.transpose() * factor.solve(&dense.surprise);
        for i in 0..case.m {
            for j in 0..case.m {
                assert_same(found.gram[(i, j)], gram[(i, j)], "X' S^-1 X");
            }
            assert_same(found.moment[i], moment[i], "X' S^-1 y");
        }
        assert_same(
            found.log_likelihood,
            dense.log_likelihood(),
            "log-likelihood",
        );
    }
}

#[test]
fn a_regression_on_some_columns_has_the_products_of_these() {
    for case in cases() {
        let all = regress(case.problem(), &case.noise, case.m);
        let some: Vec<usize> = (0..case.m).skip(1).collect();
        let found = regress_on(case.problem(), &case.noise, (case.m, &some));
        for (i, &p) in some.iter().enumerate() {
            for (j, &q) in some.iter().enumerate() {
                assert_same(found.gram[(i, j)], all.gram[(p, q)], "X' S^-1 X");
            }
            assert_same(found.moment[i], all.moment[p], "X' S^-1 y");
        }
        assert_eq!(found.moment.len(), some.len());
        assert_same(found.log_likelihood, all.log_likelihood, "log-likelihood");
    }
}

#[test]
fn the_sums_are_posterior_expectations() {
    for case in cases() {
        let (nv, ns) = (case.noise.q.len(), case.noise.r.len());
        let nx = 2 * nv;
        let (dense, sums) = (Dense::new(&case), smooth(case.problem(), &case.noise).sums);
        let steps = case.linear.rows - 1;
        assert_eq!(sums.steps, steps as f64);
        assert_same(sums.seconds, case.walk.time[steps], "seconds");
        let force =
            |k: usize, l: usize, j: usize| dense.product(&dense.forces[k], &dense.forces[l], j);
        for j in 0..nv {
            let sum = |term: &dyn Fn(usize) -> f64| (0..steps).map(term).sum::<f64>();
            assert_same(
                sums.force[j][0],
                sum(&|k| force(k + 1, k + 1, j)),
                "later squares",
            );
            assert_same(
                sums.force[j][1],
                sum(&|k| force(k, k, j)),
                "earlier squares",
            );
            assert_same(sums.force[j][2], sum(&|k| force(k + 1, k, j)), "products");
            let white = |k: usize| dense.product(&dense.whites[k], &dense.whites[k], j);
            assert_same(sums.white[j], sum(&white), "white squares");
        }
        for s in 0..ns {
            let (mut squares, mut count) = (0.0, 0.0);
            for k in 0..case.linear.rows {
                let reading = case.linear.residual[k * ns + s];
                if reading.is_finite() {
                    let h =
                        DMatrix::from_row_slice(1, nx, &case.linear.h[(k * ns + s) * nx..][..nx]);
                    let (map, offset) = &dense.states[k];
                    let (mean, variance) = dense.entry(&(&h * map), 0, (&h * offset)[0]);
                    squares += (reading - mean).powi(2) + variance;
                    count += 1.0;
                }
            }
            assert_same(sums.reading[s][0], squares, "what readings leave");
            assert_eq!(sums.reading[s][1], count);
        }
    }
}
