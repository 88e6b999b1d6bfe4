//! The steps that a candidate proposes: linear fits of what it does to what is left.

use asid_core::{Parameter, Result};

use super::Base;
use crate::bench::{Bench, Trial};
use crate::candidate::Candidate;
use crate::fit::{Unknown, cost};
use crate::linearise::{NOTHING, nudged};
use crate::nuisance::dot;
use crate::predict::{Point, Predictor};
use crate::record::Record;

/// A candidate at one of its starts, linearised and fitted.
pub(super) struct Line<'l> {
    /// Values of its parameters.
    pub(super) start: &'l [f64],
    /// Those that have slopes.
    pub(super) slopes: &'l [usize],
    /// What they do, per share of their range.
    pub(super) columns: &'l [Vec<f64>],
    /// How much of each the fit takes.
    pub(super) weights: Vec<f64>,
    /// What each parameter before it has to move in exchange.
    pub(super) moves: Vec<Vec<f64>>,
}

/// Shares of a proposed step that are tried.
const LENGTHS: [f64; 3] = [1.0, 0.5, 0.2];

/// A step that the linear fit proposes for a candidate.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// Index of the candidate.
    pub candidate: usize,
    /// Sum of squares that it takes off to first order.
    pub gain: f64,
    /// Points that are worth a rollout.
    pub(super) points: Vec<Point>,
}

/// Proposals of one candidate, one a start that gains at all.
///
/// # Errors
/// When a rollout fails.
pub fn propose(
    bench: &Bench,
    record: &Record,
    base: &Base<'_>,
    (index, candidate): (usize, &Candidate),
) -> Result<Vec<Proposal>> {
    let mut trials: Vec<Trial<'_>> = base.trials.clone();
    trials.push((candidate, Vec::new()));
    let mut predictor = bench.predictor(&trials, record)?;
    let own: Vec<Unknown> = bench.unknowns(&trials).split_off(base.unknowns.len());
    let slopes = candidate.slopes();
    let mut proposals = Vec::new();
    let mut shares = vec![base.first; own.len()];
    for start in &candidate.starts {
        let columns = columns(&mut predictor, base, &own, start, &mut shares, &slopes)?;
        let mut projected = columns.clone();
        let moves: Vec<Vec<f64>> = projected
            .iter_mut()
            .map(|c| base.nuisance.project(c))
            .collect();
        let room: Vec<[f64; 2]> = if slopes.is_empty() {
            vec![[0.0, 1.5]]
        } else {
            slopes
                .iter()
                .map(|&j| {
                    let u = own[j].parameter.to_unit(start[j]);
                    [-u, 1.0 - u]
                })
                .collect()
        };
        let weights = bounded(&projected, &base.rest, &room);
        if weights.iter().all(|w| *w == 0.0) {
            continue;
        }
        let mut left = base.rest.clone();
        for (column, w) in projected.iter().zip(&weights) {
            left.iter_mut().zip(column).for_each(|(r, c)| *r -= w * c);
        }
        let line = Line {
            start,
            slopes: &slopes,
            columns: &columns,
            weights,
            moves,
        };
        let step = |length: &f64| base.step(bench.layout(), &own, &line, *length);
        let mut points: Vec<Point> = LENGTHS.iter().map(step).collect();
        if let (true, &[slope]) = (bench.is_rough(), &slopes[..]) {
            points.extend(along(&own[slope].parameter, start[slope]).map(|value| {
                let mut values = start.clone();
                values[slope] = value;
                base.with(&values)
            }));
        }
        proposals.push(Proposal {
            candidate: index,
            gain: cost(&base.rest) - cost(&left),
            points,
        });
    }
    Ok(proposals)
}

/// Shares of the way to each end of its range at which a parameter is tried whatever its slope.
const ALONG: [f64; 4] = [0.05, 0.15, 0.4, 0.7];

/// Values towards both ends of the range. Where predictions scatter, a small change may move an
/// object that is pushed by as much as a large one does, and its slope then says little.
fn along(parameter: &Parameter, from: f64) -> impl Iterator<Item = f64> {
    let u = parameter.to_unit(from).clamp(0.0, 1.0);
    let ends = [0.0, 1.0]
        .into_iter()
        .filter(move |end| (end - u).abs() > 1e-9);
    ends.flat_map(move |end| ALONG.map(|share| parameter.from_unit(u + share * (end - u))))
}

