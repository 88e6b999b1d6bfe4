//! The search for explanations: none, every single effect, then pairs and triples upon the
//! best.
//!
//! Candidates are screened and fitted jointly with the study's parameters on the first
//! stage of the logs; the better ones follow the stages to the whole. Where the best
//! single leaves a gap, all candidates are screened again upon it and upon its nearest
//! rivals, and so on.

mod settle;

use asid_core::{Error, Progress, Result};

use crate::bench::{Bench, Explanation, Trial};
use crate::candidate::Candidate;
use crate::ceiling::Left;
use crate::fit::Effort;
use crate::result::{DetectionLimit, Isolability, MissingForce, NotTried, RankedSet};
use crate::scatter::Scatter;
use crate::screen::{Base, Screened, propose, take, worthwhile};
use crate::trace::ForceTrace;

/// How widely to search.
#[derive(Clone, Copy, Debug)]
pub struct Breadth {
    /// Candidates that are fitted on the first stage.
    pub first: usize,
    /// Of these, those that are followed to the last.
    pub last: usize,
    /// Of the single effects, those that are followed to the last whatever sets of more do.
    pub singles: usize,
    /// Explanations that more effects are tried upon.
    pub beam: usize,
    /// Most effects together.
    pub depth: usize,
}

impl Default for Breadth {
    fn default() -> Self {
        Self {
            first: 14,
            last: 5,
            singles: 5,
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
}

/// What a round of screening found.
struct Round {
    /// Best first.
    screened: Vec<Screened>,
    /// Candidates that it did not come to, because the work was stopped.
    skipped: Vec<usize>,
}

/// What a search found.
pub struct Findings {
    /// Without any effect, at the last stage.
    pub none: Explanation,
    /// What it leaves of short windows, root mean square beyond the noise; `None` where the logs do
    /// not allow them.
    pub short: Option<f64>,
    /// Sets of effects that were followed to the last stage, lowest cost first.
    pub found: Vec<Found>,
    /// The force that is missing at each degree of freedom, where it was estimated.
    pub missing: Vec<MissingForce>,
    /// The same along the logs, where most is missing.
    pub forces: Vec<ForceTrace>,
    /// Sets of effects by their evidence, where there is one.
    pub ranking: Vec<RankedSet>,
    /// Which of the leading effects the logs tell apart.
    pub isolability: Option<Isolability>,
    /// The smallest size of each effect that the logs could have shown, where that is known.
    pub detection_limits: Vec<DetectionLimit>,
    /// Probability of as much evidence for the best candidate where nothing is missing, where that is known.
    pub p_value: Option<f64>,
    /// What the best explanation leaves of the missing force, where it was estimated.
    pub left: Vec<Left>,
    /// What was left out because the work was stopped.
    pub not_tried: Vec<NotTried>,
    /// Candidates with the cost that screening on the first stage reached, best first.
    pub screened: Vec<Screened>,
}

impl Findings {
    /// Of no search: the model without any effect alone.
    #[must_use]
    pub fn without_search(none: Explanation) -> Self {
        Self {
            none,
            short: None,
            found: Vec::new(),
            missing: Vec::new(),
            forces: Vec::new(),
            ranking: Vec::new(),
            isolability: None,
            detection_limits: Vec::new(),
            p_value: None,
            left: Vec::new(),
            not_tried: Vec::new(),
            screened: Vec::new(),
        }
    }
}

/// Excess of the root mean square residual, in units of the noise, that no further effect
/// is looked for below: another program's version of the same effect leaves as much.
pub const NEGLIGIBLE: f64 = 2.0;

/// Gap without effects, in deviations of the noise, up to which nothing is there to be closed: noise that is estimated from a
/// log is right to some hundredths.
pub const LEAST_GAP: f64 = 1.1;

/// Growth of a gap from one stage to the next from which on it counts as another gap.
const GROWN: f64 = 3.0;

/// How many times as many single effects are followed where fits begin with short windows.
const AFTER_WINDOWS: usize = 3;

/// Explanations that are taken to the whole of the logs where the work is stopped: the leader and a rival.
const KEPT: usize = 2;

/// Multiple of the best cost up to which a fit is worth its end.
const NEAR_BEST: f64 = 10.0;

/// What a cost per reading has beyond the noise, as a root mean square.
#[must_use]
pub fn excess(cost_per_reading: f64) -> f64 {
    (cost_per_reading - 1.0).max(0.0).sqrt()
}

/// A search under way.
pub struct Search<'a> {
    /// The bench.
    pub bench: &'a mut Bench,
    /// What its scatter is estimated with.
    pub scatter: &'a mut Scatter,
    /// The candidates.
    pub candidates: &'a [Candidate],
    /// How widely.
    pub breadth: Breadth,
    /// Where progress is told to.
    pub progress: &'a dyn Progress,
}

impl Search<'_> {
    /// Searches upon `none`, one fit a stage. On each stage what was found before is
    /// followed; where its best leaves a gap, one more effect is tried upon it.
    ///
    /// # Errors
    /// When a rollout fails.
    pub fn run(&mut self, none: &[Explanation]) -> Result<Findings> {
        let last = self.bench.stages.len() - 1;
        let nothing = |stage: usize| Found {
            candidates: Vec::new(),
            explanation: none[stage].clone(),
        };
        let Round { screened, skipped } = self.round(0, &nothing(0))?;
        let mut all = self.fit_round(0, &nothing(0), &screened, &[], self.quota(0))?;
        self.sort(&mut all);
        let mut before = NEGLIGIBLE / GROWN;
        let mut stopped_at = None;
        for stage in 0..=last {
            if self.progress.is_stopped() {
                // What leads is taken to the whole of the logs as it stands.
                stopped_at = stopped_at.or(Some(stage));
                if stage < last {
                    continue;
                }
                if last > 0 {
                    all.truncate(KEPT);
                    all = self.follow(last, all)?;
                }
                break;
            }
            self.foresee(stage, &all)?;
            all = self.follow(stage, all)?;
            self.settle(stage, &mut all)?;
            for _ in 1..self.breadth.depth {
                if self.progress.is_stopped() {
                    stopped_at = Some(stage);
                    break;
                }
                // A gap that was not there on the shorter stages.
                let gap = self.gap(stage, &all);
                if gap < NEGLIGIBLE.max(GROWN * before) {
                    break;
                }
                let smaller = all
                    .iter()
                    .filter(|f| f.candidates.len() < self.breadth.depth);
                let beam = if stage == 0 { self.breadth.beam } else { 1 };
                let bases: Vec<Found> = smaller.take(beam).cloned().collect();
                for base in bases {
                    let round = self.round(stage, &base)?.screened;
                    let quota = (self.quota(stage) / 2).max(2);
                    let new = self.fit_round(stage, &base, &round, &all, quota)?;
                    all.extend(new);
                }
                self.sort(&mut all);
            }
            before = self.gap(stage, &all);
        }
        let not_tried = self.not_tried(stopped_at, (&screened, &skipped), &all);
        Ok(Findings {
            short: self.bench.stages[0]
                .is_windows(self.bench)
                .then(|| excess(none[0].fit.cost / self.bench.readings(0))),
            found: all,
            not_tried,
            screened,
            ..Findings::without_search(none[last].clone())
        })
    }

