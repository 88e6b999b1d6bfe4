//! Which candidates could explain what is left: a score test, in one batch each.
//!
//! The gradient of the residual in a candidate's parameters, taken at its null value, is
//! projected off everything that the study's parameters and the starts can do; what of
//! the residual it then explains is the candidate's gain to first order. Parameters
//! without a gradient at null (a width, a place, a limit) are tried at a few values. The
//! step that the linear fit proposes is then really taken, at full length and shorter.

use asid_core::{Layout, Result};

use crate::bench::{Bench, Explanation, Record, Trial};
use crate::candidate::Candidate;
use crate::fit::{
    ABOVE_SCATTER, AIM, Differences, NOTHING, Open, PROBE, ROUGH_START, Unknown, cost, inverse,
    linearise, nudged,
};
use crate::predict::{Point, State};

/// How promising a candidate is.
#[derive(Clone, Debug)]
pub struct Screened {
    /// Index of the candidate.
    pub candidate: usize,
    /// Values of its parameters to start a fit from.
    pub values: Vec<f64>,
    /// The study's parameters, and those of effects before it, that go with them.
    pub theta: Vec<f64>,
    /// Sum of squares really reached with them.
    pub cost: f64,
}

/// Directions in which the residual may move without the candidate: an orthonormal basis.
pub struct Nuisance {
    /// Per episode: place in the vector, and basis of its start's directions.
    starts: Vec<(std::ops::Range<usize>, Vec<Vec<f64>>)>,
    /// Basis of the parameters' directions, off the starts'.
    basis: Vec<Vec<f64>>,
    /// For each basis vector its coordinates in the parameters.
    combination: Vec<Vec<f64>>,
    /// Number of parameters.
    parameters: usize,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Takes `along` out of `v`, and returns how much there was.
fn take_out(v: &mut [f64], along: &[f64]) -> f64 {
    let amount = dot(v, along);
    for (x, a) in v.iter_mut().zip(along) {
        *x -= amount * a;
    }
    amount
}

impl Nuisance {
    /// From columns of the parameters (whole vectors) and of the starts (all episodes at once).
    #[must_use]
    pub fn new(
        columns: &[Vec<f64>],
        start_columns: &[Vec<f64>],
        episodes: &[std::ops::Range<usize>],
    ) -> Self {
        let mut starts = Vec::new();
        for range in episodes {
            let mut basis: Vec<Vec<f64>> = Vec::new();
            for column in start_columns {
                let mut v = column[range.clone()].to_vec();
                let size = dot(&v, &v).sqrt();
                basis.iter().for_each(|b| {
                    take_out(&mut v, b);
                });
                let left = dot(&v, &v).sqrt();
                if left > 1e-6 * size && left > 0.0 {
                    v.iter_mut().for_each(|x| *x /= left);
                    basis.push(v);
                }
            }
            starts.push((range.clone(), basis));
        }
        let mut nuisance = Self {
            starts,
            basis: Vec::new(),
            combination: Vec::new(),
            parameters: columns.len(),
        };
        for (i, column) in columns.iter().enumerate() {
            let mut v = column.clone();
            let size = dot(&v, &v).sqrt();
            nuisance.project_starts(&mut v);
            let mut combination = vec![0.0; columns.len()];
            combination[i] = 1.0;
            for (b, c) in nuisance.basis.iter().zip(&nuisance.combination) {
                let amount = take_out(&mut v, b);
                for (x, y) in combination.iter_mut().zip(c) {
                    *x -= amount * y;
                }
            }
            let left = dot(&v, &v).sqrt();
            if left > 1e-6 * size && left > 0.0 {
                v.iter_mut().for_each(|x| *x /= left);
                combination.iter_mut().for_each(|x| *x /= left);
                nuisance.basis.push(v);
                nuisance.combination.push(combination);
            }
        }
        nuisance
    }

    fn project_starts(&self, v: &mut [f64]) {
        for (range, basis) in &self.starts {
            let part = &mut v[range.clone()];
            basis.iter().for_each(|b| {
                take_out(part, b);
            });
        }
    }

    /// Takes out what the nuisance parameters can do; returns how much each parameter does.
    pub fn project(&self, v: &mut [f64]) -> Vec<f64> {
        self.project_starts(v);
        let mut amounts = vec![0.0; self.parameters];
        for (b, c) in self.basis.iter().zip(&self.combination) {
            let amount = take_out(v, b);
            for (x, y) in amounts.iter_mut().zip(c) {
                *x += amount * y;
            }
        }
        amounts
    }
}

/// What a screening starts from: an explanation, linearised.
pub struct Base<'a> {
    /// Effects that it has, with their fitted values.
    pub trials: Vec<Trial<'a>>,
    /// Values of the study's parameters and of the effects.
    pub point: Point,
    unknowns: Vec<Unknown>,
    residuals: Vec<f64>,
    /// The residuals off the nuisance directions, and what each parameter would move.
    rest: Vec<f64>,
    shift: Vec<f64>,
    nuisance: Nuisance,
    /// What the parameters and the starts do, where starts are open.
    columns: Vec<Vec<f64>>,
    starts: Starts,
    /// Response that slopes are measured with, and the first share of the range to try.
    aim: f64,
    first: f64,
}

