use super::*;
use asid_core::Streams;
use rand_distr::{Distribution, StandardNormal};

/// A region of unit width about a middle, in a box of 9 to both sides.
fn about(middle: &[f64]) -> Gaussian {
    let n = middle.len();
    Gaussian::diagonal(middle, &vec![1.0; n], &vec![-9.0; n], &vec![9.0; n])
}

/// Draws points from a region.
fn points(region: &Gaussian, count: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut draws = Streams::new(seed).stream("d");
    (0..count).map(|_| region.sample(&mut draws)).collect()
}

/// Fits residuals of which none is missing.
fn fit(
    region: &Gaussian,
    points: &[Vec<f64>],
    residuals: &[Vec<f64>],
    correlated: bool,
) -> Emulator {
    let points: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
    let rows: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
    Emulator::fit(region, &points, &rows, rows[0].len(), correlated).unwrap()
}

/// Fits one draw of noise from a linear simulator with 200 readings; returns the estimate and
/// its standard deviation.
///
/// Roughness has size `rough` and lasts `run` readings.
fn fitted(seed: u64, rough: f64, run: usize, correlated: bool) -> (f64, f64) {
    let mut rng = Streams::new(seed).stream("e");
    let m = 200;
    let slope = 0.5;
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut luck = |rough: f64| -> Vec<f64> {
        let blocks: Vec<f64> = (0..m / run).map(|_| rough * normal()).collect();
        (0..m).map(|k| blocks[k / run]).collect()
    };
    let real = luck(rough);
    let noise = luck(0.0);
    let region = about(&[0.2]);
    let points = points(&region, 64, seed);
    let mut sensor = Streams::new(seed).stream("n");
    let observed: Vec<f64> = (0..m)
        .map(|k| {
            let n: f64 = StandardNormal.sample(&mut sensor);
            real[k] + noise[k] + n
        })
        .collect();
    let residuals: Vec<Vec<f64>> = points
        .iter()
        .map(|x| {
            let l = luck(rough);
            (0..m).map(|k| slope * x[0] + l[k] - observed[k]).collect()
        })
        .collect();
    let emulator = fit(&region, &points, &residuals, correlated);
    let mut walk = Streams::new(seed).stream("w");
    let samples = emulator.sample(1000, &mut walk);
    let mean = samples.iter().map(|s| s[0]).sum::<f64>() / 1000.0;
    let var = samples.iter().map(|s| (s[0] - mean).powi(2)).sum::<f64>() / 1000.0;
    (mean, var.sqrt())
}

#[test]
fn without_roughness_it_is_linear_regression() {
    // Truth 0, 200 readings of slope 0.5 and noise 1: standard deviation 1 / (0.5 sqrt 200) =
    // 0.141.
    for correlated in [false, true] {
        let (mean, std) = fitted(1, 0.0, 1, correlated);
        assert!(mean.abs() < 4.0 * 0.141, "{mean}");
        assert!((std / 0.141 - 1.0).abs() < 0.15, "{std}");
    }
}

#[test]
fn intervals_hold_under_correlated_roughness() {
    // Roughness of one noise standard deviation that lasts 20 readings: ten independent pieces and
    // 200 readings of noise, so the estimate has a standard deviation of
    // 2 sqrt(1 / 10 + 1 / 200) = 0.65. Independent readings of the same spread would give 0.20. The
    // region reaches three to either side.
    for correlated in [false, true] {
        let runs: Vec<(f64, f64)> = (0..60).map(|s| fitted(s, 1.0, 20, correlated)).collect();
        let covered = runs.iter().filter(|(m, s)| m.abs() < 1.96 * s).count();
        // A binomial of 60 at 0.95 is at least 51 with probability 0.998.
        assert!(covered >= 50, "{correlated}: {covered} of 60");
        let stated = runs.iter().map(|r| r.1).sum::<f64>() / 60.0;
        assert!((stated / 0.65 - 1.0).abs() < 0.25, "{correlated}: {stated}");
    }
}

