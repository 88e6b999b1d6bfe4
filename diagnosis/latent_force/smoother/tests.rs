//! The recursions against the same normal distribution written down densely, and against answers that are known.
//!
//! Densely, all that is uncertain is one vector `z` of independent normal numbers: the start, the force at the
//! first row, what each row adds to the force, and each row's white and free forces. States, forces and
//! readings are `L z + c`, so that conditioning on the readings is one linear solve.

use nalgebra::{DMatrix, DVector};
use rand::Rng;

use super::super::evidence::evidence;
use super::*;

/// Tolerance of two ways to the same number of order one, through a few dozen operations on well-conditioned
/// matrices.
const SAME: f64 = 1e-8;

/// An episode that owns what a [`Problem`] borrows.
#[derive(Clone)]
struct Case {
    walk: Walk,
    linear: LinearEpisode,
    b: Vec<f64>,
    start: Start,
    free: Vec<f64>,
    noise: NoiseModel,
    /// Columns of the regression.
    m: usize,
}

impl Case {
    /// A random episode of `rows` unevenly spaced rows, `nv` degrees of freedom, `ns` entries a row and `m` columns. A
    /// fifth of the readings is missing, and every third row has a free force.
    fn random(nv: usize, rows: usize, ns: usize, m: usize) -> Self {
        let mut rng = asid_core::Streams::new(7).stream(&format!("{nv}"));
        let nx = 2 * nv;
        let mut draw =
            |n: usize| -> Vec<f64> { (0..n).map(|_| rng.random_range(-1.0..1.0)).collect() };
        let positive = |x: Vec<f64>| -> Vec<f64> { x.into_iter().map(|x| 0.6 + 0.5 * x).collect() };
        let mut residual = draw(rows * ns);
        residual
            .iter_mut()
            .skip(3)
            .step_by(5)
            .for_each(|y| *y = f64::NAN);
        let mut time = vec![0.0];
        for gap in positive(draw(rows - 1)) {
            time.push(time[time.len() - 1] + gap);
        }
        let mut free = positive(draw(rows * nv));
        for (k, row) in free.chunks_exact_mut(nv).enumerate() {
            if k % 3 != 1 {
                row.fill(0.0);
            }
        }
        Self {
            walk: Walk {
                episode: 0,
                rows: (0..rows).collect(),
                time,
                substeps: vec![1; rows - 1],
                ctrl: Vec::new(),
            },
            linear: LinearEpisode {
                rows,
                defect: draw((rows - 1) * nx),
                a: draw((rows - 1) * nx * nx),
                b: Vec::new(),
                residual,
                h: draw(rows * ns * nx),
                state_columns: draw((rows - 1) * nx * m),
                reading_columns: draw(rows * ns * m),
            },
            b: draw((rows - 1) * nx * nv),
            start: Start {
                mean: draw(nx),
                variance: positive(draw(nx)),
            },
            free,
            noise: NoiseModel {
                q: positive(draw(nv)),
                tau: positive(draw(nv)),
                white: positive(draw(nv)),
                r: positive(draw(ns)),
            },
            m,
        }
    }

    /// A mass on a slide, its place read in each row, about a trajectory that stays at rest at 0. One column: a
    /// force of one unit.
    fn slide(mass: f64, dt: f64, places: &[f64], noise: NoiseModel) -> Self {
        let rows = places.len();
        let row_b = [0.5 * dt * dt / mass, dt / mass];
        Self {
            walk: Walk {
                episode: 0,
                rows: (0..rows).collect(),
                time: (0..rows).map(|k| k as f64 * dt).collect(),
                substeps: vec![1; rows - 1],
                ctrl: Vec::new(),
            },
            linear: LinearEpisode {
                rows,
                defect: vec![0.0; 2 * (rows - 1)],
                a: [1.0, dt, 0.0, 1.0].repeat(rows - 1),
                b: Vec::new(),
                residual: places.to_vec(),
                h: [1.0, 0.0].repeat(rows),
                state_columns: row_b.repeat(rows - 1),
                reading_columns: vec![0.0; rows],
            },
            b: row_b.repeat(rows - 1),
            start: Start {
                mean: vec![0.0; 2],
                variance: vec![1.0; 2],
            },
            free: Vec::new(),
            noise,
            m: 1,
        }
    }