impl<'a> Base<'a> {
    /// Linearises an explanation on a stage.
    ///
    /// # Errors
    /// When a rollout fails.
    pub fn new(
        bench: &Bench,
        stage: usize,
        trials: &[Trial<'a>],
        from: &Explanation,
    ) -> Result<Self> {
        let part = &bench.stages[stage];
        let (record, open) = (&part.record, &part.open);
        let point = part.point(from.fit.point.theta.clone(), &from.fit.point.starts);
        let trials: Vec<Trial<'a>> = trials
            .iter()
            .zip(&from.effects)
            .map(|((c, _), e)| (*c, e.values.iter().map(|(_, x)| *x).collect()))
            .collect();
        let unknowns = bench.unknowns(&trials);
        let mut predictor = bench.predictor(&trials, record)?;
        let mut differences = Differences::new(unknowns.len(), open.len());
        let (mut aim, mut first) = (AIM, FIRST);
        if predictor.is_rough() {
            differences = Differences::rough(unknowns.len(), open.len());
            let mut other = point.clone();
            for start in &mut other.starts {
                (0..2 * bench.layout().nv).for_each(|c| start.shift(bench.layout(), c, PROBE));
            }
            let both = predictor.residuals(&[point.clone(), other])?;
            let apart = both[0].iter().zip(&both[1]).map(|(a, b)| (a - b).powi(2));
            let scatter = (apart.sum::<f64>() / record.readings.max(1) as f64).sqrt();
            aim = AIM.max(ABOVE_SCATTER * scatter);
            first = ROUGH_START;
        }
        let mut line = None;
        for _ in 0..3 {
            line = Some(linearise(
                &mut predictor,
                bench.layout(),
                &unknowns,
                &point,
                open,
                &mut differences,
            )?);
        }
        let (residuals, columns, start_columns) = line
            .map(|l| (l.residuals, l.columns, l.start_columns))
            .unwrap_or_default();
        let episodes: Vec<_> = (0..record.logs.episodes.len())
            .map(|e| record.logs.offset(e)..record.logs.offset(e + 1))
            .collect();
        let nuisance = Nuisance::new(&columns, &start_columns, &episodes);
        let mut rest = residuals.clone();
        let shift = nuisance.project(&mut rest);
        Ok(Self {
            trials,
            point,
            unknowns,
            residuals,
            rest,
            shift,
            nuisance,
            starts: Starts::new(open, start_columns, episodes),
            columns,
            aim,
            first,
        })
    }

    /// Sum of squares before any candidate.
    #[must_use]
    pub fn cost(&self) -> f64 {
        cost(&self.residuals)
    }
}

/// What open starts do, and how they follow a step of everything else.
struct Starts {
    open: Open,
    columns: Vec<Vec<f64>>,
    /// Per episode: place in the vector, and inverse of the starts' normal equations.
    episodes: Vec<(std::ops::Range<usize>, nalgebra::DMatrix<f64>)>,
}

impl Starts {
    fn new(open: &Open, columns: Vec<Vec<f64>>, episodes: Vec<std::ops::Range<usize>>) -> Self {
        let m = columns.len();
        let normal = |range: std::ops::Range<usize>| {
            let part = |i: usize| &columns[i][range.clone()];
            let gram = nalgebra::DMatrix::from_fn(m, m, |i, j| dot(part(i), part(j)));
            (range.clone(), inverse(&gram, 1e-12))
        };
        Self {
            open: open.clone(),
            episodes: episodes.into_iter().map(normal).collect(),
            columns,
        }
    }

