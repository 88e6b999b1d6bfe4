//! Ranks all candidates, groups of them and pairs of them by one linear regression.

use std::collections::BTreeSet;

use nalgebra::DMatrix;

use crate::candidate::Candidate;

use super::columns::Columns;
use super::scales::Scales;
use super::smoother::Regression;

/// Evidence by which a group must beat its best member, and a pair the sum of its two members.
const MORE: f64 = 3.0;
/// Number of leading single candidates that are paired with others.
const FIRSTS: usize = 40;
/// Largest number of pairs that are kept.
const PAIRS: usize = 3;

/// Which pairs of candidates are offered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pairs {
    /// Two candidates at one joint that together earn more evidence than the sum of the two.
    ///
    /// Two frictions are an example: fitted alone, each leaves the force of the other to the noise
    /// model. A pair that is no better than the sum is found one name after the other.
    BeyondTheSum,
    /// Two candidates at any joints that together earn more evidence than the better one.
    ///
    /// Where the logs show nearly all of the force, each candidate alone already shows most of its
    /// evidence.
    BeyondTheBetter,
}

/// Candidates that may be missing together, with their evidence relative to the present model.
#[derive(Clone, Debug)]
pub struct Screened {
    /// Forms of the candidates; see [`Columns::forms`].
    pub forms: Vec<usize>,
    /// Number of names: a group counts once.
    pub names: usize,
    /// Evidence relative to the present model, natural logarithm; a round adds the prior odds.
    pub gain: f64,
    /// Coefficients of the present model's unknowns.
    pub base: Vec<f64>,
    /// Coefficients of each form.
    pub coefficients: Vec<Vec<f64>>,
}

impl Screened {
    /// The evidence, less the `price` of each name after the first.
    #[must_use]
    pub fn worth(&self, price: f64) -> f64 {
        self.gain - price * self.names.saturating_sub(1) as f64
    }
}

/// State of one ranking by regressions.
struct Ranking<'r> {
    scales: &'r Scales,
    columns: &'r Columns,
    candidates: &'r [Candidate],
    /// Columns of the present model, and the evidence of these columns alone.
    base: Vec<usize>,
    none: f64,
}

impl Ranking<'_> {
    /// Returns the evidence of some forms together; they count as `names` names.
    fn screened(&self, forms: &[usize], names: usize) -> Screened {
        let mut which = self.base.clone();
        let own = forms.iter().flat_map(|&f| self.columns.forms[f].columns());
        which.extend(own);
        let (total, coefficients) = self.scales.best(self.columns, &which);
        let mut at = self.base.len();
        let each = forms.iter().map(|&f| {
            let n = self.columns.forms[f].slopes.len();
            let own = coefficients
                .get(at..at + n)
                .map_or_else(Vec::new, <[f64]>::to_vec);
            at += n;
            own
        });
        Screened {
            forms: forms.to_vec(),
            names,
            gain: total - self.none,
            coefficients: each.collect(),
            base: coefficients.get(..self.base.len()).unwrap_or(&[]).to_vec(),
        }
    }

    /// Returns each candidate by itself, in its best form.
    fn singles(&self) -> Vec<Screened> {
        let mut best: Vec<Option<Screened>> = vec![None; self.candidates.len()];
        for (f, form) in self.columns.forms.iter().enumerate() {
            let found = self.screened(&[f], 1);
            let own = &mut best[form.candidate];
            if own.as_ref().is_none_or(|b| found.gain > b.gain) {
                *own = Some(found);
            }
        }
        let mut singles: Vec<Screened> = best.into_iter().flatten().collect();
        singles.retain(|s| s.gain.is_finite());
        singles
    }

    /// Returns groups of one effect at all its sites, if they beat their best member by [`MORE`].
    ///
    /// A group that is one active member with idle others does not pass this test.
    fn groups(&self, singles: &[Screened]) -> Vec<Screened> {
        let name = |s: &Screened| {
            &*self.candidates[self.columns.forms[s.forms[0]].candidate]
                .spec
                .name
        };
        let names: BTreeSet<&str> = singles.iter().map(name).collect();
        let group = |law: &str| {
            let members: Vec<&Screened> = singles.iter().filter(|s| name(s) == law).collect();
            let forms: Vec<usize> = members.iter().map(|s| s.forms[0]).collect();
            let alone = members.iter().map(|s| s.gain);
            let alone = alone.fold(f64::NEG_INFINITY, f64::max);
            (forms.len() > 1)
                .then(|| self.screened(&forms, 1))
                .filter(|g| g.gain > alone + MORE)
        };
        names.into_iter().filter_map(group).collect()
    }

    /// Returns the best pairs; a further name costs `price`.
    fn pairs(&self, singles: &[Screened], (which, price): (Pairs, f64)) -> Vec<Screened> {
        let mut order: Vec<&Screened> = singles.iter().collect();
        order.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let mut pairs = Vec::new();
        for (i, first) in order.iter().take(FIRSTS).enumerate() {
            let last = match which {
                Pairs::BeyondTheSum => order.len(),
                Pairs::BeyondTheBetter => order.len().min(FIRSTS),
            };
            for second in &order[(i + 1).min(last)..last] {
                let own = [first, second].map(|s| self.columns.forms[s.forms[0]].columns());
                let own: Vec<usize> = own.into_iter().flatten().collect();
                if which == Pairs::BeyondTheSum && !self.scales.at_one_joint(&own) {
                    continue;
                }
                let pair = self.screened(&[first.forms[0], second.forms[0]], 2);
                let least = match which {
                    Pairs::BeyondTheSum => first.gain.max(0.0) + second.gain.max(0.0),
                    Pairs::BeyondTheBetter => first.gain.max(second.gain) + price,
                };
                if pair.gain > least + MORE {
                    pairs.push(pair);
                }
            }
        }
        pairs.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        pairs.truncate(PAIRS);
        pairs
    }
}

