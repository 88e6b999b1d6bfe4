//! Answers that are known without a dense distribution.

use super::super::super::evidence::evidence;
use super::*;

/// Positions of a mass that a constant force pushes from rest, every `dt`.
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
        // A variance of 100 N^2 pulls the estimate towards 0, by far less than its uncertainty.
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
    // A column in units of a prior standard deviation of 10 N.
    case.linear
        .state_columns
        .iter_mut()
        .for_each(|x| *x *= unit);
    let found = regress(case.problem(), &case.noise, 1);
    let told = evidence(&found.gram, &found.moment, &[0], &[0.0], &[[-9.0, 9.0]]);
    // The prior contributes its share of the posterior's precision.
    let share = 1.0 / (1.0 + found.gram[(0, 0)]);
    assert!(share < 1e-6, "{share}");
    let coefficient = unit * told.coefficients[0];
    assert!(
        (coefficient - force).abs() < 2.0 * share * force,
        "{coefficient}"
    );
    assert!(told.gain > 100.0, "{}", told.gain);
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

#[test]
fn the_regression_is_the_same_over_more_rows_than_are_added_up_at_once() {
    // The log-likelihood is quadratic in a coefficient: moving the readings by x changes it by
    // `b x - a x^2 / 2`.
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

/// Symptom: behind a row that an engine could not step, the states stayed on the trajectory,
/// whatever was read, where the log gives its initial state.
///
/// Cause: the filter restarted there with the variance of that initial state, a millionth of an
/// unknown one.
#[test]
fn behind_a_row_that_failed_a_given_start_says_nothing() {
    let noise = NoiseModel {
        q: vec![1e-6],
        tau: vec![0.1],
        white: vec![1e-6],
        r: vec![1e-6],
    };
    // A body at rest at 0, and behind the row at rest at 5 m.
    let place = |k: usize| if k < 10 { 0.0 } else { 5.0 };
    let places: Vec<f64> = (0..20).map(place).collect();
    let mut case = Case::slide(1.0, 0.01, &places, noise);
    case.start.variance = vec![1e-12; 2];
    case.start.unknown = vec![100.0; 2];
    case.linear.defect[2 * 9] = f64::NAN;
    let found = smooth(case.problem(), &case.noise);
    for (k, state) in found.change.chunks_exact(2).enumerate() {
        // The prior draws the place by the ratio of the variances, 1e-8 of it.
        assert!((state[0] - place(k)).abs() < 1e-6, "row {k}: {state:?}");
        assert!(state[1].abs() < 1e-4, "row {k}: {state:?}");
    }
    // In the first row the initial state is still known.
    assert!(found.change_variance[0] <= 1e-12);
    assert!(found.change_variance[2 * 10] > 1e-8);
}

#[test]
fn a_column_that_is_zero_all_along_leaves_the_others_as_they_are() {
    let (force, mass, dt) = (3.0, 2.0, 0.01);
    let noise = NoiseModel {
        q: vec![1.0],
        tau: vec![0.1],
        white: vec![0.1],
        r: vec![1e-6],
    };
    let mut case = Case::slide(mass, dt, &pushed(force, mass, dt, 101), noise);
    let alone = regress(case.problem(), &case.noise, 1);
    let beside = |columns: &[f64]| columns.iter().flat_map(|x| [0.0, *x, 0.0]).collect();
    case.linear.state_columns = beside(&case.linear.state_columns);
    case.linear.reading_columns = beside(&case.linear.reading_columns);
    let found = regress(case.problem(), &case.noise, 3);
    assert_eq!(found.gram[(1, 1)], alone.gram[(0, 0)]);
    assert_eq!(found.moment[1], alone.moment[0]);
    assert_eq!(found.log_likelihood, alone.log_likelihood);
    assert_eq!(found.gram.sum(), alone.gram.sum());
    assert_eq!(found.moment.sum(), alone.moment.sum());
}