    /// Moves starts to where they leave least of `residuals`, to first order.
    fn follow(&self, layout: &Layout, residuals: &[f64], starts: &mut [State]) {
        if self.open.is_empty() {
            return;
        }
        for ((range, inverse), start) in self.episodes.iter().zip(starts) {
            let along = self.columns.iter();
            let along = along.map(|c| dot(&c[range.clone()], &residuals[range.clone()]));
            let moves = inverse * nalgebra::DVector::from_iterator(self.columns.len(), along);
            for (&coordinate, by) in self.open.iter().zip(moves.iter()) {
                start.shift(layout, coordinate, *by);
            }
        }
    }
}

/// First difference for a slope, as a share of its range.
const FIRST: f64 = 1e-4;

/// Starts of a candidate that are kept.
const KEPT: usize = 3;

/// Screens one candidate: its best starts, best first.
///
/// # Errors
/// When a rollout fails.
pub fn screen(
    bench: &Bench,
    record: &Record,
    base: &Base<'_>,
    (index, candidate): (usize, &Candidate),
) -> Result<Vec<Screened>> {
    let mut trials: Vec<Trial<'_>> = base.trials.clone();
    trials.push((candidate, Vec::new()));
    let mut predictor = bench.predictor(&trials, record)?;
    let own: Vec<Unknown> = bench.unknowns(&trials).split_off(base.unknowns.len());
    let at = |values: &[f64]| -> Point {
        let mut point = base.point.clone();
        point.theta.extend_from_slice(values);
        point
    };
    let slopes = candidate.slopes();
    let n = record.readings.max(1) as f64;
    let mut found: Vec<Screened> = Vec::new();
    let mut shares = vec![base.first; own.len()];
    for start in &candidate.starts {
        // Columns: one a slope, per share of its range; or one for the whole step.
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let change = |other: &[f64]| -> Vec<f64> {
            let pairs = base.residuals.iter().zip(other);
            pairs
                .map(|(a, b)| if b.is_finite() { a - b } else { 0.0 })
                .collect()
        };
        if slopes.is_empty() {
            let residuals = predictor.residuals(&[at(start)])?;
            columns.push(change(&residuals[0]));
        } else {
            for round in 0..2 {
                let moved: Vec<(Vec<f64>, f64)> = slopes
                    .iter()
                    .map(|&j| {
                        let mut values = start.clone();
                        let (value, share) = nudged(&own[j].parameter, start[j], shares[j]);
                        values[j] = value;
                        (values, share)
                    })
                    .collect();
                let points: Vec<Point> = moved.iter().map(|(v, _)| at(v)).collect();
                let residuals = predictor.residuals(&points)?;
                columns.clear();
                let mut again = false;
                for ((r, (_, share)), &j) in residuals.iter().zip(&moved).zip(&slopes) {
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
                if !again || round == 1 {
                    break;
                }
            }
        }
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
        // The step really taken, at several lengths.
        let points: Vec<Point> = [1.0, 0.5, 0.2]
            .iter()
            .map(|length| {
                let mut values = start.clone();
                for (&j, w) in slopes.iter().zip(&weights) {
                    let p = &own[j].parameter;
                    let u = p.to_unit(start[j]) + length * w;
                    values[j] = p.from_unit(u.clamp(0.0, 1.0));
                }
                let mut point = at(&values);
                let mut left = base.residuals.clone();
                let mut take = |by: f64, column: &[f64]| {
                    left.iter_mut()
                        .zip(column)
                        .for_each(|(r, c)| *r -= length * by * c);
                };
                weights.iter().zip(&columns).for_each(|(w, c)| take(*w, c));
                let free = base.unknowns.iter().enumerate().filter(|(_, u)| u.free);
                for (k, (i, unknown)) in free.enumerate() {
                    let by: f64 = base.shift[k]
                        - moves
                            .iter()
                            .zip(&weights)
                            .map(|(m, w)| m[k] * w)
                            .sum::<f64>();
                    let p = &unknown.parameter;
                    let u = p.to_unit(point.theta[i]) + length * by;
                    point.theta[i] = p.from_unit(u.clamp(0.0, 1.0));
                    take(by, &base.columns[k]);
                }
                base.starts.follow(bench.layout(), &left, &mut point.starts);
                point
            })
            .collect();
        let residuals = predictor.residuals(&points)?;
        let reached = points.iter().zip(residuals.iter().map(|r| cost(r)));
        let best = reached
            .filter(|(_, c)| c.is_finite())
            .min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((point, cost)) = best {
            let (theta, values) = point.theta.split_at(base.point.theta.len());
            found.push(Screened {
                candidate: index,
                values: values.to_vec(),
                theta: theta.to_vec(),
                cost,
            });
        }
    }
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let choices: Vec<usize> = (0..own.len()).filter(|&i| !own[i].free).collect();
    let mut kept: Vec<Screened> = Vec::new();
    for s in found {
        // At most two of one choice, so that every choice has its turn.
        let same = |k: &&Screened| choices.iter().all(|&i| k.values[i] == s.values[i]);
        if kept.len() < KEPT && kept.iter().filter(same).count() < 2 {
            kept.push(s);
        }
    }
    Ok(kept)
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
        let solution = crate::fit::inverse(&gram, 1e-9) * right;
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