#[test]
fn what_takes_no_part_in_the_luck_keeps_its_weight_if_the_correlation_is_known() {
    // Roughness moves even readings up and odd ones down together; the unknown moves all up.
    // The two are orthogonal, so 200 readings of slope 0.5 determine the unknown to 0.141.
    // Without the correlation each reading has a standard deviation of sqrt(1 + 9), which gives
    // 0.447.
    let (m, slope, rough) = (200, 0.5, 3.0);
    let region = about(&[0.2]);
    let mut rng = Streams::new(3).stream("e");
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let side = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
    let real = rough * normal();
    let observed: Vec<f64> = (0..m).map(|k| real * side(k) + normal()).collect();
    let points = points(&region, 64, 3);
    let residuals: Vec<Vec<f64>> = points
        .iter()
        .map(|x| {
            let luck = rough * normal();
            let reading = |k: usize| slope * x[0] + luck * side(k) - observed[k];
            (0..m).map(reading).collect()
        })
        .collect();
    let [alone, together] = [false, true].map(|correlated| {
        let emulator = fit(&region, &points, &residuals, correlated);
        let mut walk = Streams::new(3).stream("w");
        let samples = emulator.sample(2000, &mut walk);
        let mean = samples.iter().map(|s| s[0]).sum::<f64>() / 2000.0;
        assert!(mean.abs() < 4.0 * 0.141, "{mean}");
        let variance = samples.iter().map(|s| (s[0] - mean).powi(2)).sum::<f64>() / 2000.0;
        variance.sqrt()
    });
    assert!(alone > 0.4, "{alone}");
    // A fifth of the roughness is treated as independent: sqrt(1 + 0.2 * 9) * 0.141.
    assert!(together < 0.27, "{together}");
}

#[test]
fn each_unknown_is_as_wide_as_its_own_readings_scatter() {
    // `a` moves readings 1 to 100, which are smooth, and `b` readings 101 to 200, which a shift
    // of 0.6 moves together. Slopes are 0.5: `a` has a standard deviation of 1 / (0.5 sqrt 100)
    // = 0.2 and `b` of sqrt(0.2^2 + (0.6 / 0.5)^2) = 1.2.
    let (m, slope, rough) = (200, 0.5, 0.6);
    let region = about(&[0.0; 2]);
    let mut rng = Streams::new(4).stream("e");
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let observed: Vec<f64> = (0..m).map(|_| normal()).collect();
    let points = points(&region, 64, 4);
    let residuals: Vec<Vec<f64>> = points
        .iter()
        .map(|x| {
            let luck = rough * normal();
            let simulated = |k: usize| {
                if k < m / 2 {
                    slope * x[0]
                } else {
                    slope * x[1] + luck
                }
            };
            (0..m).map(|k| simulated(k) - observed[k]).collect()
        })
        .collect();
    let emulator = fit(&region, &points, &residuals, false);
    let mut walk = Streams::new(4).stream("w");
    let samples = emulator.sample(2000, &mut walk);
    let std = |i: usize| {
        let mean = samples.iter().map(|s| s[i]).sum::<f64>() / 2000.0;
        (samples.iter().map(|s| (s[i] - mean).powi(2)).sum::<f64>() / 2000.0).sqrt()
    };
    assert!((std(0) / 0.2 - 1.0).abs() < 0.3, "{}", std(0));
    // Slopes and roughness come from 64 points.
    assert!((std(1) / 1.2 - 1.0).abs() < 0.35, "{}", std(1));
}

