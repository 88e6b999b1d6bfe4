//! What the screening would report for machines like this one: with nothing missing, and with one
//! effect missing.
//!
//! The screening is a linear problem: whitened innovations are `X c` plus normal noise, and it uses
//! only `X'y`. So drawing logs under the same commands needs no simulation: `X'y = G c + z` with
//! `z ~ N(0, G)` and `G = X'X`, the present model projected out. Each draw is screened as the logs
//! were, at every scale of the missing force's variances.

mod at_scale;

use asid_core::Streams;
use nalgebra::{DMatrix, DVector};
use rand::Rng as _;
use rand_distr::StandardNormal;

use super::columns::Columns;
use super::detection::Limit;
use super::scales::{OneScale, Scales};
use super::screen::project;

use at_scale::{AtScale, behind};

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
fn projected(gram: &DMatrix<f64>, base: usize) -> DMatrix<f64> {
    let places: Vec<usize> = (0..base).collect();
    let mut gram = project(gram, &places);
    for i in 0..base {
        gram.row_mut(i).fill(0.0);
        gram.column_mut(i).fill(0.0);
    }
    gram
}

/// Rehearses a screening; `found` is the evidence of its best candidate.
///
/// This evidence and that of the draws include the prior odds of each form, of which `odds` holds
/// the logarithms. Logs are drawn at the most likely of the common scales. Chance counts at every
/// scale that the screening compares; candidates are ranked at the one of the draws.
#[must_use]
pub fn rehearse(
    scales: &Scales,
    (columns, odds): (&Columns, &[f64]),
    (limits, found): (&[Limit], f64),
    seed: u64,
) -> Rehearsal {
    let n = columns.bounds.len();
    let unknown = Rehearsal {
        p_value: f64::NAN,
        recognised: vec![None; limits.len()],
    };
    if n == columns.base || n > COLUMNS {
        return unknown;
    }
    let all = scales.each();
    let likely = |a: &&OneScale<'_>, b: &&OneScale<'_>| {
        (a.sum.log_likelihood).total_cmp(&b.sum.log_likelihood)
    };
    let Some(drawn) = all.iter().take(scales.common.len()).max_by(likely) else {
        return unknown;
    };
    let none = all.iter().map(|at| behind(at, columns));
    let none = none.fold(f64::NEG_INFINITY, f64::max);
    let seen = |at, found| AtScale::of(at, (columns, odds), (drawn.scale, none), found);
    let Some(own) = seen(drawn, f64::NEG_INFINITY) else {
        return unknown;
    };
    let mut random = Streams::new(seed).stream("rehearsal");
    let draws: Vec<DVector<f64>> = (0..NOTHING_MISSING)
        .map(|_| DVector::from_fn(n, |_, _| random.sample::<f64, _>(StandardNormal)))
        .collect();
    let views: Vec<AtScale<'_>> = all.iter().filter_map(|at| seen(at, found)).collect();
    let reaches = |draw: &&DVector<f64>| {
        let mut views = views.iter();
        views.any(|view| view.best(&view.moment(draw)).0 >= found)
    };
    let as_much = draws.iter().filter(reaches).count();
    let noise: Vec<DVector<f64>> = draws
        .iter()
        .take(ONE_MISSING)
        .map(|z| own.moment(z))
        .collect();
    let recognised = limits.iter().map(|limit| {
        if !limit.coefficient.is_finite() || limit.value.is_nan() {
            return None;
        }
        let shown = own.gram.column(limit.column) * (SIZE * limit.coefficient);
        let named: Vec<usize> = noise.iter().map(|z| own.best(&(&shown + z)).1).collect();
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
mod tests;
