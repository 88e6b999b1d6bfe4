//! All tolerances of an ordinary machine at once: masses, lengths, frictions and delays.
//!
//! A machine differs from its model in many small things. One law that is none of them may make up
//! for many, as a lag at each drive does for delays, frictions and a compliance. So all tolerances
//! together are a rival of every name. Each has a normal prior as wide as its tolerance, so that
//! the evidence alone pays for it. They are fitted, and never named.

mod names;

use nalgebra::{DMatrix, DVector};

use crate::candidate::Candidate;
use crate::latent_force::columns::Columns;
use crate::latent_force::evidence::evidence;
use crate::latent_force::fit::Slopes;
use crate::latent_force::fitted_value::Unknown;
use crate::latent_force::scales::Scales;
use crate::latent_force::screen::Screened;
use crate::latent_force::smoother::Regression;

use super::has_tolerances;
use super::set::Set;

/// Standard deviations of the prior that a tolerance spans on either side of the null.
const DEVIATIONS: f64 = 3.0;
/// Information about a value, in units of its tolerance's deviation, below which it is not fitted:
/// its evidence is about half of that.
const LEAST_INFORMATION: f64 = 0.1;
/// Most names that tolerances are compared with in a screening: what the first three do not make up
/// for is many small things.
const NAMES: usize = 3;
/// Leading sets of a screening that are tried as such a name.
const LEADING: usize = 60;

/// One tolerance: a candidate, its values, and the prior deviation of each value; 0 for one that is
/// not fitted.
#[derive(Clone, Debug)]
struct Member {
    candidate: usize,
    /// Values at the null, and those of the regression.
    begin: Vec<f64>,
    values: Vec<f64>,
    deviations: Vec<f64>,
    /// The candidate of the same effect that can be named, with its unknowns.
    named: (usize, Vec<Unknown>),
}

/// What the logs show of an ordinary machine's tolerances upon a model, to first order.
#[derive(Clone, Debug)]
pub struct Tolerances {
    /// Evidence over the model, in nats.
    pub(super) gain: f64,
    base: Vec<f64>,
    members: Vec<Member>,
}

/// Standard deviation of a value whose tolerance is a range about its null.
fn deviation([low, high]: [f64; 2], null: f64) -> f64 {
    (null - low).abs().max((high - null).abs()) / DEVIATIONS
}

/// The coefficients of a model's values: the first `free` of its own columns.
///
/// The column after them is that of the engine's own error, which changes no value.
fn of_values(own: &[f64], free: usize) -> Vec<f64> {
    own[..free.min(own.len())].to_vec()
}

impl Member {
    /// Adds it to a set with some values; the set is not refitted.
    fn join(&self, set: &mut Set, candidate: &Candidate, values: &[f64]) {
        let fitted = &mut set.fitted;
        fitted.hypothesis.specs.push(candidate.spec.clone());
        fitted.hypothesis.unknowns.extend(self.unknowns(candidate));
        fitted.theta.extend(values);
        fitted.slopes = Slopes::default();
        set.candidates.push(self.candidate);
    }

    /// Its parameters as unknowns of a fit.
    fn unknowns(&self, candidate: &Candidate) -> Vec<Unknown> {
        let own = candidate.unknowns().into_iter();
        own.zip(candidate.parameters())
            .zip(&self.deviations)
            .map(|(((parameter, _), p), &deviation)| Unknown {
                bounds: parameter.range,
                parameter,
                center: p.null,
                deviation: deviation.max(f64::MIN_POSITIVE),
                free: deviation > 0.0,
                is_tolerance: true,
            })
            .collect()
    }
}