/// The readings show two unknowns only through their product, smoothly, and a third one with a
/// shift that moves all its readings.
///
/// Along the valley of the product nothing is known, so the loss is constant there. A normal density
/// about the minimum would rise away from the valley's tangent.
#[test]
fn a_curved_valley_stays_open_beside_an_unknown_that_scatters() {
    let (m, slope, rough) = (200, 0.5, 3.0);
    let region = about(&[0.0; 3]);
    let mut rng = Streams::new(5).stream("e");
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let points = points(&region, 96, 5);
    let product = |x: &[f64]| (2.0 + x[0]) * (2.0 + x[1]) - 4.0;
    let residuals: Vec<Vec<f64>> = points
        .iter()
        .map(|x| {
            let luck = rough * normal();
            let half = |k: usize| k < m / 2;
            let simulated = |k| if half(k) { product(x) } else { x[2] + luck };
            (0..m).map(|k| slope * simulated(k)).collect()
        })
        .collect();
    let emulator = fit(&region, &points, &residuals, false);
    // Of the product, 100 readings of slope 0.5 tell 0.2.
    let off = |x: [f64; 3]| emulator.loss(&x) - emulator.loss(&[0.0; 3]);
    let across = off([0.1, 0.1, 0.0]);
    let wanted = 0.5 * (0.41_f64 / 0.2).powi(2);
    assert!((across / wanted - 1.0).abs() < 0.1, "{across} {wanted}");
    // Both points have the product of the middle.
    for x in [-1.0, 1.5] {
        let along = off([x, 4.0 / (2.0 + x) - 2.0, 0.0]);
        assert!(along.abs() < 0.2, "{x}: {along}");
    }
}

/// A linear simulator of two unknowns: `a` moves smooth readings and has its minimum 5 standard
/// deviations of the region from its middle; `b` moves readings that a shift moves together. The loss
/// within reach is that of the sandwich about this minimum.
#[test]
fn a_minimum_beyond_reach_leaves_the_slope_of_the_sandwich() {
    let (m, slope, rough, minimum): (usize, f64, f64, f64) = (100, 0.5, 0.6, 5.0);
    let region = about(&[0.0; 2]);
    // Every point twice, with a shift of the readings of `b` up and down: the regression is exact.
    let points: Vec<Vec<f64>> = (0..64)
        .map(|i| i / 2)
        .map(|i| vec![0.4 * f64::from(i % 8) - 1.4, 0.8 * f64::from(i / 8) - 1.2])
        .collect();
    let residuals: Vec<Vec<f64>> = points
        .iter()
        .zip([rough, -rough].into_iter().cycle())
        .map(|(x, luck)| {
            let of_a = vec![slope * (x[0] - minimum); m];
            [of_a, vec![slope * x[1] + luck; m]].concat()
        })
        .collect();
    let emulator = fit(&region, &points, &residuals, false);
    let best = emulator.best();
    assert!(
        (best[0] - REACH).abs() < 1e-4 && best[1].abs() < 1e-4,
        "{best:?}"
    );
    // Of the noise, and of the shift: 64 points less 6 features tell its variance.
    let shift = rough.powi(2) * 64.0 / 58.0;
    let variance = [0.0, shift].map(|shift| (1.0 / m as f64 + shift) / slope.powi(2));
    let wanted = |x: [f64; 2]| {
        0.5 * (x[0] - minimum).powi(2) / variance[0] + 0.5 * x[1].powi(2) / variance[1]
    };
    // At the best point the emulator explains less than noise and roughness leave.
    let mismatch =
        (m as f64 * (slope * (REACH - minimum)).powi(2) / (2.0 * m as f64 - 2.0)).max(1.0);
    for x in [[-2.0, 0.0], [0.0, 1.0], [2.0, -1.0]] {
        let rise = emulator.loss(&x) - emulator.loss(&[REACH, 0.0]);
        let right = (wanted(x) - wanted([REACH, 0.0])) / mismatch;
        assert!((rise / right - 1.0).abs() < 1e-3, "{x:?}: {rise} {right}");
    }
}