/// Columns of a candidate at a start: one a slope, per share of its range; one for the whole
/// start where it has none.
fn columns(
    predictor: &mut Predictor<'_>,
    base: &Base<'_>,
    own: &[Unknown],
    start: &[f64],
    shares: &mut [f64],
    slopes: &[usize],
) -> Result<Vec<Vec<f64>>> {
    let change = |other: &[f64]| -> Vec<f64> {
        let pairs = base.residuals.iter().zip(other);
        pairs
            .map(|(a, b)| if b.is_finite() { a - b } else { 0.0 })
            .collect()
    };
    if slopes.is_empty() {
        let residuals = predictor.residuals(&[base.with(start)])?;
        return Ok(vec![change(&residuals[0])]);
    }
    let n = predictor.present().iter().filter(|p| **p).count().max(1) as f64;
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for _ in 0..2 {
        let moved: Vec<(Vec<f64>, f64)> = slopes
            .iter()
            .map(|&j| {
                let mut values = start.to_vec();
                let (value, share) = nudged(&own[j].parameter, start[j], shares[j]);
                values[j] = value;
                (values, share)
            })
            .collect();
        let points: Vec<Point> = moved.iter().map(|(v, _)| base.with(v)).collect();
        let residuals = predictor.residuals(&points)?;
        columns.clear();
        let mut again = false;
        for ((r, (_, share)), &j) in residuals.iter().zip(&moved).zip(slopes) {
            let mut column = change(r);
            let response = (dot(&column, &column) / n).sqrt();
            column.iter_mut().for_each(|x| *x /= share);
            columns.push(column);
            let factor = if response > 0.0 {
                base.aim / response
            } else {
                100.0
            };
            if !(0.1..10.0).contains(&factor) {
                again = true;
                shares[j] = (shares[j] * factor.clamp(1e-4, 1e3)).clamp(1e-9, 0.1);
            }
        }
        if !again {
            break;
        }
    }
    Ok(columns)
}

/// Least squares of `target` in `columns` with each weight within its room: what would
/// leave it is held at its end, one after the other.
fn bounded(columns: &[Vec<f64>], target: &[f64], room: &[[f64; 2]]) -> Vec<f64> {
    let n = columns.len();
    let readings = target.len().max(1) as f64;
    let mut fixed: Vec<Option<f64>> = columns
        .iter()
        .map(|c| ((dot(c, c) / readings).sqrt() < NOTHING).then_some(0.0))
        .collect();
    for _ in 0..=n {
        let free: Vec<usize> = (0..n).filter(|&i| fixed[i].is_none()).collect();
        let mut rest = target.to_vec();
        for (i, w) in fixed.iter().enumerate() {
            if let Some(w) = w {
                rest.iter_mut()
                    .zip(&columns[i])
                    .for_each(|(r, c)| *r -= w * c);
            }
        }
        let m = free.len();
        let gram =
            nalgebra::DMatrix::from_fn(m, m, |a, b| dot(&columns[free[a]], &columns[free[b]]));
        let right = nalgebra::DVector::from_fn(m, |a, _| dot(&columns[free[a]], &rest));
        let solution = crate::normal::inverse(&gram, 1e-9) * right;
        let mut worst = None;
        for (k, &i) in free.iter().enumerate() {
            let [low, high] = room[i];
            let over = (low - solution[k]).max(solution[k] - high);
            if over > 0.0 && worst.is_none_or(|(_, _, o)| over > o) {
                worst = Some((i, solution[k].clamp(low, high), over));
            }
        }
        match worst {
            Some((i, value, _)) => fixed[i] = Some(value),
            None => {
                let mut weights: Vec<f64> = fixed.iter().map(|f| f.unwrap_or(0.0)).collect();
                for (k, &i) in free.iter().enumerate() {
                    weights[i] = solution[k];
                }
                return weights;
            }
        }
    }
    fixed.iter().map(|f| f.unwrap_or(0.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_tried_towards_both_ends_of_a_range_and_not_beyond_one() {
        let parameter = |low: f64| Parameter {
            name: "gain".into(),
            targets: Vec::new(),
            range: [low, 2.0],
            scale: asid_core::parameter::Scale::Linear,
            unit: String::new(),
        };
        let delay: Vec<f64> = along(&parameter(0.0), 0.0).collect();
        assert_eq!(delay.len(), ALONG.len());
        assert!(
            (delay[0] - 0.1).abs() < 1e-12 && (delay[3] - 1.4).abs() < 1e-12,
            "{delay:?}"
        );
        let gain: Vec<f64> = along(&parameter(0.0), 1.0).collect();
        assert_eq!(gain.len(), 2 * ALONG.len());
        assert!(
            (gain[0] - 0.95).abs() < 1e-12 && (gain[7] - 1.7).abs() < 1e-12,
            "{gain:?}"
        );
    }

    #[test]
    fn weights_stay_within_their_room_and_the_others_make_up_for_it() {
        let columns = [vec![1.0, 0.0, 0.0], vec![1.0, 1.0, 0.0]];
        let target = [3.0, 1.0, 0.0];
        let free = bounded(&columns, &target, &[[-10.0, 10.0], [-10.0, 10.0]]);
        assert!(
            (free[0] - 2.0).abs() < 1e-6 && (free[1] - 1.0).abs() < 1e-6,
            "{free:?}"
        );
        // With the first held at 1, the second is (2 + 1) / 2.
        let held = bounded(&columns, &target, &[[-1.0, 1.0], [-10.0, 10.0]]);
        assert!(
            (held[0] - 1.0).abs() < 1e-12 && (held[1] - 1.5).abs() < 1e-6,
            "{held:?}"
        );
    }
}
