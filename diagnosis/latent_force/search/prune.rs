//! Removal of the members of a set that have no effect in it.

use asid_core::{Progress, Result};
use asid_effects::Start;
use nalgebra::{DMatrix, DVector};

use crate::candidate::Candidate;
use crate::latent_force::context::Context;
use crate::latent_force::estimate::Missing;
use crate::settings::Breadth;

use super::set::{IDLE, Set, without};

/// Evidence, in nats, that a set may lose when insignificant members are removed.
const IDLE_LOSS: f64 = 1.0;
/// Size, relative to the largest of the same law, below which a member of a group may stand in for
/// something else.
///
/// A law that joints share is not much smaller at one of them, unless that member makes up for its
/// share of what is missing.
const SLIGHT: f64 = 1.0 / 3.0;

/// What a member of a set contributes: its distance from its null, in posterior deviations and in
/// its own unit.
struct Deed {
    candidate: usize,
    law: String,
    strength: f64,
    size: f64,
}

/// What each member of a set contributes; members without a size are left out.
fn deeds(candidates: &[Candidate], set: &Set) -> Vec<Deed> {
    let fitted = &set.fitted;
    let free = fitted.hypothesis.free();
    let parameters = |c: usize| candidates[c].parameters().len();
    let mut at = fitted.theta.len() - set.candidates.iter().map(|&c| parameters(c)).sum::<usize>();
    let mut all = Vec::new();
    for &c in &set.candidates {
        let range = at..at + parameters(c);
        at = range.end;
        if candidates[c].is_tolerance {
            continue;
        }
        // The speed at which a law changes is no measure of its size. A delay, which has no
        // derivative, is one.
        let all_of = candidates[c].parameters();
        let has_slopes = all_of.iter().any(|p| p.start == Start::Slope);
        let sizes = range.clone().filter_map(|i| {
            let p = &candidates[c].parameters()[i - range.start];
            let k = free.iter().position(|&f| f == i)?;
            let is_slope = p.start == Start::Slope;
            if !is_slope
                && (has_slopes || !matches!(p.start, Start::Values(_) | Start::Multiples(..)))
            {
                return None;
            }
            let deviation = fitted.covariance[(k, k)].max(0.0).sqrt();
            let size = (fitted.theta[i] - p.null).abs();
            Some((size / deviation, size))
        });
        let largest = sizes.reduce(|a, b| (a.0.max(b.0), a.1.max(b.1)));
        all.extend(largest.map(|(strength, size)| Deed {
            candidate: c,
            law: candidates[c].spec.name.clone(),
            strength,
            size,
        }));
    }
    all
}

/// Removes the members of a set that have no effect in it: members of a group at or near their
/// null, and members that a later effect has replaced.
///
/// A slight member of a group stays only if it makes up for the share of what was missing
/// `at_first` that any further effect must.
pub(super) fn pruned(
    context: &Context<'_>,
    candidates: &[Candidate],
    set: Set,
    (breadth, at_first): (Breadth, Missing),
    progress: &dyn Progress,
) -> Result<Set> {
    let deeds = deeds(candidates, &set);
    let is_idle = |d: &&Deed| d.strength < IDLE;
    let is_slight = |d: &&Deed| {
        let like = deeds.iter().filter(|o| o.law == d.law);
        d.size < SLIGHT * like.map(|o| o.size).fold(0.0, f64::max)
    };
    let places = |which: &dyn Fn(&&Deed) -> bool| -> Vec<usize> {
        deeds.iter().filter(which).map(|d| d.candidate).collect()
    };
    let left = |s: &Set| s.fitted.estimate.missing(context).relative_to(at_first);
    let (idle, slight) = (places(&is_idle), places(&is_slight));
    let mut set = set;
    for (out, slight) in [(idle, false), (slight, true)] {
        let out: Vec<usize> = (out.into_iter())
            .filter(|c| set.candidates.contains(c))
            .collect();
        if out.is_empty() || out.len() == set.candidates.len() {
            continue;
        }
        let mut smaller = set.clone();
        for &c in &out {
            smaller = without(&smaller, candidates, c);
        }
        smaller.fit(context, (breadth.rounds[1], progress))?;
        let stands = if slight {
            left(&smaller) - left(&set) < breadth.shrinks * out.len() as f64
        } else {
            smaller.fitted.evidence > set.fitted.evidence - IDLE_LOSS
        };
        if stands {
            set = smaller;
        }
    }
    Ok(set)
}

/// Whether the second set makes up for as much of what the first, without the name, leaves as a
/// further name must.
pub(super) type Counts<'c> = dyn Fn(&Set, &Set) -> Result<bool> + 'c;