    fn problem(&self) -> Problem<'_> {
        Problem {
            walk: &self.walk,
            linear: &self.linear,
            b: &self.b,
            start: &self.start,
            free: &self.free,
        }
    }

    /// Rows `range` as an episode of their own, which begins about the trajectory.
    fn part(&self, range: std::ops::Range<usize>) -> Self {
        let (nv, ns, m) = (self.noise.q.len(), self.noise.r.len(), self.m);
        let nx = 2 * nv;
        let rows = |x: &[f64], n: usize| x[range.start * n..range.end * n].to_vec();
        let steps = |x: &[f64], n: usize| x[range.start * n..(range.end - 1) * n].to_vec();
        let mut start = self.start.clone();
        if range.start > 0 {
            start.mean.fill(0.0);
        }
        let linear = &self.linear;
        Self {
            walk: self.walk.part(range.clone()),
            linear: LinearEpisode {
                rows: range.len(),
                defect: steps(&linear.defect, nx),
                a: steps(&linear.a, nx * nx),
                b: Vec::new(),
                residual: rows(&linear.residual, ns),
                h: rows(&linear.h, ns * nx),
                state_columns: steps(&linear.state_columns, nx * m),
                reading_columns: rows(&linear.reading_columns, ns * m),
            },
            b: steps(&self.b, nx * nv),
            start,
            free: rows(&self.free, nv),
            noise: self.noise.clone(),
            m,
        }
    }
}

/// The joint distribution of all states, forces and readings of a case, and what the readings make of it.
struct Dense {
    /// Changes of the state: `L z + c`, one a row.
    states: Vec<(DMatrix<f64>, DVector<f64>)>,
    /// Forces `L z`, one a row, and white forces, one a step.
    forces: Vec<DMatrix<f64>>,
    whites: Vec<DMatrix<f64>>,
    /// Response of the readings to the columns, `readings x m`.
    columns: DMatrix<f64>,
    /// Covariance of the readings, and what they differ from their mean.
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
        // z: the start, the first force, and of each step what is added to the force, the white and the free force.
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

