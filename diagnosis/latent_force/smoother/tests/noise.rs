//! The sums for the noise model: gradients of the likelihood, and steps of EM.

use super::*;

/// A mass under a correlated force, with a white force and noisy positions; all standard deviations
/// are 1 except that of the readings.
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
    // Fisher's identity: the derivative with respect to ln v of a variance v is
    // `(sum of squares / v - n) / 2` for n squares.
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

/// Expected squares of the force at the first row and of its increment in each row, each relative
/// to its share of `q`, for evenly spaced rows.
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
        // The best `rho` of a grid that includes the present one, each with its best `q`.
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
    // The true model is likelier than the one where the search began, and the end is likelier than
    // the true one.
    let truth = NoiseModel {
        q: vec![1.0],
        tau: vec![0.5],
        white: vec![1.0],
        r: vec![1e-4],
    };
    let of_truth = log_likelihood(case.problem(), &truth);
    assert!(log_likelihood(case.problem(), &case.noise) < of_truth - 10.0);
    // EM converges slowly where the readings hardly separate two variances: the white force's from
    // the correlated one's.
    assert!(before > of_truth - 2.0, "{before} {of_truth}");
    // 300 readings determine their variance to some 10 %.
    assert!((noise.r[0] / 1e-4).ln().abs() < 0.5, "{noise:?}");
}
