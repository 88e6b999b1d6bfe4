//! Additive model of piecewise linear functions (Hastie and Tibshirani 1986), fitted by normal
//! equations.
//!
//! The sums of the equations are stored part by part, so that a part is left out by subtraction.

use nalgebra::{DMatrix, DVector};

use super::Course;

/// Number of knots of each variable's function, at quantiles of its values.
///
/// Ten follow a friction law about rest as well as the curve of a spring; more need rows that short
/// logs do not have.
const KNOTS: usize = 10;
/// Precisions of the prior that are tried, relative to the mean square of a basis function times
/// the rows.
///
/// They reach from nearly none to one that leaves a tenth of a law.
const PRIORS: [f64; 4] = [1e-4, 1e-2, 1.0, 10.0];
/// Number of parts of a single episode, each of which is left out in turn.
const PARTS: usize = 4;

/// Sums of one part of the rows: `X'X`, `X'y` and `y'y`.
#[derive(Clone)]
pub(super) struct Sums {
    gram: DMatrix<f64>,
    moment: DVector<f64>,
    power: f64,
}

/// Returns the values at `x` of the hat functions about `knots`, of which at most two are not zero.
fn hats(knots: &[f64], x: f64) -> [(usize, f64); 2] {
    let last = knots.len() - 1;
    let above = knots.partition_point(|k| *k <= x);
    if above == 0 || last == 0 {
        return [(0, 1.0), (0, 0.0)];
    }
    if above > last {
        return [(last, 1.0), (last, 0.0)];
    }
    let (low, high) = (knots[above - 1], knots[above]);
    let share = (x - low) / (high - low);
    [(above - 1, 1.0 - share), (above, share)]
}

/// Returns knots at quantiles of some values, without duplicates.
pub(super) fn knots(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all: Vec<f64> = values.filter(|x| x.is_finite()).collect();
    if all.is_empty() {
        return vec![0.0];
    }
    all.sort_by(f64::total_cmp);
    let at = |k: usize| all[(all.len() - 1) * k / (KNOTS - 1)];
    let mut knots: Vec<f64> = (0..KNOTS).map(at).collect();
    knots.dedup();
    knots
}

/// Returns the sums of the parts of all episodes; each variable has one column per knot.
pub(super) fn sums(courses: &[Course], knots: &[Vec<f64>]) -> Vec<Sums> {
    let width: usize = knots.iter().map(Vec::len).sum();
    let parts = if courses.len() > 1 { 1 } else { PARTS };
    let empty = Sums {
        gram: DMatrix::zeros(width, width),
        moment: DVector::zeros(width),
        power: 0.0,
    };
    let mut all = vec![empty; parts * courses.len()];
    let mut row: Vec<(usize, f64)> = Vec::new();
    for (e, course) in courses.iter().enumerate() {
        let n = course.left.len();
        for (k, y) in course.left.iter().enumerate() {
            let is_whole = course.variables.iter().all(|v| v.values[k].is_finite());
            if !y.is_finite() || !is_whole {
                continue;
            }
            row.clear();
            let mut first = 0;
            for (v, knots) in course.variables.iter().zip(knots) {
                row.extend(hats(knots, v.values[k]).map(|(i, x)| (first + i, x)));
                first += knots.len();
            }
            let sums = &mut all[e * parts + k * parts / n];
            sums.power += y * y;
            for &(i, a) in &row {
                sums.moment[i] += a * y;
                for &(j, b) in &row {
                    sums.gram[(i, j)] += a * b;
                }
            }
        }
    }
    all
}

/// Returns the share of power that the columns `which` predict, of parts left out in turn, with the
/// best of the priors.
pub(super) fn foretold(parts: &[Sums], which: &[usize]) -> f64 {
    let total: f64 = parts.iter().map(|p| p.power).sum();
    if total <= 0.0 || which.is_empty() {
        return 0.0;
    }
    let n = which.len();
    let gram = |p: &Sums| DMatrix::from_fn(n, n, |i, j| p.gram[(which[i], which[j])]);
    let moment = |p: &Sums| DVector::from_fn(n, |i, _| p.moment[which[i]]);
    let each: Vec<_> = parts.iter().map(|p| (gram(p), moment(p))).collect();
    let mut whole = (DMatrix::zeros(n, n), DVector::zeros(n));
    for (gram, moment) in &each {
        whole.0 += gram;
        whole.1 += moment;
    }
    let typical = whole.0.trace() / n as f64;
    let left = |prior: f64| -> f64 {
        let of_part = |((gram, moment), part): (&(DMatrix<f64>, DVector<f64>), &Sums)| {
            let mut others = &whole.0 - gram;
            for i in 0..n {
                others[(i, i)] += (prior * typical).max(f64::MIN_POSITIVE);
            }
            let found = others.cholesky().map(|f| f.solve(&(&whole.1 - moment)));
            let c = found.unwrap_or_else(|| DVector::zeros(n));
            part.power - 2.0 * c.dot(moment) + c.dot(&(gram * &c))
        };
        each.iter().zip(parts).map(of_part).sum()
    };
    let least = PRIORS.map(left).into_iter().fold(total, f64::min);
    (1.0 - least / total).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hats_are_a_partition_of_one_and_follow_lines() {
        let knots = [-1.0, 0.5, 2.0];
        for x in [-3.0, -1.0, -0.2, 0.5, 1.9, 2.0, 9.0] {
            let found = hats(&knots, x);
            let sum: f64 = found.iter().map(|h| h.1).sum();
            let line: f64 = found.iter().map(|&(i, h)| h * knots[i]).sum();
            assert!((sum - 1.0).abs() < 1e-12);
            assert!((line - f64::clamp(x, -1.0, 2.0)).abs() < 1e-12);
        }
    }
}