    /// Up to `ln 2 pi` a reading.
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

fn assert_same(got: f64, want: f64, what: &str) {
    assert!(
        (got - want).abs() < SAME * want.abs().max(1.0),
        "{what}: {got} instead of {want}"
    );
}

/// One degree of freedom with two entries a row, two with three.
fn cases() -> [Case; 2] {
    [Case::random(1, 6, 2, 3), Case::random(2, 6, 3, 4)]
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
fn the_regression_is_the_same_over_more_rows_than_are_added_up_at_once() {
    // The likelihood is quadratic in a coefficient: moving the readings by x moves it by b x - a x^2 / 2.
    let noise = NoiseModel {
        q: vec![0.5],
        tau: vec![0.3],
        white: vec![0.1],
        r: vec![0.04],
    };
    let rows = 2 * BLOCK + 37;
    let places: Vec<f64> = (0..rows).map(|k| (0.1 * k as f64).sin()).collect();
    let mut case = Case::slide(1.0, 0.1, &places, noise);
    case.linear.state_columns.fill(0.0);
    case.linear.reading_columns.fill(1.0);
    let found = regress(case.problem(), &case.noise, 1);
    let at = |x: f64| {
        let mut moved = case.clone();
        moved.linear.residual.iter_mut().for_each(|y| *y -= x);
        log_likelihood(moved.problem(), &moved.noise)
    };
    let (below, here, above) = (at(-1.0), at(0.0), at(1.0));
    assert_same(found.log_likelihood, here, "log-likelihood");
    assert_same(found.moment[0], 0.5 * (above - below), "slope");
    assert_same(found.gram[(0, 0)], 2.0 * here - above - below, "curvature");
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

#[test]
fn a_row_that_the_engine_did_not_carry_splits_the_walk_in_two() {
    for mut case in cases() {
        let (nv, rows) = (case.noise.q.len(), case.linear.rows);
        let nx = 2 * nv;
        case.linear.defect[2 * nx] = f64::NAN;
        let (first, second) = (case.part(0..3), case.part(3..rows));
        let whole = smooth(case.problem(), &case.noise);
        let parts = [&first, &second].map(|c| smooth(c.problem(), &c.noise));
        let joined = |of: fn(&Smoothed) -> &Vec<f64>| parts.iter().flat_map(of).copied();
        let arrays: [fn(&Smoothed) -> &Vec<f64>; 4] = [
            |s| &s.change,
            |s| &s.change_variance,
            |s| &s.force,
            |s| &s.force_variance,
        ];
        for array in arrays {
            assert_eq!(array(&whole).len(), joined(array).count());
            for (got, want) in array(&whole).iter().zip(joined(array)) {
                assert_same(*got, want, "smoothed");
            }
        }
        let mut sums = parts[0].sums.clone();
        sums.add(&parts[1].sums);
        let numbers = |s: &Sums| -> Vec<f64> {
            let pairs = s.force.iter().flatten().chain(s.reading.iter().flatten());
            pairs
                .chain(&s.white)
                .chain([&s.steps, &s.seconds])
                .copied()
                .collect()
        };
        for (got, want) in numbers(&whole.sums).iter().zip(numbers(&sums)) {
            assert_same(*got, want, "sums");
        }
        let mut both = regress(first.problem(), &case.noise, case.m);
        both.add(&regress(second.problem(), &case.noise, case.m));
        let found = regress(case.problem(), &case.noise, case.m);
        assert_same(found.log_likelihood, both.log_likelihood, "log-likelihood");
        assert_same(whole.log_likelihood, both.log_likelihood, "log-likelihood");
        assert_same((found.gram - both.gram).amax(), 0.0, "X'X");
        assert_same((found.moment - both.moment).amax(), 0.0, "X'y");
    }
}

#[test]
fn without_readings_nothing_is_learnt() {
    let mut case = Case::random(2, 6, 3, 1);
    case.linear.residual.fill(f64::NAN);
    let smoothed = smooth(case.problem(), &case.noise);
    assert_eq!(smoothed.log_likelihood, 0.0);
    assert!(smoothed.force.iter().all(|w| *w == 0.0));
    for row in smoothed.force_variance.chunks_exact(2) {
        // The force is stationary.
        assert_same(row[0], case.noise.q[0], "variance");
        assert_same(row[1], case.noise.q[1], "variance");
    }
    for j in 0..2 {
        let steps = smoothed.sums.steps;
        assert_same(smoothed.sums.white[j], steps * case.noise.white[j], "white");
        assert_same(smoothed.sums.force[j][0], steps * case.noise.q[j], "force");
    }
}

/// Places of a mass that a constant force pushes from rest, every `dt`.
fn pushed(force: f64, mass: f64, dt: f64, rows: usize) -> Vec<f64> {
    let place = |k: usize| 0.5 * force / mass * (k as f64 * dt).powi(2);
    (0..rows).map(place).collect()
}

#[test]
fn a_constant_force_that_the_model_lacks_is_what_is_smoothed() {
    let (force, mass, dt) = (3.0, 2.0, 0.01);
    let noise = NoiseModel {
        q: vec![100.0],
        tau: vec![1e4],
        white: vec![0.0],
        r: vec![1e-12],
    };
    let case = Case::slide(mass, dt, &pushed(force, mass, dt, 101), noise);
    let smoothed = smooth(case.problem(), &case.noise);
    for k in 0..100 {
        // A variance of 100 N^2 draws the estimate towards 0, by far less than it is uncertain by.
        let deviation = smoothed.force_variance[k].sqrt();
        assert!(deviation < 0.02, "{deviation}");
        let error = smoothed.force[k] - force;
        assert!(error.abs() < 0.01 * deviation, "row {k}: {error}");
        let speed = force / mass * dt * k as f64;
        assert!((smoothed.change[2 * k + 1] - speed).abs() < 1e-6);
    }
}

#[test]
fn the_coefficient_of_a_constant_force_is_that_force() {
    let (force, mass, dt, unit) = (3.0, 2.0, 0.01, 10.0);
    let noise = NoiseModel {
        q: vec![1e-6],
        tau: vec![0.1],
        white: vec![1e-6],
        r: vec![1e-10],
    };
    let mut case = Case::slide(mass, dt, &pushed(force, mass, dt, 101), noise);
    // A column in units of a prior's deviation of 10 N.
    case.linear
        .state_columns
        .iter_mut()
        .for_each(|x| *x *= unit);
    let found = regress(case.problem(), &case.noise, 1);
    let told = evidence(&found.gram, &found.moment, &[0], &[0.0], &[[-9.0, 9.0]]);
    // The prior takes its share of the posterior's precision.
    let share = 1.0 / (1.0 + found.gram[(0, 0)]);
    assert!(share < 1e-6, "{share}");
    let coefficient = unit * told.coefficients[0];
    assert!(
        (coefficient - force).abs() < 2.0 * share * force,
        "{coefficient}"
    );
    assert!(told.gain > 100.0, "{}", told.gain);
}

/// A mass that a correlated force pushes, with white force and noisy places; all deviations are 1 but that of readings.
fn wandering() -> Case {
    let mut rng = asid_core::Streams::new(1).stream("wandering");
    // A sum of twelve uniform numbers has variance 1.
    let mut normal = || (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>();
    let (dt, rows, tau) = (0.1, 300, 0.5_f64);
    let rho = (-dt / tau).exp();
    let (mut place, mut speed, mut force) = (0.0, 0.0, normal());
    let mut places = Vec::new();
    for _ in 0..rows {
        places.push(place + 0.01 * normal());
        let whole = force + normal();
        place += dt * speed + 0.5 * dt * dt * whole;
        speed += dt * whole;
        force = rho * force + (1.0 - rho * rho).sqrt() * normal();
    }
    let wrong = NoiseModel {
        q: vec![20.0],
        tau: vec![5.0],
        white: vec![0.02],
        r: vec![3e-3],
    };
    Case::slide(1.0, dt, &places, wrong)
}

#[test]
fn the_sums_are_the_slopes_of_the_likelihood() {
    // Fisher's identity: the slope in ln v of a variance is (sum of squares / v - their number) / 2.
    let case = wandering();
    let smoothed = smooth(case.problem(), &case.noise);
    let step = 1e-4_f64;
    let slope = |set: &dyn Fn(&mut NoiseModel, f64)| {
        let at = |factor: f64| {
            let mut noise = case.noise.clone();
            set(&mut noise, factor);
            log_likelihood(case.problem(), &noise)
        };
        (at(step.exp()) - at((-step).exp())) / (2.0 * step)
    };
    let sums = &smoothed.sums;
    let by_white = 0.5 * (sums.white[0] / case.noise.white[0] - sums.steps);
    let by_reading = 0.5 * (sums.reading[0][0] / case.noise.r[0] - sums.reading[0][1]);
    let rho = (-0.1 / case.noise.tau[0]).exp();
    let by_force = 0.5 * (scatter(&smoothed, rho) / case.noise.q[0] - sums.steps - 1.0);
    // Central differences are right to the square of the step.
    let near = |a: f64, b: f64| (a - b).abs() < 1e-5 * b.abs().max(1.0);
    let (white, reading, force) = (
        slope(&|n, f| n.white[0] *= f),
        slope(&|n, f| n.r[0] *= f),
        slope(&|n, f| n.q[0] *= f),
    );
    assert!(near(white, by_white), "{white} {by_white}");
    assert!(near(reading, by_reading), "{reading} {by_reading}");
    assert!(near(force, by_force), "{force} {by_force}");
}

/// Expected squares of the force at the first row and of what each row adds to it, each relative to its
/// share of `q`, for evenly spaced rows.
fn scatter(smoothed: &Smoothed, rho: f64) -> f64 {
    let [later, earlier, product] = smoothed.sums.force[0];
    let first = smoothed.force[0].powi(2) + smoothed.force_variance[0];
    first + (later - 2.0 * rho * product + rho * rho * earlier) / (1.0 - rho * rho)
}

#[test]
fn expectation_maximisation_raises_the_likelihood() {
    let case = wandering();
    let dt = case.walk.time[1];
    let mut noise = case.noise.clone();
    let mut before = f64::NEG_INFINITY;
    for round in 0..60 {
        let smoothed = smooth(case.problem(), &noise);
        let likelihood = smoothed.log_likelihood;
        assert!(
            likelihood > before - 1e-9 * before.abs(),
            "round {round}: {before} to {likelihood}"
        );
        before = likelihood;
        let sums = &smoothed.sums;
        let n = sums.steps;
        noise.white[0] = sums.white[0] / n;
        noise.r[0] = sums.reading[0][0] / sums.reading[0][1];
        // Best `rho` of many, the present one among them, each with its best `q`.
        let now = (-dt / noise.tau[0]).exp();
        let q = |rho: f64| scatter(&smoothed, rho) / (n + 1.0);
        let expected = |rho: f64| -0.5 * ((n + 1.0) * q(rho).ln() + n * (1.0 - rho * rho).ln());
        let all = (1..1000).map(|i| f64::from(i) / 1000.0).chain([now]);
        let rho = all
            .max_by(|a, b| expected(*a).total_cmp(&expected(*b)))
            .unwrap();
        noise.q[0] = q(rho);
        noise.tau[0] = -dt / rho.ln();
    }
    // What made the data is likelier than where the search began, and the end is likelier than what made them.
    let truth = NoiseModel {
        q: vec![1.0],
        tau: vec![0.5],
        white: vec![1.0],
        r: vec![1e-4],
    };
    let of_truth = log_likelihood(case.problem(), &truth);
    assert!(log_likelihood(case.problem(), &case.noise) < of_truth - 10.0);
    // EM is slow along what the readings hardly tell apart: white force from force.
    assert!(before > of_truth - 2.0, "{before} {of_truth}");
    // 300 readings tell their variance to some 10 %.
    assert!((noise.r[0] / 1e-4).ln().abs() < 0.5, "{noise:?}");
}

/// A motion of some seconds whose place and speed are read finely, of which the start is known to a variance of `width`.
fn finely_read(width: f64) -> Case {
    let (dt, rows) = (0.002, 300);
    let noise = NoiseModel {
        q: vec![25.0],
        tau: vec![1.0],
        white: vec![0.01],
        r: vec![1e-10; 2],
    };
    let mut case = Case::slide(1.0, dt, &vec![0.0; rows], noise);
    let reading = |k: usize| {
        let phase = 3.0 * dt * k as f64;
        // A tenth of a deviation of the noise, so that each row differs.
        let off = 1e-6 * (k as f64 * 1.7).sin();
        [phase.sin() + off, 3.0 * phase.cos() + off]
    };
    case.linear.residual = (0..rows).flat_map(reading).collect();
    case.linear.h = [1.0, 0.0, 0.0, 1.0].repeat(rows);
    case.linear.reading_columns = vec![0.0; 2 * rows];
    case.start.variance = vec![width; 2];
    case
}

#[test]
fn a_wide_start_costs_the_logarithm_of_its_width_however_fine_the_readings() {
    // As the width V grows, the likelihood tends to that of the readings after the first row: the first adds
    // -ln V / 2 - (first state)^2 / 2 V for place and speed. Readings finer than the start by 1e22 in variance used to
    // leave covariances that are not positive.
    let at = |width: f64| {
        let case = finely_read(width);
        let likelihood = log_likelihood(case.problem(), &case.noise);
        likelihood + width.ln() + 0.5 * 3.0_f64.powi(2) / width
    };
    let narrow = at(1e6);
    for width in [1e8, 1e10, 1e12] {
        // Sums of some thousands in double precision, and terms of 1 / V^2.
        assert!(
            (at(width) - narrow).abs() < 1e-6,
            "{width}: {} {narrow}",
            at(width)
        );
    }
}

#[test]
fn a_wide_start_leaves_the_sums_of_fine_readings_right() {
    // Symptom: squares of what readings leave were a thousand times too large with a start of 5 m, and their variance went to its bound.
    // Cause: the first state was corrected from before its readings, a difference of numbers 1e12 times as large.
    for width in [25.0, 36.0, 100.0, 1e4] {
        let mut case = finely_read(width);
        let speeds = case.linear.residual.iter_mut().skip(1).step_by(2);
        speeds.for_each(|y| *y = f64::NAN);
        let smoothed = smooth(case.problem(), &case.noise);
        let [squares, n] = smoothed.sums.reading[0];
        let step = 1e-3_f64;
        let at = |factor: f64| {
            let mut noise = case.noise.clone();
            noise.r[0] *= factor;
            log_likelihood(case.problem(), &noise)
        };
        let slope = (at(step.exp()) - at((-step).exp())) / (2.0 * step);
        let by_sums = 0.5 * (squares / case.noise.r[0] - n);
        // Central differences are right to the square of the step.
        assert!(
            (by_sums - slope).abs() < 1e-4 * slope.abs(),
            "{width}: {by_sums} {slope}"
        );
    }
}
