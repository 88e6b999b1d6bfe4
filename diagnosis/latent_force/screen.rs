//! Ranking of all candidates, and of groups of them, by one linear regression.

use nalgebra::DMatrix;

use crate::candidate::Candidate;

use super::columns::Columns;
use super::estimate::{Context, Estimate};
use super::evidence::evidence;
use super::fit::{SCALES, regression};
use super::smoother::Regression;

/// Candidates that may be missing together, with the evidence for them upon the present model.
#[derive(Clone, Debug)]
pub struct Screened {
    /// Forms of the candidates; see [`Columns::forms`].
    pub forms: Vec<usize>,
    /// Evidence over the present model, natural logarithm.
    pub gain: f64,
    /// Coefficients of the present model's unknowns.
    pub base: Vec<f64>,
    /// Coefficients of each form.
    pub coefficients: Vec<Vec<f64>>,
}

/// The regressions at all scales of `q`.
pub fn regressions(
    context: &Context<'_>,
    estimate: &Estimate,
    columns: &Columns,
) -> Vec<Regression> {
    let m = columns.center.len();
    SCALES
        .iter()
        .map(|&scale| regression(context, estimate, &columns.linear, scale, m))
        .collect()
}

/// Best evidence of some columns over the scales, with coefficients.
fn over_scales(
    sums: &[Regression],
    columns: &Columns,
    which: &[usize],
) -> (f64, Vec<f64>) {
    let mut best = (f64::NEG_INFINITY, Vec::new());
    for sum in sums {
        let found = evidence(&sum.gram, &sum.moment, which, &columns.center, &columns.bounds);
        let total = sum.log_likelihood + found.gain;
        if total > best.0 {
            best = (total, found.coefficients);
        }
    }
    best
}

/// Ranks all candidates, and the groups of one effect at all its sites, best first.
pub fn rank(
    sums: &[Regression],
    columns: &Columns,
    candidates: &[Candidate],
) -> Vec<Screened> {
    let base: Vec<usize> = (0..columns.base).collect();
    let (none, _) = over_scales(sums, columns, &base);
    let try_forms = |forms: &[usize]| {
        let mut which = base.clone();
        forms.iter().for_each(|&f| which.extend(columns.forms[f].columns()));
        let (total, coefficients) = over_scales(sums, columns, &which);
        let mut at = base.len();
        let each = forms.iter().map(|&f| {
            let n = columns.forms[f].slopes.len();
            let own = coefficients.get(at..at + n).map_or_else(Vec::new, <[f64]>::to_vec);
            at += n;
            own
        });
        let each: Vec<Vec<f64>> = each.collect();
        Screened {
            forms: forms.to_vec(),
            gain: total - none,
            base: coefficients.get(..base.len()).unwrap_or(&[]).to_vec(),
            coefficients: each,
        }
    };
    let singles: Vec<Screened> = (0..columns.forms.len()).map(|f| try_forms(&[f])).collect();
    // The best form of each candidate.
    let mut best: Vec<Option<&Screened>> = vec![None; candidates.len()];
    for s in &singles {
        let c = columns.forms[s.forms[0]].candidate;
        if best[c].is_none_or(|b| s.gain > b.gain) {
            best[c] = Some(s);
        }
    }
    let mut all: Vec<Screened> = best.iter().flatten().map(|s| (*s).clone()).collect();
    let mut names: Vec<&str> = candidates.iter().map(|c| &*c.spec.name).collect();
    names.dedup();
    for name in names {
        let members: Vec<usize> = best
            .iter()
            .enumerate()
            .filter(|(c, _)| candidates[*c].spec.name == name)
            .filter_map(|(_, s)| s.map(|s| s.forms[0]))
            .collect();
        if members.len() > 1 {
            all.push(try_forms(&members));
        }
    }
    all.retain(|s| s.gain.is_finite());
    all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    all
}

/// Cosines of the largest principal angles between candidates' columns, the present model's projected out: 1 where two
/// cannot be told apart by these logs, 0 where they have nothing in common. One row and column a form.
#[must_use]
pub fn isolability(sum: &Regression, columns: &Columns, forms: &[usize]) -> DMatrix<f64> {
    let base: Vec<usize> = (0..columns.base).collect();
    let gram = project(&sum.gram, &base);
    let basis = |f: usize| -> DMatrix<f64> {
        let own: Vec<usize> = columns.forms[f].columns().collect();
        let part = DMatrix::from_fn(own.len(), own.len(), |i, j| gram[(own[i], own[j])]);
        let eigen = part.symmetric_eigen();
        let largest = eigen.eigenvalues.max().max(f64::MIN_POSITIVE);
        let mut out = DMatrix::zeros(gram.nrows(), own.len());
        for (k, value) in eigen.eigenvalues.iter().enumerate() {
            if *value > 1e-9 * largest {
                for (i, &o) in own.iter().enumerate() {
                    out[(o, k)] = eigen.eigenvectors[(i, k)] / value.sqrt();
                }
            }
        }
        out
    };
    let bases: Vec<DMatrix<f64>> = forms.iter().map(|&f| basis(f)).collect();
    DMatrix::from_fn(forms.len(), forms.len(), |i, j| {
        let cross = bases[i].transpose() * &gram * &bases[j];
        cross.singular_values().max().min(1.0)
    })
}

/// A Gram matrix with some columns projected out of all.
fn project(gram: &DMatrix<f64>, out: &[usize]) -> DMatrix<f64> {
    if out.is_empty() {
        return gram.clone();
    }
    let n = gram.nrows();
    let own = DMatrix::from_fn(out.len(), out.len(), |i, j| {
        gram[(out[i], out[j])] + if i == j { 1.0 } else { 0.0 }
    });
    let cross = DMatrix::from_fn(out.len(), n, |i, j| gram[(out[i], j)]);
    match own.cholesky() {
        Some(factor) => gram - cross.transpose() * factor.solve(&cross),
        None => gram.clone(),
    }
}

