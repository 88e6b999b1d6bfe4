//! The search for explanations: none, every single effect, then pairs and triples upon the
//! best.
//!
//! Candidates are screened and fitted jointly with the study's parameters on the first
//! stage of the logs; the better ones follow the stages to the whole. Where the best
//! single leaves a gap, all candidates are screened again upon it and upon its nearest
//! rivals, and so on.

use asid_core::{Error, Progress, Result};

use crate::bench::{Bench, Explanation, Trial};
use crate::candidate::Candidate;
use crate::fit::Effort;
use crate::screen::{Base, Screened, screen};

/// How widely to search.
#[derive(Clone, Copy, Debug)]
pub struct Breadth {
    /// Candidates that are fitted on the first stage.
    pub first: usize,
    /// Of these, those that are followed to the last.
    pub last: usize,
    /// Explanations of each size that more effects are tried upon.
    pub beam: usize,
    /// Most effects together.
    pub depth: usize,
}

impl Default for Breadth {
    fn default() -> Self {
        Self {
            first: 16,
            last: 6,
            beam: 2,
            depth: 2,
        }
    }
}

/// An explanation with the candidates behind it.
#[derive(Clone, Debug)]
pub struct Found {
    /// Indices of the candidates, in the order in which they were added.
    pub candidates: Vec<usize>,
    /// The fit.
    pub explanation: Explanation,
    /// The stage it was fitted to.
    pub stage: usize,
}

/// What a search found.
pub struct Findings {
    /// Without any effect, at the last stage.
    pub none: Explanation,
    /// Sets of effects that were followed to the last stage, best first within a size.
    pub found: Vec<Found>,
    /// Candidates with the cost that screening reached alone, best first.
    pub screened: Vec<Screened>,
}

/// Gain of the cost, per reading, that counts as leaving nothing to explain.
const AT_FLOOR: f64 = 0.04;

/// A search under way.
pub struct Search<'a> {
    /// The bench.
    pub bench: &'a Bench,
    /// The candidates.
    pub candidates: &'a [Candidate],
    /// How widely.
    pub breadth: Breadth,
    /// Where progress is told to.
    pub progress: &'a dyn Progress,
}

