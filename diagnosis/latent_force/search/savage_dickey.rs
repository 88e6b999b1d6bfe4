//! Change of a set's evidence without some of its candidates, to first order.
//!
//! A set without an effect is the set with the effect at its null. The change of the evidence is the
//! logarithm of the ratio of posterior to prior density there (Savage and Dickey 1971; Dickey 1971).

use asid_effects::{EffectParameter, Start};
use nalgebra::{DMatrix, DVector};

use crate::candidate::Candidate;

use super::set::Set;

/// Whether a parameter tells how large its effect is, so that the effect is off at the parameter's
/// null.
///
/// The speed at which a law changes, or the place where a spring rests, does not. The width of a
/// dead band, which has no derivative at its null, does. `has_slopes` tells whether the effect has
/// parameters with one.
pub(super) fn is_size(parameter: &EffectParameter, has_slopes: bool) -> bool {
    match parameter.start {
        Start::Slope => true,
        Start::Values(_) | Start::Multiples(..) => !has_slopes,
        Start::Choice(_) | Start::Places(_) | Start::Given | Start::Set(..) => false,
    }
}

/// Fitted values that leave a set with some of its candidates.
#[derive(Default)]
pub(super) struct Leaving {
    /// Positions of all of them among the fitted values of the set.
    pub(super) all: Vec<usize>,
    /// Positions of those that turn their effects off, with their nulls.
    pub(super) off: Vec<usize>,
    nulls: Vec<f64>,
    /// Whether one of these is a limit.
    is_limit: bool,
}

/// Returns the fitted values of some candidates of a set.
pub(super) fn leaving(candidates: &[Candidate], set: &Set, of: &[usize]) -> Leaving {
    let free = set.fitted.hypothesis.free();
    let mut leaving = Leaving::default();
    let mut at = set.fitted.theta.len();
    for &c in set.candidates.iter().rev() {
        let parameters = candidates[c].parameters();
        let end = at;
        at -= parameters.len();
        if !of.contains(&c) {
            continue;
        }
        let has_slopes = parameters.iter().any(|p| p.start == Start::Slope);
        for k in (0..free.len()).filter(|&k| (at..end).contains(&free[k])) {
            let p = &parameters[free[k] - at];
            leaving.all.push(k);
            // Beside sizes with a derivative, a value that was freed acts by itself, as the offset of
            // a friction does. The loss of a spring does not.
            if is_size(p, has_slopes) || has_slopes && p.start == Start::Given {
                leaving.off.push(k);
                leaving.nulls.push(p.null);
                leaving.is_limit |= p.is_limit() && p.start != Start::Slope;
            }
        }
    }
    leaving
}

/// Change of the evidence of a set without some values, to first order, and the change of each
/// fitted value; `None` if no value turns an effect off, or if the posterior has no density.
///
/// Values that turn no effect off are free where the others are at their nulls.
pub(super) fn without_values(set: &Set, out: &Leaving) -> Option<(f64, DVector<f64>)> {
    if out.off.is_empty() {
        return None;
    }
    let fitted = &set.fitted;
    let free = fitted.hypothesis.free();
    let unknown = |k: usize| &fitted.hypothesis.unknowns[free[k]];
    let deviations = (0..free.len()).map(|k| unknown(k).deviation);
    let prior = DVector::from_iterator(free.len(), deviations);
    let mut away = DVector::zeros(free.len());
    // Logarithm of the ratio of the priors' densities at their centers to those at the nulls.
    let mut rarer = 0.0;
    for (&k, &null) in out.off.iter().zip(&out.nulls) {
        away[k] = fitted.theta[free[k]] - null;
        rarer += 0.5 * unknown(k).distance(null).powi(2);
    }
    let (gain, shift) = at_null(&away, &fitted.covariance, &prior, &out.off)?;
    Some((gain + rarer, shift))
}