/// Ranks candidates, groups of one effect at all its sites, and pairs, best first.
///
/// The order is by evidence less the `price` of each further name.
pub fn rank(
    scales: &Scales,
    columns: &Columns,
    candidates: &[Candidate],
    (pairs, price): (Pairs, f64),
) -> Vec<Screened> {
    let base: Vec<usize> = (0..columns.base).collect();
    let ranking = Ranking {
        scales,
        columns,
        candidates,
        none: scales.best(columns, &base).0,
        base,
    };
    let singles = ranking.singles();
    let mut all = ranking.groups(&singles);
    all.extend(ranking.pairs(&singles, (pairs, price)));
    all.extend(singles);
    all.retain(|s| s.gain.is_finite());
    all.sort_by(|a, b| b.worth(price).total_cmp(&a.worth(price)));
    all
}

/// Cosine of the smallest principal angle between the columns of each two forms.
///
/// The present model's columns are projected out. A cosine of 1 means that these logs cannot
/// separate the two; 0 means that they have nothing in common. The matrix has one row and one
/// column per form.
#[must_use]
pub fn isolability(sum: &Regression, columns: &Columns, forms: &[usize]) -> DMatrix<f64> {
    let base: Vec<usize> = (0..columns.base).collect();
    let gram = project(&sum.gram, &base);
    let block =
        |a: &[usize], b: &[usize]| DMatrix::from_fn(a.len(), b.len(), |i, j| gram[(a[i], b[j])]);
    // The columns of each form, and the matrix that makes them orthonormal.
    let basis = |&f: &usize| -> (Vec<usize>, DMatrix<f64>) {
        let own: Vec<usize> = columns.forms[f].columns().collect();
        let eigen = block(&own, &own).symmetric_eigen();
        let largest = eigen.eigenvalues.max().max(f64::MIN_POSITIVE);
        let mut out = DMatrix::zeros(own.len(), own.len());
        for (k, value) in eigen.eigenvalues.iter().enumerate() {
            if *value > 1e-9 * largest {
                out.set_column(k, &(eigen.eigenvectors.column(k) / value.sqrt()));
            }
        }
        (own, out)
    };
    let bases: Vec<(Vec<usize>, DMatrix<f64>)> = forms.iter().map(basis).collect();
    DMatrix::from_fn(forms.len(), forms.len(), |i, j| {
        let [(a, left), (b, right)] = [&bases[i], &bases[j]];
        let cross = left.transpose() * block(a, b) * right;
        cross.singular_values().max().min(1.0)
    })
}