/// Symptom: a posterior of equal draws, with a standard deviation of zero. Cause: the best point was
/// clamped to the prior's box entry by entry, which moved it out of reach along a correlated
/// standardised entry, and there the walkers could not move.
#[test]
fn a_minimum_outside_of_the_box_leaves_walkers_that_move() {
    // The region is a valley `b = 9.5 (a - 1.6)`, of correlation 0.95, whose first entry ends at 1.73.
    let covariance = DMatrix::from_row_slice(2, 2, &[0.01, 0.095, 0.095, 1.0]);
    let mean = DVector::from_vec(vec![1.6, 0.0]);
    let region = Gaussian::new(mean, covariance, &[-1.73, -6.0], &[1.73, 6.0]).unwrap();
    let points = points(&region, 96, 7);
    // 100 readings see how far `a` is from 2.2, and 100 where the point is across the valley.
    let residuals: Vec<Vec<f64>> = points
        .iter()
        .map(|x| {
            let across = x[1] - 9.5 * (x[0] - 1.6);
            [vec![4.0 * (x[0] - 2.2); 100], vec![across; 100]].concat()
        })
        .collect();
    let emulator = fit(&region, &points, &residuals, false);
    let best = emulator.best();
    // At the end of the range, on the valley's floor: 9.5 * 0.13.
    assert!((best[0] - 1.73).abs() < 1e-6, "{best:?}");
    assert!((best[1] - 1.235).abs() < 1e-3, "{best:?}");
    let drawn = emulator.sample(1000, &mut Streams::new(7).stream("w"));
    assert!(drawn.iter().all(|x| x[0] <= 1.73 && x[1].abs() <= 6.0));
    // The loss rises by 1600 * 0.47 a unit of `a`, divided by the mismatch of
    // 100 (4 * 0.47)^2 / 198 = 1.79: an exponential density of width 0.0024. Across the valley 100
    // readings tell 0.1 sqrt(1.79) = 0.13.
    let [a, b] = [0, 1].map(|entry| super::super::walk::deviation(&drawn, entry));
    assert!((a / 0.0024 - 1.0).abs() < 0.2, "{a}");
    assert!((b / 0.13 - 1.0).abs() < 0.2, "{b}");
}

/// Symptom: a task whose unknowns are all binary and whose start is fixed ended in a panic. Cause:
/// matrices without entries have no largest eigenvalue, and no column to be made of.
#[test]
fn a_space_without_entries_has_one_point_and_its_roughness() {
    let region = about(&[]);
    let points = vec![Vec::new(); 40];
    // Two models of the ensemble, one above and one below the reading of 1 by 2.
    let residuals: Vec<Vec<f64>> = (0..40)
        .map(|i| vec![if i % 2 == 0 { 3.0 } else { -1.0 }; 10])
        .collect();
    for correlated in [false, true] {
        let emulator = fit(&region, &points, &residuals, correlated);
        assert!(emulator.best().is_empty());
        assert!((emulator.residual - 1.0).abs() < 1e-4);
        // 40 simulations less one feature.
        let wanted = 2.0 * (40.0_f64 / 39.0).sqrt();
        assert!((emulator.roughness - wanted).abs() < 1e-4);
        let drawn = emulator.sample(5, &mut Streams::new(0).stream("w"));
        assert_eq!(drawn, vec![Vec::<f64>::new(); 5]);
        let evidence = emulator.evidence(10, 0.0);
        // The mean of 40 simulations.
        assert!((evidence.scatter - 1.0 / 40.0).abs() < 1e-4);
    }
}

#[test]
fn slopes_are_derivatives_of_features() {
    let u = [0.3, -0.7, 1.1];
    let h = 1e-6;
    for k in 0..3 {
        let (mut up, mut down) = (u, u);
        up[k] += h;
        down[k] -= h;
        for ((a, b), s) in features(&up)
            .iter()
            .zip(features(&down))
            .zip(feature_slope(&u, k))
        {
            assert!(((a - b) / (2.0 * h) - s).abs() < 1e-8);
        }
    }
}