/// Removes the names of a set that adding one name after the other would not have included, if
/// several were added to a base at once.
///
/// Each name must raise the evidence by the `threshold` and pass `counts`. If the remaining set is
/// among the `others` that were fitted, that fit is used.
pub(super) fn earned(
    context: &Context<'_>,
    candidates: &[Candidate],
    (set, base, others): (Set, &Set, &[Set]),
    (breadth, threshold, counts): (Breadth, f64, &Counts<'_>),
    progress: &dyn Progress,
) -> Result<Set> {
    let is_more = |c: &usize| !candidates[*c].is_tolerance && !base.candidates.contains(c);
    let mut set = set;
    while set.names.count() > base.names.count() + 1 && !progress.is_stopped() {
        let added = set.candidates.iter().copied().filter(is_more);
        let change = |c: usize| change_without(candidates, &set, &[c]).unwrap_or(f64::NEG_INFINITY);
        // The member whose removal costs least.
        let Some(out) = added.max_by(|a, b| change(*a).total_cmp(&change(*b))) else {
            break;
        };
        let mut smaller = without(&set, candidates, out);
        let same = |o: &&Set| {
            let is_in = |c: &usize| smaller.candidates.contains(c);
            o.candidates.len() == smaller.candidates.len() && o.candidates.iter().all(is_in)
        };
        match others.iter().find(same) {
            Some(known) => smaller = known.clone(),
            None => smaller.fit(context, (breadth.rounds[1], progress))?,
        }
        if set.rises_above(&smaller, threshold) && counts(&smaller, &set)? {
            break;
        }
        set = smaller;
    }
    Ok(set)
}

/// Prunes as [`pruned`] does if there is no time for another fit.
///
/// The remaining values take their means given that the removed ones are at their null values. The
/// evidence follows from the densities there ([`at_null`]). Slight members stay.
pub(super) fn pruned_at_once(candidates: &[Candidate], set: Set) -> Set {
    let idle: Vec<usize> = (deeds(candidates, &set).iter())
        .filter(|d| d.strength < IDLE)
        .map(|d| d.candidate)
        .collect();
    if idle.is_empty() || idle.len() == set.candidates.len() {
        return set;
    }
    let fitted = &set.fitted;
    let free = fitted.hypothesis.free();
    let out = values_of(candidates, &set, &idle);
    let Some((gain, shift)) = without_values(&set, &out) else {
        return set;
    };
    if gain < -IDLE_LOSS {
        return set;
    }
    let mut smaller = set.clone();
    for (k, &i) in free.iter().enumerate() {
        let [low, high] = fitted.hypothesis.unknowns[i].bounds;
        smaller.fitted.theta[i] = (smaller.fitted.theta[i] + shift[k]).clamp(low, high);
    }
    let stay: Vec<usize> = (0..free.len()).filter(|k| !out.contains(k)).collect();
    // The values are at their means now; the old distances would be those of other values.
    smaller.fitted.ahead = vec![0.0; stay.len()];
    let covariance = conditional(&fitted.covariance, &stay, &out);
    for &c in &idle {
        smaller = without(&smaller, candidates, c);
    }
    smaller.fitted.evidence += gain;
    smaller.fitted.covariance = covariance.unwrap_or_else(|| {
        let own = fitted.covariance.select_rows(&stay);
        own.select_columns(&stay)
    });
    smaller
}

/// Positions of the values of some candidates of a set among its fitted values.
fn values_of(candidates: &[Candidate], set: &Set, of: &[usize]) -> Vec<usize> {
    let free = set.fitted.hypothesis.free();
    let mut at = set.fitted.theta.len();
    let mut all = Vec::new();
    for &c in set.candidates.iter().rev() {
        let end = at;
        at -= candidates[c].parameters().len();
        if of.contains(&c) {
            all.extend((0..free.len()).filter(|&k| (at..end).contains(&free[k])));
        }
    }
    all
}

/// As [`at_null`], for fitted values of a set.
fn without_values(set: &Set, out: &[usize]) -> Option<(f64, DVector<f64>)> {
    let fitted = &set.fitted;
    let free = fitted.hypothesis.free();
    let unknowns = || free.iter().map(|&i| (&fitted.hypothesis.unknowns[i], i));
    let off = DVector::from_iterator(
        free.len(),
        unknowns().map(|(u, i)| fitted.theta[i] - u.center),
    );
    let prior = DVector::from_iterator(free.len(), unknowns().map(|(u, _)| u.deviation));
    at_null(&off, &fitted.covariance, &prior, out)
}

/// Change of the evidence of a set without some of its candidates, to first order; `None` if it is
/// not known.
pub(super) fn change_without(candidates: &[Candidate], set: &Set, out: &[usize]) -> Option<f64> {
    let values = values_of(candidates, set, out);
    without_values(set, &values).map(|(gain, _)| gain)
}

/// Covariance of the values `stay` given those `out`; `None` if the latter are certain.
fn conditional(covariance: &DMatrix<f64>, stay: &[usize], out: &[usize]) -> Option<DMatrix<f64>> {
    let block = |a: &[usize], b: &[usize]| covariance.select_rows(a).select_columns(b);
    let own = block(out, out).cholesky()?;
    Some(block(stay, stay) - block(stay, out) * own.solve(&block(out, stay)))
}

/// Effect of fixing some values of a normal posterior at the centers of their priors: the change of
/// the evidence, and the change of each value.
///
/// The change of the evidence is the logarithm of the ratio of posterior to prior density at the
/// centers (Savage and Dickey 1971). `off` holds the distances of the posterior's means from the
/// centers, `prior` the standard deviations of the priors, and `out` the positions of the fixed
/// values. `None` if the posterior has no density.
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
}
