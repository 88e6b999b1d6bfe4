//! Ranking of all candidates, and of groups of them, by one linear regression.

use nalgebra::DMatrix;

use crate::candidate::Candidate;

use super::columns::Columns;
use super::context::Context;
use super::estimate::Estimate;
use super::evidence::evidence;
use super::fit::{SCALES, regression};
use super::smoother::Regression;

/// Evidence by which a group must beat the best of its members.
const GROUP: f64 = 3.0;

/// Candidates that may be missing together, with the evidence for them upon the present model.
#[derive(Clone, Debug)]
pub struct Screened {
    /// Forms of the candidates; see [`Columns::forms`].
    pub forms: Vec<usize>,
    /// Evidence over the present model, natural logarithm; a round adds the prior odds.
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
pub(super) fn over_scales(
    sums: &[Regression],
    columns: &Columns,
    which: &[usize],
) -> (f64, Vec<f64>) {
    let mut best = (f64::NEG_INFINITY, Vec::new());
    for sum in sums {
        let found = evidence(
            &sum.gram,
            &sum.moment,
            which,
            &columns.center,
            &columns.bounds,
        );
        let total = sum.log_likelihood + found.gain;
        if total > best.0 {
            best = (total, found.coefficients);
        }
    }
    best
}

/// Ranks all candidates, and the groups of one effect at all its sites, best first.
pub fn rank(sums: &[Regression], columns: &Columns, candidates: &[Candidate]) -> Vec<Screened> {
    let base: Vec<usize> = (0..columns.base).collect();
    let (none, _) = over_scales(sums, columns, &base);
    let try_forms = |forms: &[usize]| {
        let mut which = base.clone();
        forms
            .iter()
            .for_each(|&f| which.extend(columns.forms[f].columns()));
        let (total, coefficients) = over_scales(sums, columns, &which);
        let mut at = base.len();
        let each = forms.iter().map(|&f| {
            let n = columns.forms[f].slopes.len();
            let own = coefficients
                .get(at..at + n)
                .map_or_else(Vec::new, <[f64]>::to_vec);
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
        if members.len() < 2 {
            continue;
        }
        // A group that is one of its members with idle ones is not tried apart.
        let alone = singles
            .iter()
            .filter(|s| members.contains(&s.forms[0]))
            .map(|s| s.gain)
            .fold(f64::NEG_INFINITY, f64::max);
        let group = try_forms(&members);
        if group.gain > alone + GROUP {
            all.push(group);
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
pub(super) fn project(gram: &DMatrix<f64>, out: &[usize]) -> DMatrix<f64> {
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

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::super::columns::Form;
    use super::*;

    /// Isolability of forms of some widths, whose columns `x` follow `base` columns of the model.
    fn isolability_of(x: &DMatrix<f64>, base: usize, widths: &[usize]) -> DMatrix<f64> {
        let mut first = base;
        let forms = widths.iter().map(|&n| {
            first += n;
            Form {
                candidate: 0,
                begin: Vec::new(),
                slopes: vec![None; n],
                first: first - n,
            }
        });
        let columns = Columns {
            linear: Vec::new(),
            base,
            forms: forms.collect(),
            center: vec![0.0; x.ncols()],
            bounds: vec![[-1.0, 1.0]; x.ncols()],
            complete: true,
        };
        let sum = Regression {
            log_likelihood: 0.0,
            gram: x.transpose() * x,
            moment: DVector::zeros(x.ncols()),
        };
        let all: Vec<usize> = (0..widths.len()).collect();
        isolability(&sum, &columns, &all)
    }

    #[test]
    fn the_same_direction_cannot_be_told_apart_and_orthogonal_ones_have_nothing_in_common() {
        let x = DMatrix::from_columns(&[
            DVector::from_row_slice(&[1.0, 2.0, 0.0, 0.0]),
            DVector::from_row_slice(&[-3.0, -6.0, 0.0, 0.0]),
            DVector::from_row_slice(&[0.0, 0.0, 1.0, 0.0]),
            // 60 degrees from the last.
            DVector::from_row_slice(&[0.0, 0.0, 0.5, 0.75_f64.sqrt()]),
        ]);
        let found = isolability_of(&x, 0, &[1; 4]);
        let want = [
            [1.0, 1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.5],
            [0.0, 0.0, 0.5, 1.0],
        ];
        for (i, row) in want.iter().enumerate() {
            for (j, want) in row.iter().enumerate() {
                assert!((found[(i, j)] - want).abs() < 1e-12, "{found}");
            }
        }
    }

    #[test]
    fn of_planes_it_is_the_cosine_of_the_smallest_angle_between_them() {
        // The first plane spans x and y, the second a line at 30 degrees above it and one in y + w: the angle
        // nearest to zero decides. A column that does nothing spans nothing.
        let (s, c) = 30.0_f64.to_radians().sin_cos();
        let x = DMatrix::from_columns(&[
            DVector::from_row_slice(&[1.0, 1.0, 0.0, 0.0]),
            DVector::from_row_slice(&[1.0, -2.0, 0.0, 0.0]),
            DVector::from_row_slice(&[c, 0.0, s, 0.0]),
            DVector::from_row_slice(&[0.0, 1.0, 0.0, 1.0]),
            DVector::zeros(4),
        ]);
        let found = isolability_of(&x, 0, &[2, 2, 1]);
        assert!((found[(0, 1)] - c).abs() < 1e-12, "{found}");
        assert!((found[(1, 0)] - c).abs() < 1e-12, "{found}");
        assert_eq!(found[(0, 2)], 0.0);
        assert_eq!(found[(2, 2)], 0.0);
    }

    #[test]
    fn what_the_present_model_explains_is_projected_out() {
        // Two candidates share much of what the base can do, and nothing else.
        let x = DMatrix::from_columns(&[
            DVector::from_row_slice(&[1e4, 0.0, 0.0]),
            DVector::from_row_slice(&[5.0, 1.0, 0.0]),
            DVector::from_row_slice(&[5.0, 0.0, 1.0]),
        ]);
        let alone = isolability_of(&x.columns(1, 2).into_owned(), 0, &[1; 2]);
        assert!((alone[(0, 1)] - 25.0 / 26.0).abs() < 1e-12);
        let found = isolability_of(&x, 1, &[1; 2]);
        // A prior deviation of 1 leaves 5^2 / (1 + 1e8) of what is shared.
        assert!(found[(0, 1)] < 1e-6, "{found}");
        assert!((found[(1, 1)] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn projecting_out_is_the_noise_that_uncertain_coefficients_add() {
        // X' (I + Z Z')^-1 X with Z the columns that are out: their coefficients are N(0, 1).
        let x = DMatrix::from_fn(5, 4, |i, j| ((3 * i + 7 * j * j + i * j) % 11) as f64 - 5.0);
        let z = x.columns(0, 2);
        let covariance = DMatrix::identity(5, 5) + z * z.transpose();
        let want = x.transpose() * covariance.cholesky().unwrap().solve(&x);
        let found = project(&(x.transpose() * &x), &[0, 1]);
        assert!((found - want).amax() < 1e-10);
    }
}
