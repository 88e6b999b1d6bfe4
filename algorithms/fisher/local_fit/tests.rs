use super::*;
use asid_core::rng::Streams;

const FREE: [f64; 2] = [9.0; 2];

/// Fit at `middle` of the residuals `f` plus roughness of size `rough` that lasts `run` readings.
fn fitted(
    middle: [f64; 2],
    factor: &DMatrix<f64>,
    rough: f64,
    run: usize,
    seed: u64,
    f: impl Fn(&[f64]) -> Vec<f64>,
) -> LocalFit {
    let mut rng = Streams::new(seed).stream("design");
    let points = design(
        &middle,
        factor,
        (&FREE.map(|x| -x), &FREE),
        sets(2),
        &mut rng,
    );
    let mut luck = Streams::new(seed).stream("luck");
    let mut rough_row = |x: &[f64]| {
        let mut row = f(x);
        let mut now = 0.0;
        for (k, r) in row.iter_mut().enumerate() {
            if k % run == 0 {
                let z: f64 = StandardNormal.sample(&mut luck);
                now = rough * z;
            }
            *r += now;
        }
        row
    };
    let middle_row = rough_row(&middle);
    let rows: Vec<Option<Vec<f64>>> = points.iter().map(|p| Some(rough_row(p))).collect();
    LocalFit::new(&middle, &middle_row, factor, &points, &rows).unwrap()
}

fn tilted() -> DMatrix<f64> {
    DMatrix::from_row_slice(2, 2, &[0.3, 0.0, 0.1, 0.02])
}

#[test]
fn a_quadratic_is_fitted_exactly() {
    let f = |x: &[f64]| vec![2.0 * x[0] - x[1] + x[0] * x[1], x[1] * x[1], x[0]];
    let fit = fitted([0.5, 1.0], &tilted(), 0.0, 1, 0, f);
    // Slopes at (0.5, 1): (2 + 1, 0, 1) and (-1 + 0.5, 2, 0).
    let wanted = DMatrix::from_row_slice(2, 3, &[3.0, 0.0, 1.0, -0.5, 2.0, 0.0]);
    assert!((fit.slopes() - &wanted).norm() < 1e-9);
    assert!(fit.roughness().size(3) < 1e-6);
    for correlated in [false, true] {
        let told = fit.told(correlated).unwrap();
        let error = told.information - &wanted * wanted.transpose();
        assert!(error.norm() < 1e-6, "{error}");
        let emulated = fit.emulated(correlated).unwrap();
        assert!((emulated - &wanted * wanted.transpose()).norm() < 1e-6);
    }
}

/// Mean information about the first entry over many fits.
fn mean_information(rough: f64, run: usize, slope: f64, correlated: bool) -> f64 {
    let f = |x: &[f64]| {
        (0..240)
            .map(|k| if k % 2 == 0 { slope * x[0] } else { x[1] })
            .collect()
    };
    let runs = 40;
    let factor = DMatrix::from_diagonal_element(2, 2, 1.0);
    (0..runs)
        .map(|seed| {
            let fit = fitted([0.0; 2], &factor, rough, run, seed, f);
            fit.told(correlated).unwrap().information[(0, 0)]
        })
        .sum::<f64>()
        / f64::from(runs as u32)
}

#[test]
fn roughness_takes_its_share_of_the_information() {
    // 120 readings of slope 1, noise 1 and independent roughness 2: 120 / 5 = 24.
    let found = mean_information(2.0, 1, 1.0, false);
    assert!((found / 24.0 - 1.0).abs() < 0.2, "{found}");
    // Roughness that lasts 40 readings leaves six independent pieces, of which every other reading
    // counts: about 240 / 40 / 4 / (1 + 1 / (20 * 4)) = 1.5 where the slope has a part in the
    // roughness.
    let found = mean_information(2.0, 40, 1.0, false);
    assert!((0.75..3.0).contains(&found), "{found}");
}

#[test]
fn luck_in_the_slopes_is_no_information() {
    // Nothing depends on the first entry. Its slopes are scatter alone, of variance 2 * 9 / 24 at
    // each of 240 readings (sum of the squared steps: 24), and would count as 240 * 0.75 / 10 = 18.
    // After the correction the positive half of their variation remains.
    let found = mean_information(3.0, 1, 0.0, false);
    assert!(found < 3.0, "{found}");
}

#[test]
fn a_design_keeps_to_the_box_and_to_its_middle() {
    let mut rng = Streams::new(0).stream("design");
    let points = design(
        &[0.9, 0.0],
        &tilted(),
        (&[-1.0, -0.1], &[1.0, 0.1]),
        4,
        &mut rng,
    );
    assert_eq!(points.len(), 16);
    assert!(points.iter().all(|p| p[0] <= 1.0 && p[1].abs() <= 0.1));
}
