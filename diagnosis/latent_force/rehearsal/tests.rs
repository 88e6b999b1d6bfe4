//! Rehearsals of screenings with a known answer.

use super::super::columns::Form;
use super::super::fit::SCALES;
use super::super::smoother::Regression;
use super::*;

/// One form a column.
fn columns(n: usize) -> Columns {
    let form = |candidate| Form {
        candidate,
        begin: vec![0.0],
        slopes: vec![Some((0, 1.0))],
        first: candidate,
    };
    Columns {
        linear: Vec::new(),
        base: 0,
        forms: (0..n).map(form).collect(),
        center: vec![0.0; n],
        bounds: vec![[-1e9, 1e9]; n],
        complete: true,
    }
}

/// A regression at the one scale at which columns have some information.
fn regression(gram: DMatrix<f64>) -> Scales {
    let sum = Regression {
        log_likelihood: 0.0,
        moment: DVector::zeros(gram.nrows()),
        gram,
    };
    Scales::known(vec![sum], Vec::new())
}

fn limit(candidate: usize, coefficient: f64) -> Limit {
    Limit {
        candidate,
        parameter: 0,
        value: 1.0,
        column: candidate,
        coefficient,
    }
}

#[test]
fn what_chance_reaches_is_as_probable_as_the_chi_square_distribution_says() {
    // One column of information g, and a moment of some standard deviations: a tenth of the
    // draws lie beyond 1.645.
    let g = 1e6_f64;
    let of = |deviations: f64| {
        let sum = regression(DMatrix::from_element(1, 1, g));
        let found = 0.5 * deviations.powi(2) * g / (1.0 + g) - 0.5 * g.ln_1p();
        rehearse(&sum, (&columns(1), &[0.0]), (&[], found), 3).p_value
    };
    assert!((of(1.645) - 0.1).abs() < 0.06, "{}", of(1.645));
    assert!(of(9.0) < 0.006);
}

/// Symptom: a gap had a p-value several times too large where the best candidate is unusual at
/// its site. Cause: its evidence, less the odds against it, was compared with draws without
/// these odds.
#[test]
fn an_unusual_effect_is_as_unlikely_in_the_draws() {
    let sum = regression(DMatrix::from_element(1, 1, 1e4));
    let p = |odds: f64| rehearse(&sum, (&columns(1), &[odds]), (&[], -3.0 + odds), 3).p_value;
    assert!(p(0.0) > 0.01 && p(0.0) < 0.5, "{}", p(0.0));
    assert_eq!(p(-2.3), p(0.0));
}

#[test]
fn a_column_of_far_more_information_makes_no_noise_in_the_others() {
    let gram = DMatrix::from_diagonal(&DVector::from_row_slice(&[1e24, 1e4]));
    let all = (&columns(2), &[0.0; 2][..]);
    let p = rehearse(&regression(gram), all, (&[], 6.0), 3).p_value;
    assert!(p < 0.006, "{p}");
}

#[test]
fn what_the_present_model_can_do_is_in_no_draw() {
    // The candidate acts nearly as the model's own column does. With the little information
    // that remains, every draw has an evidence above -0.5. With the whole column, next to none
    // has.
    let x = DMatrix::from_row_slice(2, 2, &[1e3, 600.0, 0.0, 1e-3]);
    let mut columns = columns(1);
    columns.base = 1;
    columns.forms[0].first = 1;
    columns.bounds = vec![[-1e9, 1e9]; 2];
    let sum = regression(x.transpose() * &x);
    let p = |columns: &Columns| rehearse(&sum, (columns, &[0.0]), (&[], -0.5), 5).p_value;
    assert_eq!(p(&columns), 1.0);
    columns.base = 0;
    columns.forms[0].first = 1;
    assert!(p(&columns) < 0.05);
}

#[test]
fn effects_that_act_alike_are_taken_for_each_other_and_others_are_recognised() {
    let gram = DMatrix::from_row_slice(
        3,
        3,
        &[1e4, 0.99999e4, 0.0, 0.99999e4, 1e4, 0.0, 0.0, 0.0, 1e4],
    );
    let limits = [limit(0, 0.05), limit(2, 0.05)];
    let all = (&columns(3), &[0.0; 3][..]);
    let found = rehearse(&regression(gram), all, (&limits, 0.0), 1);
    let (share, other) = found.recognised[0].unwrap();
    assert!(share > 0.1 && share < 0.9, "{share}");
    assert_eq!(other, Some(1));
    assert_eq!(found.recognised[1].unwrap().0, 1.0);
}

/// Logs of a machine that lacks nothing: readings of a white noise and of a force that is known as
/// chance, in a few slow waves.
struct Chance {
    /// Covariance of the readings by the noise, and by the force.
    white: DMatrix<f64>,
    force: DMatrix<f64>,
    /// Response of the readings to each candidate.
    columns: DMatrix<f64>,
}

impl Chance {
    /// Twelve readings; the force is a few times the noise along two waves, and the candidates lie
    /// near these.
    fn new() -> Self {
        let (n, m) = (12, 6);
        let wave = |i: usize, k: usize| (0.5 * (k as f64 + 1.0) * i as f64).cos();
        let waves = DMatrix::from_fn(n, 2, wave);
        Self {
            white: DMatrix::identity(n, n),
            force: &waves * waves.transpose() * 2.0,
            columns: DMatrix::from_fn(n, m, |i, j| {
                let near = wave(i, j % 2) + 0.4 * wave(i, 2 + j);
                if i == 0 { 0.0 } else { 20.0 * near }
            }),
        }
    }

    /// The regressions of readings at the common scales.
    fn screened(&self, y: &DVector<f64>) -> Scales {
        let at = |scale: f64| {
            let factor = (&self.white + scale * &self.force).cholesky().unwrap();
            let (inverse_x, inverse_y) = (factor.solve(&self.columns), factor.solve(y));
            let log: f64 = factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum();
            Regression {
                log_likelihood: -0.5 * y.dot(&inverse_y) - log,
                gram: self.columns.transpose() * inverse_x,
                moment: self.columns.transpose() * inverse_y,
            }
        };
        Scales::known(SCALES.iter().map(|s| at(*s)).collect(), Vec::new())
    }
}

/// Symptom: p-values of logs in which nothing is missing were too small. Cause: draws were screened
/// at one scale of the force's variance, and the logs at the best of several.
#[test]
fn on_chance_alone_small_p_values_are_as_rare_as_they_say() {
    let chance = Chance::new();
    let columns = columns(6);
    let root = (&chance.white + &chance.force).cholesky().unwrap().l();
    let mut random = Streams::new(7).stream("logs");
    let trials = 400;
    let p_value = |trial: u64| {
        let normal = |_, _| random.sample::<f64, _>(StandardNormal);
        let y = &root * DVector::from_fn(12, normal);
        let scales = chance.screened(&y);
        let none = scales.best(&columns, &[]).0;
        let gains = (0..6).map(|j| scales.best(&columns, &[j]).0 - none);
        let found = gains.fold(f64::NEG_INFINITY, f64::max);
        rehearse(&scales, (&columns, &[0.0; 6]), (&[], found), trial).p_value
    };
    let all: Vec<f64> = (0..trials).map(p_value).collect();
    for level in [0.05, 0.1, 0.3] {
        let share = all.iter().filter(|p| **p <= level).count() as f64 / trials as f64;
        let error = (level * (1.0 - level) / trials as f64).sqrt();
        assert!(share < level + 3.0 * error, "{level}: {share}");
        println!("{level}: {share}");
    }
}
