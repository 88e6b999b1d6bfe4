//! Wide priors of the initial state and precise readings in double precision.

use super::*;

/// A motion whose position and speed are read precisely, with a variance of `width` for the initial
/// state.
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
        // A tenth of a standard deviation of the noise, so that each row differs.
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
    // As the width V grows, the likelihood tends to that of the readings after the first row. The
    // first row adds -ln V / 2 - (first state)^2 / 2 V for position and speed. The readings are
    // more precise than the initial state by 1e22 in variance, where rounding can make a covariance
    // indefinite.
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
    // The smoothed first state has to follow from the filtered state after its readings. From the
    // state before them it is a difference of numbers 1e12 times as large. With an initial state
    // within 5 m, squared residuals are then a thousand times too large, and their variance runs
    // into its bound.
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