    /// What was left out where the work was stopped at a stage: the rest of the stages, and the effects that screening
    /// proposed and no fit followed.
    fn not_tried(
        &self,
        stage: Option<usize>,
        (screened, skipped): (&[Screened], &[usize]),
        all: &[Found],
    ) -> Vec<NotTried> {
        let Some(stage) = stage else {
            return Vec::new();
        };
        let followed = |c: &usize| all.iter().any(|f| f.candidates.contains(c));
        let mut open: Vec<usize> = Vec::new();
        for s in screened.iter().filter(|s| !followed(&s.candidate)) {
            if !open.contains(&s.candidate) && open.len() < self.quota(0) {
                open.push(s.candidate);
            }
        }
        let label = |c: &usize| self.candidates[*c].label();
        let screening = NotTried {
            stage: "screening".into(),
            effects: skipped.iter().map(label).collect(),
        };
        let mut not_tried = vec![
            NotTried {
                stage: format!(
                    "search on the logs from stage {} of {} on",
                    stage + 1,
                    self.bench.stages.len()
                ),
                effects: Vec::new(),
            },
            NotTried {
                stage: "fits of what leads in screening".into(),
                effects: open.iter().map(label).collect(),
            },
        ];
        if !skipped.is_empty() {
            not_tried.push(screening);
        }
        not_tried
    }