impl Tolerances {
    /// Tolerances of the candidates that are not in a set yet, by the columns of the nameable
    /// candidates of the same effects.
    ///
    /// The nameable candidates are the `open` ones. `columns` and the regressions of `scales` are
    /// theirs. `None` if the set has tolerances already, or if the logs show nothing of any.
    pub(super) fn of(
        (scales, columns): (&Scales, &Columns),
        open: &[usize],
        candidates: &[Candidate],
        set: &Set,
    ) -> Option<Self> {
        if has_tolerances(candidates, set) {
            return None;
        }
        let sharpest = scales.common.last()?;
        // Column, its deviation in units of its prior's, and bounds.
        let mut taken: Vec<(usize, f64, [f64; 2])> = Vec::new();
        let mut members = Vec::new();
        for (c, candidate) in candidates.iter().enumerate() {
            let like = |&s: &usize| candidates[s].label() == candidate.label();
            let Some(named) = open
                .iter()
                .position(like)
                .filter(|_| candidate.is_tolerance)
            else {
                continue;
            };
            let Some(form) = columns.forms.iter().find(|f| f.candidate == named) else {
                continue;
            };
            let mut deviations = vec![0.0; candidate.ranges.len()];
            let first = taken.len();
            for (column, slope) in form.columns().zip(&form.slopes) {
                let Some((p, size)) = *slope else { continue };
                let (range, null) = (candidate.ranges[p], candidate.parameters()[p].null);
                let own = deviation(range, null);
                let factor = own / size;
                if sharpest.gram[(column, column)] * factor * factor < LEAST_INFORMATION {
                    continue;
                }
                deviations[p] = own;
                taken.push((column, factor, range.map(|x| (x - null) / own)));
            }
            if taken.len() > first {
                let ranges = form.begin.iter().zip(&candidate.ranges);
                let begin: Vec<f64> = ranges.map(|(x, r)| x.clamp(r[0], r[1])).collect();
                members.push(Member {
                    candidate: c,
                    values: begin.clone(),
                    begin,
                    deviations,
                    named: (open[named], form.unknowns(&candidates[open[named]])),
                });
            }
        }
        if members.is_empty() {
            return None;
        }
        let own = (0..columns.base).map(|i| (i, 1.0, columns.bounds[i]));
        let all: Vec<(usize, f64, [f64; 2])> = own.chain(taken).collect();
        let (gain, coefficients) = best(&scales.common, columns, &all);
        let base: Vec<usize> = (0..columns.base).collect();
        let (none, _) = scales.best(columns, &base);
        let mut at = columns.base;
        for member in &mut members {
            for (value, deviation) in member.values.iter_mut().zip(&member.deviations) {
                if *deviation > 0.0 {
                    *value += coefficients[at] * deviation;
                    at += 1;
                }
            }
        }
        Some(Self {
            gain: gain - none,
            base: of_values(
                &coefficients[..columns.base],
                set.fitted.hypothesis.free().len(),
            ),
            members,
        })
    }

    /// A set with all tolerances except those of effects that it names, and with its own values
    /// moved by the screening; not fitted yet.
    ///
    /// A set that has some tolerances already gets the others, and its values stay as they are.
    pub(super) fn beside(&self, set: &Set, candidates: &[Candidate]) -> Set {
        if has_tolerances(candidates, set) {
            return self.begun_at_null(set, candidates);
        }
        let mut set = set.clone();
        let fitted = &mut set.fitted;
        let free = fitted.hypothesis.free();
        for (&i, c) in free.iter().zip(&self.base) {
            let u = &fitted.hypothesis.unknowns[i];
            fitted.theta[i] = (fitted.theta[i] + c * u.deviation).clamp(u.bounds[0], u.bounds[1]);
        }
        self.joined(set, candidates, |member| &member.values)
    }

    /// A set with all tolerances except those of effects that it names, each at its null; its own
    /// values stay as they are, and it is not fitted yet.
    ///
    /// Screened values that hold about the trajectory of another model do not hold about the set's
    /// own.
    pub(super) fn begun_at_null(&self, set: &Set, candidates: &[Candidate]) -> Set {
        self.joined(set.clone(), candidates, |member| &member.begin)
    }

    fn joined(&self, mut set: Set, candidates: &[Candidate], values: fn(&Member) -> &[f64]) -> Set {
        for member in self.not_in(&set.candidates.clone()) {
            member.join(&mut set, &candidates[member.candidate], values(member));
        }
        set
    }

    /// The tolerances that some candidates neither name nor include.
    fn not_in<'m>(&'m self, held: &'m [usize]) -> impl Iterator<Item = &'m Member> {
        let is_in = |m: &&Member| held.contains(&m.named.0) || held.contains(&m.candidate);
        self.members.iter().filter(move |m| !is_in(m))
    }
}

/// Best evidence over the scales of some columns, each with its own deviation of the prior, and
/// their coefficients in units of these.
fn best(sums: &[Regression], columns: &Columns, all: &[(usize, f64, [f64; 2])]) -> (f64, Vec<f64>) {
    let n = all.len();
    let which: Vec<usize> = (0..n).collect();
    let bounds: Vec<[f64; 2]> = all.iter().map(|a| a.2).collect();
    let center = |&(i, ..): &(usize, f64, [f64; 2])| {
        if i < columns.base {
            columns.center[i]
        } else {
            0.0
        }
    };
    let center: Vec<f64> = all.iter().map(center).collect();
    let mut best = (f64::NEG_INFINITY, vec![0.0; n]);
    for sum in sums {
        let gram = DMatrix::from_fn(n, n, |i, j| {
            sum.gram[(all[i].0, all[j].0)] * all[i].1 * all[j].1
        });
        let moment = DVector::from_fn(n, |i, _| sum.moment[all[i].0] * all[i].1);
        let found = evidence(&gram, &moment, &which, &center, &bounds);
        let total = sum.log_likelihood + found.gain;
        if total > best.0 {
            best = (total, found.coefficients);
        }
    }
    best
}