/// Change of the evidence of a set without some of its candidates, to first order; `None` if it is
/// not known.
///
/// A limit is off at a value that no normal posterior about a limit reaches. Without one the
/// evidence counts as unchanged, so that a fit decides.
pub(super) fn change_without(candidates: &[Candidate], set: &Set, out: &[usize]) -> Option<f64> {
    let out = leaving(candidates, set, out);
    if out.is_limit {
        return Some(0.0);
    }
    without_values(set, &out).map(|(gain, _)| gain)
}

/// Covariance of the values `stay` given those `out`; `None` if the latter are certain.
pub(super) fn conditional(
    covariance: &DMatrix<f64>,
    stay: &[usize],
    out: &[usize],
) -> Option<DMatrix<f64>> {
    let block = |a: &[usize], b: &[usize]| covariance.select_rows(a).select_columns(b);
    let own = block(out, out).cholesky()?;
    Some(block(stay, stay) - block(stay, out) * own.solve(&block(out, stay)))
}

/// Effect of fixing some values of a normal posterior: the change of the evidence, with the prior's
/// density at its center, and the change of each value.
///
/// `off` holds the distances of the posterior's means from the fixed values, `prior` the standard
/// deviations of the priors, and `out` the positions of the fixed values. `None` if the posterior
/// has no density.
fn at_null(
    off: &DVector<f64>,
    covariance: &DMatrix<f64>,
    prior: &DVector<f64>,
    out: &[usize],
) -> Option<(f64, DVector<f64>)> {
    let own = covariance.select_rows(out).select_columns(out).cholesky()?;
    let away = off.select_rows(out);
    let weighed = own.solve(&away);
    let log_prior: f64 = out.iter().map(|&k| prior[k].ln()).sum();
    let log_determinant: f64 = own.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
    let gain = log_prior - log_determinant - 0.5 * away.dot(&weighed);
    Some((gain, -(covariance.select_columns(out) * weighed)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::latent_force::search::by_hand;

    /// Log marginal likelihood of `y = a x + e` less that of `x = 0`, with `e ~ N(0, 1)` and
    /// `x ~ N(0, s^2)`; the posterior's mean and covariance.
    fn regression(
        a: &DMatrix<f64>,
        y: &DVector<f64>,
        s: &DVector<f64>,
    ) -> (f64, DVector<f64>, DMatrix<f64>) {
        let precision = DMatrix::from_diagonal(&s.map(|s| 1.0 / (s * s)));
        let posterior = (a.transpose() * a + &precision).cholesky().unwrap();
        let moment = a.transpose() * y;
        let mean = posterior.solve(&moment);
        let determinant: f64 = posterior.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
        let prior: f64 = s.iter().map(|s| s.ln()).sum();
        let evidence = 0.5 * moment.dot(&mean) - determinant - prior;
        (evidence, mean, posterior.inverse())
    }

    #[test]
    fn taking_a_value_out_is_the_regression_without_its_column() {
        let a = DMatrix::from_fn(12, 4, |i, j| {
            ((1.3 * i as f64 + 0.7) * (j + 1) as f64).sin()
        });
        let y = DVector::from_fn(12, |i, _| (0.4 * i as f64).cos() + 0.3 * a[(i, 2)]);
        let s = DVector::from_column_slice(&[0.5, 2.0, 1.0, 3.0]);
        let (all, mean, covariance) = regression(&a, &y, &s);
        for out in [vec![1], vec![3, 0]] {
            let stay: Vec<usize> = (0..4).filter(|k| !out.contains(k)).collect();
            let some = (a.select_columns(&stay), s.select_rows(&stay));
            let (fewer, mean_of_fewer, covariance_of_fewer) = regression(&some.0, &y, &some.1);
            let (gain, shift) = at_null(&mean, &covariance, &s, &out).unwrap();
            assert!(
                (gain - (fewer - all)).abs() < 1e-9,
                "{gain} {}",
                fewer - all
            );
            let moved = (&mean + shift).select_rows(&stay);
            assert!((moved - mean_of_fewer).norm() < 1e-9);
            let left = conditional(&covariance, &stay, &out).unwrap();
            assert!((left - covariance_of_fewer).norm() < 1e-9);
        }
    }

    /// A set of one candidate; for each of its first values the value itself, the center and the
    /// standard deviation of its prior, and the standard deviation of its posterior.
    fn set_of(candidate: &Candidate, values: &[[f64; 4]]) -> Set {
        let all = std::slice::from_ref(candidate);
        let mut set = by_hand::set(all, (&[&[0]], &[]), 50.0);
        for (k, [value, center, prior, posterior]) in values.iter().enumerate() {
            set.fitted.theta[k] = *value;
            set.fitted.hypothesis.unknowns[k].center = *center;
            set.fitted.hypothesis.unknowns[k].deviation = *prior;
            set.fitted.covariance[(k, k)] = posterior * posterior;
        }
        set
    }

    /// Logarithm of a normal density, without its constant.
    fn log_density(x: f64, mean: f64, deviation: f64) -> f64 {
        -0.5 * ((x - mean) / deviation).powi(2) - deviation.ln()
    }

    /// Symptom: of a much softer servo and a law that was not there both stayed named. Cause: the
    /// prior of the servo's stiffness has its center at a start value. The cost of removing the
    /// servo was that of fixing its stiffness there, next to nothing, so that nothing else was tried.
    #[test]
    fn an_effect_is_removed_at_its_null_and_not_at_the_center_of_its_prior() {
        let candidate = by_hand::candidate("servo-stiffness@drive");
        let set = set_of(&candidate, &[[0.4, 0.3, 0.7, 0.01]]);
        let change = change_without(&[candidate], &set, &[0]).unwrap();
        let want = log_density(1.0, 0.4, 0.01) - log_density(1.0, 0.3, 0.7);
        assert!(
            (change - want).abs() < 1e-9 && want < -1000.0,
            "{change} {want}"
        );
    }

    #[test]
    fn where_a_spring_rests_does_not_turn_it_off() {
        let candidate = by_hand::candidate("joint-stiffness@slide");
        let of_rest = |rest: f64| {
            let set = set_of(&candidate, &[[3.0, 0.0, 5.0, 1.0], [rest, 0.3, 0.3, 0.01]]);
            change_without(std::slice::from_ref(&candidate), &set, &[0]).unwrap()
        };
        let want = log_density(0.0, 3.0, 1.0) - log_density(0.0, 0.0, 5.0);
        for rest in [0.3, 1.0] {
            let found = of_rest(rest);
            assert!((found - want).abs() < 1e-9, "{rest}: {found} {want}");
        }
    }

    #[test]
    fn what_a_spring_loses_does_not_turn_it_off() {
        let candidate = by_hand::candidate("joint-compliance@elbow");
        let mut set = set_of(&candidate, &[[0.1, 0.0, 0.2, 0.05]]);
        // Its loss was freed, and is far from its null.
        set.fitted.hypothesis.unknowns[1].free = true;
        set.fitted.theta[1] = 0.5;
        set.fitted.covariance = DMatrix::from_diagonal(&DVector::from_row_slice(&[0.0025, 1e-4]));
        let change = change_without(&[candidate], &set, &[0]).unwrap();
        let want = log_density(0.0, 0.1, 0.05) - log_density(0.0, 0.0, 0.2);
        assert!((change - want).abs() < 1e-9, "{change} {want}");
    }

    #[test]
    fn a_fit_decides_whether_a_limit_is_removed() {
        let candidate = by_hand::candidate("actuator-saturation@drive");
        let set = set_of(&candidate, &[[5.0, 5.0, 5.0, 0.01]]);
        assert_eq!(change_without(&[candidate], &set, &[0]), Some(0.0));
    }
}
