//! The smallest size of each effect that the logs could have shown (detection limit).
//!
//! Let `g` be the information of a column: its power in whitened innovations, the present model
//! projected out. An effect with a coefficient `c`, in prior standard deviations, has the moment
//! `g c` and adds the evidence `c^2 g^2 / (1 + g) / 2 - ln(1 + g) / 2`. The limit is the smallest
//! `c` that reaches the evidence that an effect must earn. It considers the evidence alone: where
//! replays must confirm the effect, the limit can be larger.

use asid_effects::Start;

use crate::candidate::Candidate;

use super::columns::{Columns, SECANT};
use super::screen::project;
use super::smoother::Regression;

/// The smallest detectable value of a candidate's parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// The candidate.
    pub candidate: usize,
    /// Its parameter.
    pub parameter: usize,
    /// The value; NaN if no value within the range is detectable.
    pub value: f64,
    /// Index of its column.
    pub column: usize,
    /// Smallest detectable coefficient of the column, in prior standard deviations.
    pub coefficient: f64,
}

/// Smallest coefficient with which a column of information `g` earns `threshold`.
fn coefficient(g: f64, threshold: f64) -> f64 {
    ((2.0 * threshold + g.ln_1p()) * (1.0 + g)).sqrt() / g
}

/// Returns the detection limits of all candidates that have columns.
///
/// There is one for each parameter with a derivative, or for the first parameter that a secant
/// moves.
#[must_use]
pub fn limits(
    sum: &Regression,
    columns: &Columns,
    candidates: &[Candidate],
    threshold: f64,
) -> Vec<Limit> {
    let base: Vec<usize> = (0..columns.base).collect();
    let gram = project(&sum.gram, &base);
    let mut all: Vec<Limit> = Vec::new();
    for form in &columns.forms {
        let candidate = &candidates[form.candidate];
        let parameters = candidate.parameters();
        for (column, slope) in form.columns().zip(&form.slopes) {
            let c = coefficient(gram[(column, column)].max(0.0), threshold);
            let (parameter, value) = match *slope {
                Some((p, size)) => (p, within(candidate.limits(p), parameters[p].null, c * size)),
                None => {
                    let moves = |p: &usize| {
                        let is_given = |s: &Start| {
                            matches!(s, Start::Choice(_) | Start::Given | Start::Set(..))
                        };
                        !is_given(&parameters[*p].start) && form.begin[*p] != parameters[*p].null
                    };
                    let Some(p) = (0..parameters.len()).find(moves) else {
                        continue;
                    };
                    (p, by_secant(parameters[p].null, form.begin[p], c))
                }
            };
            let same = |l: &&mut Limit| l.candidate == form.candidate && l.parameter == parameter;
            let null = parameters[parameter].null;
            let limit = Limit {
                candidate: form.candidate,
                parameter,
                value,
                column,
                coefficient: c,
            };
            match all.iter_mut().find(same) {
                Some(known) => {
                    let nearer = (value - null).abs() < (known.value - null).abs();
                    if nearer || known.value.is_nan() {
                        *known = limit;
                    }
                }
                None => all.push(limit),
            }
        }
    }
    all
}

/// Smallest part of a secant that represents smaller values: a law without a derivative at its null
/// is nonlinear.
const LEAST_PART: f64 = 0.3;

/// Smallest detectable value of an effect with a secant at `begin`, detectable from coefficient `c`
/// on.
///
/// NaN if the value is beyond what the secant represents.
fn by_secant(null: f64, begin: f64, c: f64) -> f64 {
    match c {
        c if c > SECANT => f64::NAN,
        // A limit has a null other than zero (no limit), and its values do not scale with the
        // coefficient.
        c if null != 0.0 => {
            if c <= 1.0 {
                begin
            } else {
                f64::NAN
            }
        }
        c => begin * c.max(LEAST_PART),
    }
}

/// `null` plus a distance if the range allows that, else minus it; NaN if neither is in range.
fn within([low, high]: [f64; 2], null: f64, distance: f64) -> f64 {
    if null + distance <= high {
        null + distance
    } else if null - distance >= low {
        null - distance
    } else {
        f64::NAN
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::latent_force::evidence::evidence;

    /// Symptom: an effect at its detection limit earned half of the evidence that it must, where
    /// the logs hardly show it. Cause: its prior was left out.
    #[test]
    fn at_the_limit_a_column_earns_the_threshold() {
        for g in [0.01, 0.5, 4.0, 4e5] {
            let c = coefficient(g, 7.0);
            let (gram, moment) = (
                DMatrix::from_element(1, 1, g),
                DVector::from_element(1, g * c),
            );
            let bounds = [[f64::NEG_INFINITY, f64::INFINITY]];
            let gain = evidence(&gram, &moment, &[0], &[0.0], &bounds).gain;
            assert!((gain - 7.0).abs() < 1e-6, "{g}: {gain}");
        }
        assert_eq!(coefficient(0.0, 7.0), f64::INFINITY);
    }

    #[test]
    fn a_secant_tells_of_values_about_its_own() {
        assert_eq!(by_secant(0.0, 0.02, 0.5), 0.01);
        assert_eq!(by_secant(0.0, 0.02, 1e-6), 0.006);
        assert!(by_secant(0.0, 0.02, 2.0).is_nan());
        // A limit of 3 instead of 500 that is easily detected.
        assert_eq!(by_secant(500.0, 3.0, 0.1), 3.0);
    }

    #[test]
    fn a_limit_is_above_null_where_the_range_allows_it() {
        assert_eq!(within([0.0, 5.0], 0.0, 2.0), 2.0);
        assert_eq!(within([0.2, 1.0], 1.0, 0.5), 0.5);
        assert!(within([0.2, 1.0], 1.0, 0.9).is_nan());
        assert!(within([0.0, 5.0], 0.0, f64::INFINITY).is_nan());
    }
}