/// A Gram matrix with the columns `out` projected out of all others.
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

    /// Sums of `n` orthogonal columns, each with the information `g` and the moment `b`.
    fn orthogonal(log_likelihood: f64, n: usize, (g, b): (f64, f64)) -> Regression {
        Regression {
            log_likelihood,
            gram: DMatrix::from_diagonal_element(n, n, g),
            moment: DVector::from_element(n, b),
        }
    }

    /// Columns of `n` candidates with one each.
    fn of_one_column_each(n: usize) -> Columns {
        let forms = (0..n).map(|c| Form {
            candidate: c,
            begin: Vec::new(),
            slopes: vec![Some((0, 1.0))],
            first: c,
        });
        Columns {
            linear: Vec::new(),
            base: 0,
            forms: forms.collect(),
            center: vec![0.0; n],
            bounds: vec![[-9.0, 9.0]; n],
            complete: true,
        }
    }

    #[test]
    fn two_laws_of_one_joint_are_seen_together_where_neither_is_by_itself() {
        // Forms 0 and 1 act at one joint, form 2 at another. At the present noise each column alone
        // earns next to nothing. A smaller variance at the first joint lowers the log-likelihood by
        // 50, and each of its two laws gains 0.5 * 100^2 / 101.
        let columns = of_one_column_each(3);
        let smaller = [0, 2].map(|first| {
            let own: Vec<usize> = (first..3.min(first + 2)).collect();
            let sums = orthogonal(-50.0, own.len(), (100.0, 100.0));
            (own, vec![sums])
        });
        let ranking = Ranking {
            scales: &Scales::known(vec![orthogonal(0.0, 3, (1.0, 0.1))], smaller.into()),
            columns: &columns,
            candidates: &[],
            base: Vec::new(),
            none: 0.0,
        };
        let singles: Vec<Screened> = (0..3).map(|f| ranking.screened(&[f], 1)).collect();
        assert!(singles.iter().all(|s| s.gain < 0.0), "{singles:?}");
        let pairs = ranking.pairs(&singles, (Pairs::BeyondTheSum, 4.0));
        assert_eq!(pairs.len(), 1);
        let each = 0.5 * 1e4 / 101.0 - 0.5 * 101.0_f64.ln();
        assert!((pairs[0].gain - (2.0 * each - 50.0)).abs() < 1e-9);
        assert_eq!((&pairs[0].forms[..], pairs[0].names), (&[0, 1][..], 2));
        assert!((pairs[0].worth(4.0) - (pairs[0].gain - 4.0)).abs() < 1e-12);
    }

    /// Symptom: on a machine with one joint two frictions were never tried together, and the
    /// verdict was that the cause is unknown. Cause: pairs were looked for at joints with scales of
    /// their own, and the only joint needs none.
    #[test]
    fn two_laws_of_the_only_joint_are_seen_together_too() {
        // As above, with the smaller variance at a common scale.
        let scales = [(0.0, (1.0, 0.1)), (-50.0, (100.0, 100.0))];
        let common = scales.map(|(log_likelihood, each)| orthogonal(log_likelihood, 2, each));
        let ranking = Ranking {
            scales: &Scales::of_the_only_joint(common.into(), vec![0, 1]),
            columns: &of_one_column_each(2),
            candidates: &[],
            base: Vec::new(),
            none: 0.0,
        };
        let singles: Vec<Screened> = (0..2).map(|f| ranking.screened(&[f], 1)).collect();
        assert!(singles.iter().all(|s| s.gain < 0.0), "{singles:?}");
        let pairs = ranking.pairs(&singles, (Pairs::BeyondTheSum, 4.0));
        let each = 0.5 * 1e4 / 101.0 - 0.5 * 101.0_f64.ln();
        assert_eq!(pairs.len(), 1);
        assert!((pairs[0].gain - (2.0 * each - 50.0)).abs() < 1e-9);
    }

    #[test]
    fn the_same_direction_cannot_be_told_apart_and_orthogonal_ones_have_nothing_in_common() {
        let x = DMatrix::from_columns(&[
            DVector::from_row_slice(&[1.0, 2.0, 0.0, 0.0]),
            DVector::from_row_slice(&[-3.0, -6.0, 0.0, 0.0]),
            DVector::from_row_slice(&[0.0, 0.0, 1.0, 0.0]),
            // 60 degrees from the column before.
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
        // The first plane spans x and y. The second is spanned by a line 30 degrees above the first
        // and by y + w. The smallest angle decides. A zero column spans nothing.
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
        // Two candidates share only what the base also explains.
        let x = DMatrix::from_columns(&[
            DVector::from_row_slice(&[1e4, 0.0, 0.0]),
            DVector::from_row_slice(&[5.0, 1.0, 0.0]),
            DVector::from_row_slice(&[5.0, 0.0, 1.0]),
        ]);
        let alone = isolability_of(&x.columns(1, 2).into_owned(), 0, &[1; 2]);
        assert!((alone[(0, 1)] - 25.0 / 26.0).abs() < 1e-12);
        let found = isolability_of(&x, 1, &[1; 2]);
        // A prior standard deviation of 1 leaves 5^2 / (1 + 1e8) of the shared part.
        assert!(found[(0, 1)] < 1e-6, "{found}");
        assert!((found[(1, 1)] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn projecting_out_is_the_noise_that_uncertain_coefficients_add() {
        // X' (I + Z Z')^-1 X, where Z are the columns projected out, with coefficients N(0, 1).
        let x = DMatrix::from_fn(5, 4, |i, j| ((3 * i + 7 * j * j + i * j) % 11) as f64 - 5.0);
        let z = x.columns(0, 2);
        let covariance = DMatrix::identity(5, 5) + z * z.transpose();
        let want = x.transpose() * covariance.cholesky().unwrap().solve(&x);
        let found = project(&(x.transpose() * &x), &[0, 1]);
        assert!((found - want).amax() < 1e-10);
    }
}