    fn sort(&self, all: &mut [Found]) {
        all.sort_by(|a, b| {
            let cost = |f: &Found| f.explanation.fit.cost;
            cost(a).total_cmp(&cost(b))
        });
    }

    /// What the best leaves.
    fn gap(&self, stage: usize, all: &[Found]) -> f64 {
        let best = all
            .first()
            .map_or(f64::INFINITY, |f| f.explanation.fit.cost);
        excess(best / self.bench.readings(stage))
    }

    /// How many explanations a stage takes: fewer where predictions scatter and fits are dear.
    fn quota(&self, stage: usize) -> usize {
        let n = self.bench.stages.len();
        let share = if self.bench.is_rough() { 0.6 } else { 1.0 };
        let (first, last) = (
            self.breadth.first as f64 * share,
            self.breadth.last as f64 * share,
        );
        let along = if n == 1 {
            0.0
        } else {
            stage as f64 / (n - 1) as f64
        };
        (first * (last / first).powf(along)).round() as usize
    }

    /// Fits the best of the stage before on to this one.
    fn follow(&self, stage: usize, mut all: Vec<Found>) -> Result<Vec<Found>> {
        if stage == 0 {
            return Ok(all);
        }
        // The best, and some of the singles whatever their place: on a short stage a pair hides
        // which of its two acts over the whole.
        let quota = self.quota(stage);
        // Short windows rank effects by what they do at once, long replays by what adds up.
        let alone = if self.bench.stages[0].is_windows(self.bench) {
            AFTER_WINDOWS * self.breadth.singles
        } else {
            self.breadth.singles
        };
        let (mut place, mut singles) = (0, 0);
        all.retain(|f| {
            place += 1;
            singles += usize::from(f.candidates.len() == 1);
            place <= quota || (f.candidates.len() == 1 && singles <= alone)
        });
        self.progress.begin("fitting longer", all.len() as u64);
        for found in &mut all {
            let stopped = self.progress.is_stopped();
            let effort = if stopped { Effort::LOOK } else { Effort::BRIEF };
            found.explanation = self.extend(stage, found, effort)?;
            self.progress.advance(1);
        }
        self.sort(&mut all);
        // To the end only what may be the best.
        let best = all.first().map_or(0.0, |f| f.explanation.fit.cost);
        if stage + 1 == self.bench.stages.len() {
            for found in &mut all {
                if found.explanation.fit.cost < NEAR_BEST * best && !self.progress.is_stopped() {
                    found.explanation = self.extend(stage, found, Effort::FULL)?;
                }
            }
            self.sort(&mut all);
        }
        self.progress.end();
        Ok(all)
    }

    /// Fits an explanation on from where it stands to a stage.
    ///
    /// # Errors
    /// When a rollout fails.
    pub fn extend(&self, stage: usize, found: &Found, effort: Effort) -> Result<Explanation> {
        let from = &found.explanation;
        let trials = trials(self.candidates, &found.candidates, from);
        let theta = &from.fit.point.theta[..self.bench.parameters.len()];
        let starts = &from.fit.point.starts;
        self.bench
            .explain(stage, &trials, theta, starts, (effort, self.progress))
    }

