//! What the screening would report for machines like this one: with nothing missing, and with one
//! effect missing.
//!
//! The screening is a linear problem: whitened innovations are `X c` plus normal noise, and it uses
//! only `X'y`. So drawing logs under the same commands needs no simulation: `X'y = G c + z` with
//! `z ~ N(0, G)` and `G = X'X`, the present model projected out. Each draw is screened as the logs
//! were.

use asid_core::Streams;
use nalgebra::{DMatrix, DVector};
use rand::Rng as _;
use rand_distr::StandardNormal;

use super::columns::{Columns, Form};
use super::detection::Limit;
use super::screen::project;
use super::smoother::Regression;

/// Draws of a machine that lacks nothing: they resolve probabilities to half a percent.
const NOTHING_MISSING: usize = 199;
/// Draws of a machine that lacks one effect: shares are known to 0.2 (two standard errors).
const ONE_MISSING: usize = 24;
/// Size of the drawn effect, as a multiple of its limit: at the limit itself half of the draws miss
/// it.
const SIZE: f64 = 2.0;
/// Largest number of columns: the cost of a rehearsal grows with its cube.
const COLUMNS: usize = 600;

/// Results of screening the drawn logs.
#[derive(Clone, Debug, Default)]
pub struct Rehearsal {
    /// Probability that chance alone gives the best candidate as much evidence; NaN if unknown.
    pub p_value: f64,
    /// One entry per limit: the share of draws that rank its candidate first, and the candidate
    /// that most of the other draws rank first.
    pub recognised: Vec<Option<(f64, Option<usize>)>>,
}

/// A form with the quantities that its evidence needs.
struct Ranked<'a> {
    form: &'a Form,
    /// Logarithm of its prior odds.
    odds: f64,
    places: Vec<usize>,
    /// Inverse of `G + 1`, and half the logarithm of its determinant.
    inverse: DMatrix<f64>,
    half_log: f64,
    /// Bounds of the coefficient, if there is only one.
    bounds: Option<[f64; 2]>,
}

impl<'a> Ranked<'a> {
    fn of((form, odds): (&'a Form, f64), gram: &DMatrix<f64>, bounds: &[[f64; 2]]) -> Option<Self> {
        let places: Vec<usize> = form.columns().collect();
        let n = places.len();
        let own = DMatrix::from_fn(n, n, |i, j| {
            gram[(places[i], places[j])] + f64::from(u8::from(i == j))
        });
        let factor = own.cholesky()?;
        let half_log = factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum();
        Some(Self {
            form,
            odds,
            bounds: (n == 1).then(|| bounds[places[0]]),
            places,
            inverse: factor.inverse(),
            half_log,
        })
    }

    /// Evidence for the form if `X'y` is `moment`, with its prior odds.
    fn gain(&self, moment: &DVector<f64>) -> f64 {
        let b = DVector::from_fn(self.places.len(), |i, _| moment[self.places[i]]);
        let c = &self.inverse * &b;
        if let Some([low, high]) = self.bounds {
            let c = c[0].clamp(low, high);
            return self.odds + b[0] * c - 0.5 * c * c / self.inverse[(0, 0)] - self.half_log;
        }
        self.odds + 0.5 * b.dot(&c) - self.half_log
    }
}

/// Largest evidence of all forms, and its candidate.
fn best(forms: &[Ranked<'_>], moment: &DVector<f64>) -> (f64, usize) {
    let gains = forms.iter().map(|f| (f.gain(moment), f.form.candidate));
    gains.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, 0))
}

/// Factor `L` of `G = L L'` of a matrix that may be singular.
///
/// Each diagonal entry is raised by a small share of itself, because columns differ by many powers
/// of ten.
fn root(gram: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let sizes = gram.diagonal().map(|g| g.max(0.0).sqrt());
    let unit = |i: usize| if sizes[i] > 0.0 { sizes[i] } else { 1.0 };
    [1e-12, 1e-9, 1e-6].into_iter().find_map(|share| {
        let correlation = DMatrix::from_fn(gram.nrows(), gram.ncols(), |i, j| {
            let own = if i == j { share } else { 0.0 };
            gram[(i, j)] / (unit(i) * unit(j)) + own
        });
        let mut root = correlation.cholesky()?.l();
        for (i, mut row) in root.row_iter_mut().enumerate() {
            row *= sizes[i];
        }
        Some(root)
    })
}

/// `X'X` with the present model projected out; the model's own rows and columns are zero.
fn projected(sum: &Regression, base: usize) -> DMatrix<f64> {
    let places: Vec<usize> = (0..base).collect();
    let mut gram = project(&sum.gram, &places);
    for i in 0..base {
        gram.row_mut(i).fill(0.0);
        gram.column_mut(i).fill(0.0);
    }
    gram
}

/// Rehearses a screening; `found` is the evidence of its best candidate.
///
/// This evidence and that of the draws include the prior odds of each form, of which `odds` holds
/// the logarithms.
#[must_use]
pub fn rehearse(
    sum: &Regression,
    (columns, odds): (&Columns, &[f64]),
    (limits, found): (&[Limit], f64),
    seed: u64,
) -> Rehearsal {
    let n = sum.gram.nrows();
    let none = Rehearsal {
        p_value: f64::NAN,
        recognised: vec![None; limits.len()],
    };
    if n == columns.base || n > COLUMNS {
        return none;
    }
    let gram = projected(sum, columns.base);
    let Some(root) = root(&gram) else {
        return none;
    };
    let ranked = columns.forms.iter().zip(odds);
    let forms: Vec<Ranked<'_>> = ranked
        .filter_map(|(f, odds)| Ranked::of((f, *odds), &gram, &columns.bounds))
        .collect();
    let mut random = Streams::new(seed).stream("rehearsal");
    let noise: Vec<DVector<f64>> = (0..NOTHING_MISSING)
        .map(|_| &root * DVector::from_fn(n, |_, _| random.sample::<f64, _>(StandardNormal)))
        .collect();
    let as_much = noise.iter().filter(|z| best(&forms, z).0 >= found).count();
    let recognised = limits.iter().map(|limit| {
        if !limit.coefficient.is_finite() || limit.value.is_nan() {
            return None;
        }
        let shown = gram.column(limit.column) * (SIZE * limit.coefficient);
        let draws = noise.iter().take(ONE_MISSING);
        let named: Vec<usize> = draws.map(|z| best(&forms, &(&shown + z)).1).collect();
        let right = named.iter().filter(|c| **c == limit.candidate).count();
        let count = |c: usize| named.iter().filter(|x| **x == c).count();
        let others = named.iter().copied().filter(|c| *c != limit.candidate);
        let taken_for = others.max_by_key(|&c| (count(c), std::cmp::Reverse(c)));
        Some((right as f64 / ONE_MISSING as f64, taken_for))
    });
    Rehearsal {
        p_value: (1 + as_much) as f64 / (1 + NOTHING_MISSING) as f64,
        recognised: recognised.collect(),
    }
}

#[cfg(test)]
mod tests {
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

    fn regression(gram: DMatrix<f64>) -> Regression {
        Regression {
            log_likelihood: 0.0,
            moment: DVector::zeros(gram.nrows()),
            gram,
        }
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
}