/// Evidence of the best few names by one regression, less the price of each but the first.
///
/// This estimates, to first order, what a search upon the present model may reach.
pub(super) fn of_names(scales: &Scales, columns: &Columns, ranked: &[Screened], price: f64) -> f64 {
    let mut which: Vec<usize> = (0..columns.base).collect();
    let (none, _) = scales.best(columns, &which);
    let mut most = 0.0_f64;
    for names in 0..NAMES {
        let with = |s: &Screened| -> Option<Vec<usize>> {
            let more = s.forms.iter().flat_map(|&f| columns.forms[f].columns());
            let more: Vec<usize> = more.filter(|c| !which.contains(c)).collect();
            (!more.is_empty()).then(|| [&which[..], &more].concat())
        };
        let tried = ranked.iter().filter(|s| s.names == 1);
        let tried = tried.take(LEADING).filter_map(with);
        let tried = tried.map(|w| (scales.best(columns, &w).0 - none, w));
        let Some((gain, next)) = tried.max_by(|a, b| a.0.total_cmp(&b.0)) else {
            break;
        };
        most = most.max(gain - price * names as f64);
        which = next;
    }
    most
}

/// As [`deviation`]; 0 for a range of one value.
fn deviation_within(range: [f64; 2], null: f64) -> f64 {
    if range[0] < range[1] {
        deviation(range, null)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::latent_force::columns::Form;

    #[test]
    fn a_range_is_three_deviations() {
        assert!((deviation([0.91, 1.09], 1.0) - 0.03).abs() < 1e-12);
        // A one-sided range as well.
        assert!((deviation([0.0, 0.0045], 0.0) - 0.0015).abs() < 1e-12);
        assert_eq!(deviation_within([0.2, 0.2], 0.0), 0.0);
    }

    #[test]
    fn the_engines_own_error_moves_no_value_of_an_effect_that_tolerances_come_beside() {
        // A value of the study and the engine's error. Beside a name the next value is the name's.
        assert_eq!(of_values(&[0.3, 7.0], 1), [0.3]);
        assert_eq!(of_values(&[0.3], 1), [0.3]);
    }

    /// Columns of one form; the second is unused.
    fn columns() -> Columns {
        Columns {
            linear: Vec::new(),
            base: 0,
            forms: vec![Form {
                candidate: 0,
                begin: vec![0.0],
                slopes: vec![Some((0, 2.0))],
                first: 0,
            }],
            center: vec![0.0; 2],
            bounds: vec![[-9.0, 9.0]; 2],
            complete: true,
        }
    }

    #[test]
    fn a_pair_fitted_with_tolerances_gets_none_of_them_twice() {
        // A dry friction (1) with a tolerance of a delay (5): a bias (2), named at once with the
        // friction, has been removed from the set.
        let member = |candidate, named| Member {
            candidate,
            begin: Vec::new(),
            values: Vec::new(),
            deviations: Vec::new(),
            named: (named, Vec::new()),
        };
        let tolerances = Tolerances {
            gain: 0.0,
            base: Vec::new(),
            members: vec![member(4, 1), member(5, 3), member(6, 2)],
        };
        let joining: Vec<usize> = tolerances.not_in(&[1, 5]).map(|m| m.candidate).collect();
        assert_eq!(joining, [6]);
    }

    #[test]
    fn a_narrow_prior_is_the_regression_on_a_smaller_column() {
        let sum = Regression {
            log_likelihood: -7.0,
            gram: DMatrix::from_row_slice(2, 2, &[40.0, 3.0, 3.0, 5.0]),
            moment: DVector::from_row_slice(&[12.0, 1.0]),
        };
        let (gain, c) = best(&[sum], &columns(), &[(0, 0.1, [-3.0, 3.0])]);
        // g = 40 / 100, b = 1.2: b^2 / (1 + g) / 2 - ln(1 + g) / 2.
        let want = -7.0 + 0.5 * 1.44 / 1.4 - 0.5 * 1.4_f64.ln();
        assert!((gain - want).abs() < 1e-12 && (c[0] - 1.2 / 1.4).abs() < 1e-12);
    }

    #[test]
    fn names_pay_a_price_each_but_the_first() {
        let sum = Regression {
            log_likelihood: 0.0,
            gram: DMatrix::from_diagonal_element(2, 2, 100.0),
            moment: DVector::from_row_slice(&[60.0, 0.0]),
        };
        let ranked = [Screened {
            forms: vec![0],
            names: 1,
            gain: 0.0,
            base: Vec::new(),
            coefficients: Vec::new(),
        }];
        let alone = 0.5 * 3600.0 / 101.0 - 0.5 * 101.0_f64.ln();
        let found = of_names(
            &Scales::known(vec![sum], Vec::new()),
            &columns(),
            &ranked,
            4.0,
        );
        assert!((found - alone).abs() < 1e-9, "{found} {alone}");
    }
}