    /// Screens all candidates upon an explanation, best first.
    fn round(&self, stage: usize, base: &Found) -> Result<Round> {
        let trials = trials(self.candidates, &base.candidates, &base.explanation);
        let linear = Base::new(self.bench, stage, &trials, &base.explanation)?;
        let record = &self.bench.stages[stage].record;
        let mut proposals = Vec::new();
        self.progress
            .begin("screening", self.candidates.len() as u64);
        let mut skipped = Vec::new();
        for (i, candidate) in self.candidates.iter().enumerate() {
            // One proposal at least, so that there is something to say.
            if !proposals.is_empty() && self.progress.is_stopped() {
                skipped.extend(i..self.candidates.len());
                break;
            }
            if !base.candidates.contains(&i) {
                match propose(self.bench, record, &linear, (i, candidate)) {
                    Ok(found) => proposals.extend(found),
                    // A pair that the engine refuses is no candidate.
                    Err(Error::Parameter { .. } | Error::Incapable { .. }) => {}
                    Err(other) => return Err(other),
                }
            }
            self.progress.advance(1);
        }
        self.progress.end();
        let chosen = worthwhile(&proposals);
        let mut all = Vec::new();
        self.progress.begin("trying the best", chosen.len() as u64);
        for (i, proposals) in &chosen {
            if !all.is_empty() && self.progress.is_stopped() {
                skipped.push(*i);
                continue;
            }
            let candidate = &self.candidates[*i];
            all.extend(take(self.bench, record, &linear, candidate, proposals)?);
            self.progress.advance(1);
        }
        self.progress.end();
        all.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let gap = |s: &Screened| (s.cost / self.bench.readings(stage)).sqrt();
        let rows = all
            .iter()
            .map(|s| (self.candidates[s.candidate].label(), gap(s)));
        self.progress
            .ranking("gap in screening", &rows.collect::<Vec<_>>());
        Ok(Round {
            screened: all,
            skipped,
        })
    }

    /// Fits the best of a round of screening, but for sets that are known.
    fn fit_round(
        &self,
        stage: usize,
        base: &Found,
        round: &[Screened],
        known: &[Found],
        quota: usize,
    ) -> Result<Vec<Found>> {
        let trials = trials(self.candidates, &base.candidates, &base.explanation);
        let with = |s: &Screened| [&base.candidates[..], &[s.candidate]].concat();
        let mut new: Vec<Vec<&Screened>> = Vec::new();
        for s in round {
            if known.iter().any(|f| same(&f.candidates, &with(s))) {
                continue;
            }
            match new.iter().position(|n| n[0].candidate == s.candidate) {
                Some(i) => new[i].push(s),
                None if new.len() < quota => new.push(vec![s]),
                None => {}
            }
        }
        let mut fitted = Vec::with_capacity(new.len());
        self.progress.begin("fitting", new.len() as u64);
        for starts in new {
            if !fitted.is_empty() && self.progress.is_stopped() {
                break;
            }
            let mut best: Option<Explanation> = None;
            for s in &starts {
                let fit = self.fit_one(stage, &trials, &base.explanation, s)?;
                if best.as_ref().is_none_or(|b| fit.fit.cost < b.fit.cost) {
                    best = Some(fit);
                }
            }
            fitted.extend(best.map(|explanation| Found {
                candidates: with(starts[0]),
                explanation,
            }));
            self.progress.advance(1);
        }
        self.progress.end();
        Ok(fitted)
    }

    /// Fits one more effect from where screening left it.
    fn fit_one(
        &self,
        stage: usize,
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
        let last = stage + 1 == self.bench.stages.len();
        let effort = if last { Effort::FULL } else { Effort::BRIEF };
        self.bench
            .explain(stage, &all, theta, starts, (effort, self.progress))
    }
}

/// Whether two lists hold the same members.
fn same(a: &[usize], b: &[usize]) -> bool {
    a.len() == b.len() && a.iter().all(|x| b.contains(x))
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