impl Search<'_> {
    /// Searches upon `none`, one fit a stage.
    ///
    /// # Errors
    /// When a rollout fails.
    pub fn run(&self, none: Vec<Explanation>) -> Result<Findings> {
        let last = self.bench.stages.len() - 1;
        let mut findings = Findings {
            none: none[last].clone(),
            found: Vec::new(),
            screened: Vec::new(),
        };
        // Where a set of effects stands on each stage.
        let mut bases: Vec<(Vec<usize>, Vec<Explanation>)> = vec![(Vec::new(), none)];
        for depth in 1..=self.breadth.depth {
            let mut level: Vec<(Vec<usize>, Vec<Explanation>)> = Vec::new();
            for (members, base) in &bases {
                let screened = self.round(members, &base[0])?;
                if depth == 1 {
                    findings.screened.clone_from(&screened);
                }
                let share = if depth == 1 { 1 } else { 2 };
                let quota = self.quota(share);
                let known = |set: &Vec<usize>| level.iter().any(|(m, _)| same(m, set));
                let picked: Vec<&Screened> = screened
                    .iter()
                    .filter(|s| {
                        let mut set = members.clone();
                        set.push(s.candidate);
                        set.sort_unstable();
                        !known(&set)
                    })
                    .take(quota[0])
                    .collect();
                level.extend(self.follow(members, &base[0], &picked, &quota)?);
            }
            let cost = |e: &(Vec<usize>, Vec<Explanation>)| e.1[last].fit.cost;
            level.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
            findings.found.extend(level.iter().map(|(members, fits)| Found {
                candidates: members.clone(),
                explanation: fits[last].clone(),
                stage: last,
            }));
            let Some(best) = level.first() else { break };
            if cost(best) / self.bench.readings(last) - 1.0 < AT_FLOOR {
                break;
            }
            level.truncate(self.breadth.beam);
            bases = level;
        }
        Ok(findings)
    }

    /// How many explanations each stage takes, from the first to the last.
    fn quota(&self, share: usize) -> Vec<usize> {
        let n = self.bench.stages.len();
        let (first, last) = (self.breadth.first as f64, self.breadth.last as f64);
        (0..n)
            .map(|i| {
                let along = if n == 1 { 1.0 } else { i as f64 / (n - 1) as f64 };
                let k = first * (last / first).powf(along);
                ((k / share as f64).round() as usize).max(2)
            })
            .collect()
    }

    /// Fits one more effect each to the first stage, and follows the best to the last.
    fn follow(
        &self,
        members: &[usize],
        base: &Explanation,
        picked: &[&Screened],
        quota: &[usize],
    ) -> Result<Vec<(Vec<usize>, Vec<Explanation>)>> {
        let trials = trials(self.candidates, members, base);
        let mut fitted = Vec::new();
        self.progress.begin("fitting", picked.len() as u64);
        for s in picked {
            let first = self.fit_one(&trials, base, s)?;
            fitted.push(([members, &[s.candidate]].concat(), vec![first]));
            self.progress.advance(1);
        }
        self.progress.end();
        for (stage, &n) in quota.iter().enumerate().skip(1) {
            let cost = |e: &(Vec<usize>, Vec<Explanation>)| e.1[stage - 1].fit.cost;
            fitted.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
            fitted.truncate(n);
            self.progress.begin("fitting longer", fitted.len() as u64);
            for (members, fits) in &mut fitted {
                let next = self.extend(stage, members, &fits[stage - 1])?;
                fits.push(next);
                self.progress.advance(1);
            }
            self.progress.end();
        }
        Ok(fitted)
    }

    /// Fits an explanation on from where it stands to another stage.
    ///
    /// # Errors
    /// When a rollout fails.
    pub fn extend(
        &self,
        stage: usize,
        members: &[usize],
        from: &Explanation,
    ) -> Result<Explanation> {
        let trials = trials(self.candidates, members, from);
        let study = self.bench.parameters.len();
        let theta = &from.fit.point.theta[..study];
        let starts = &from.fit.point.starts;
        self.bench
            .explain(stage, &trials, theta, starts, Effort::FULL)
    }

    /// Screens all candidates upon an explanation, best first.
    fn round(&self, members: &[usize], base: &Explanation) -> Result<Vec<Screened>> {
        let trials = trials(self.candidates, members, base);
        let linear = Base::new(self.bench, 0, &trials, base)?;
        let record = &self.bench.stages[0].record;
        let mut all = Vec::new();
        self.progress
            .begin("screening", self.candidates.len() as u64);
        for (i, candidate) in self.candidates.iter().enumerate() {
            if !members.contains(&i) {
                match screen(self.bench, record, &linear, (i, candidate)) {
                    Ok(found) => all.extend(found),
                    // A pair that the engine refuses is no candidate.
                    Err(Error::Parameter { .. } | Error::Incapable { .. }) => {}
                    Err(other) => return Err(other),
                }
            }
            self.progress.advance(1);
        }
        self.progress.end();
        all.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        Ok(all)
    }

    /// Fits one more effect to the first stage from where screening left it.
    fn fit_one(
        &self,
        trials: &[Trial<'_>],
        base: &Explanation,
        screened: &Screened,
    ) -> Result<Explanation> {
        let study = self.bench.parameters.len();
        let mut at = study;
        let mut all: Vec<Trial<'_>> = trials
            .iter()
            .map(|(c, values)| {
                let moved = screened.theta[at..at + values.len()].to_vec();
                at += values.len();
                (*c, moved)
            })
            .collect();
        all.push((
            &self.candidates[screened.candidate],
            screened.values.clone(),
        ));
        let (theta, starts) = (&screened.theta[..study], &base.fit.point.starts);
        self.bench.explain(0, &all, theta, starts, Effort::BRIEF)
    }
}

/// Whether two lists hold the same members.
fn same(a: &[usize], sorted: &[usize]) -> bool {
    let mut a = a.to_vec();
    a.sort_unstable();
    a == sorted
}

/// The effects of an explanation as trials with their fitted values.
#[must_use]
pub fn trials<'a>(
    candidates: &'a [Candidate],
    members: &[usize],
    explanation: &Explanation,
) -> Vec<Trial<'a>> {
    members
        .iter()
        .zip(&explanation.effects)
        .map(|(&i, e)| (&candidates[i], e.values.iter().map(|(_, x)| *x).collect()))
        .collect()
}
