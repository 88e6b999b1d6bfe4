//! Which candidates could explain what is left: a score test, in one batch each.
//!
//! The gradient of the residual in a candidate's parameters, taken at its null value, is
//! projected off everything that the study's parameters and the starts can do; what of
//! the residual it then explains is the candidate's gain to first order. Parameters
//! without a gradient at null (a width, a place, a limit) are tried at a few values. The
//! step that the linear fit proposes is then really taken, at full length and shorter.

use asid_core::{Layout, Parameter, Result};

use crate::bench::{Bench, Explanation, Trial};
use crate::candidate::Candidate;
use crate::fit::{Unknown, cost};
use crate::linearise::{ABOVE_SCATTER, AIM, Differences, PROBE, ROUGH_START, linearise};
use crate::nuisance::{Nuisance, Starts};
use crate::predict::Point;
use crate::record::Record;

mod propose;

use propose::Line;
pub use propose::{Proposal, propose};

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

    /// The point, with values of a candidate's parameters behind it.
    fn with(&self, values: &[f64]) -> Point {
        let mut point = self.point.clone();
        point.theta.extend_from_slice(values);
        point
    }

    /// The point after a share of a step: of the candidate's `slopes` by `weights`, of the
    /// parameters before it by what they have to move in exchange, and of open starts by what is
    /// then best for them.
    fn step(&self, layout: &Layout, own: &[Unknown], line: &Line<'_>, length: f64) -> Point {
        let moved = |parameter: &Parameter, value: f64, by: f64| {
            let u = parameter.to_unit(value) + length * by;
            parameter.from_unit(u.clamp(0.0, 1.0))
        };
        let mut left = self.residuals.clone();
        let mut take = |by: f64, column: &[f64]| {
            let pairs = left.iter_mut().zip(column);
            pairs.for_each(|(r, c)| *r -= length * by * c);
        };
        let mut point = self.point.clone();
        let free = self.unknowns.iter().enumerate().filter(|(_, u)| u.free);
        for (k, (i, unknown)) in free.enumerate() {
            let exchanged: f64 = (line.moves.iter().zip(&line.weights))
                .map(|(m, w)| m[k] * w)
                .sum();
            let by = self.shift[k] - exchanged;
            point.theta[i] = moved(&unknown.parameter, point.theta[i], by);
            take(by, &self.columns[k]);
        }
        let mut values = line.start.to_vec();
        for (&j, &w) in line.slopes.iter().zip(&line.weights) {
            values[j] = moved(&own[j].parameter, line.start[j], w);
        }
        for (&w, column) in line.weights.iter().zip(line.columns) {
            take(w, column);
        }
        point.theta.extend(values);
        self.starts.follow(layout, &left, &mut point.starts);
        point
    }
}

/// First difference for a slope, as a share of its range.
const FIRST: f64 = 1e-4;

/// Starts of a candidate that are kept.
const KEPT: usize = 3;

/// Takes a candidate's proposed steps: what it really reaches from its starts, best first.
///
/// # Errors
/// When a rollout fails.
pub fn take(
    bench: &Bench,
    record: &Record,
    base: &Base<'_>,
    candidate: &Candidate,
    proposals: &[&Proposal],
) -> Result<Vec<Screened>> {
    let mut trials: Vec<Trial<'_>> = base.trials.clone();
    trials.push((candidate, Vec::new()));
    let mut predictor = bench.predictor(&trials, record)?;
    let own: Vec<Unknown> = bench.unknowns(&trials).split_off(base.unknowns.len());
    let mut found: Vec<Screened> = Vec::new();
    for proposal in proposals {
        let residuals = predictor.residuals(&proposal.points)?;
        let reached = proposal
            .points
            .iter()
            .zip(residuals.iter().map(|r| cost(r)));
        let best = reached
            .filter(|(_, c)| c.is_finite())
            .min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((point, cost)) = best {
            let (theta, values) = point.theta.split_at(base.point.theta.len());
            found.push(Screened {
                candidate: proposal.candidate,
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

/// Gain, as a share of the largest, from which on a proposal is worth taking.
const WORTH_TAKING: f64 = 0.01;
/// Candidates whose proposals are taken whatever they gain.
const ALWAYS: usize = 30;

/// Proposals that are worth their rollouts, by candidate, the best candidate first: a step
/// that gains next to nothing to first order is not taken where there are many candidates.
#[must_use]
pub fn worthwhile(proposals: &[Proposal]) -> Vec<(usize, Vec<&Proposal>)> {
    let mut order: Vec<&Proposal> = proposals.iter().collect();
    order.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let most = order.first().map_or(0.0, |p| p.gain);
    let mut chosen: Vec<(usize, Vec<&Proposal>)> = Vec::new();
    for proposal in order {
        let at = chosen.iter().position(|(c, _)| *c == proposal.candidate);
        match at {
            Some(i) => chosen[i].1.push(proposal),
            None if chosen.len() < ALWAYS || proposal.gain > WORTH_TAKING * most => {
                chosen.push((proposal.candidate, vec![proposal]));
            }
            None => {}
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    fn proposal(candidate: usize, gain: f64) -> Proposal {
        Proposal {
            candidate,
            gain,
            points: Vec::new(),
        }
    }

    #[test]
    fn the_best_are_tried_whatever_they_gain_and_the_rest_for_a_hundredth_of_the_best() {
        // Candidate k gains 1000 - k, but for the last hundred, which gain next to nothing.
        let mut proposals: Vec<Proposal> =
            (0..50).map(|k| proposal(k, 1000.0 - k as f64)).collect();
        proposals.extend((50..150).map(|k| proposal(k, 1.0)));
        // A second start of a candidate that is tried is tried.
        proposals.push(proposal(3, 0.0));
        let chosen = worthwhile(&proposals);
        let candidates: Vec<usize> = chosen.iter().map(|(c, _)| *c).collect();
        assert_eq!(candidates, (0..50).collect::<Vec<_>>());
        assert_eq!(chosen[3].1.len(), 2);
        // Where nothing gains much, thirty are tried all the same.
        let few: Vec<Proposal> = (0..40)
            .map(|k| proposal(k, if k == 0 { 1e6 } else { 1.0 }))
            .collect();
        assert_eq!(worthwhile(&few).len(), 30);
        assert!(worthwhile(&[]).is_empty());
    }
}
