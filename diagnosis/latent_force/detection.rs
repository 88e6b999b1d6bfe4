//! The smallest size of each effect that the logs could have shown.
//!
//! A column with the information `g` (its power in whitened innovations, what the present model can do projected out) adds
//! the evidence `c^2 g / 2 - ln(1 + g) / 2` at a coefficient `c`, in deviations of its prior. The least `c` that reaches the evidence
//! an effect must earn is the limit. It is that of the evidence alone: where replays must show the effect as well, it can be larger.

use asid_effects::Start;

use crate::candidate::Candidate;

use super::columns::{Columns, SECANT};
use super::screen::project;
use super::smoother::Regression;

/// The value of a candidate's parameter from which on it is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// The candidate.
    pub candidate: usize,
    /// Its parameter.
    pub parameter: usize,
    /// The value; NaN where none within its range is seen.
    pub value: f64,
    /// Its column.
    pub column: usize,
    /// Coefficient of the column from which on it is seen, in deviations of its prior.
    pub coefficient: f64,
}

/// Coefficient from which on a column of information `g` earns `threshold`.
fn coefficient(g: f64, threshold: f64) -> f64 {
    ((2.0 * threshold + g.ln_1p()) / g).sqrt()
}

/// Limits of all candidates that have columns, one for each parameter that is a slope, or the first of those that a secant
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

/// Least part of a secant that tells of smaller values: a law that has no slope at null bends.
const LEAST_PART: f64 = 0.3;

/// The value from which on an effect is seen whose secant at `begin` is seen from the coefficient `c` on; NaN where that is beyond what the
/// secant tells of.
fn by_secant(null: f64, begin: f64, c: f64) -> f64 {
    match c {
        c if c > SECANT => f64::NAN,
        // Between a limit and none there is no proportion.
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

/// `null` and a distance from it, up where the range allows that, else down; NaN where neither.
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
    use super::*;

    #[test]
    fn at_the_limit_a_column_earns_the_threshold() {
        for g in [0.01, 3.0, 4e5] {
            let c = coefficient(g, 7.0);
            assert!((0.5 * c * c * g - 0.5 * (1.0 + g).ln() - 7.0).abs() < 1e-9);
        }
        assert_eq!(coefficient(0.0, 7.0), f64::INFINITY);
    }

    #[test]
    fn a_secant_tells_of_values_about_its_own() {
        assert_eq!(by_secant(0.0, 0.02, 0.5), 0.01);
        assert_eq!(by_secant(0.0, 0.02, 1e-6), 0.006);
        assert!(by_secant(0.0, 0.02, 2.0).is_nan());
        // A limit of 3 in place of 500 that is easily seen.
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
