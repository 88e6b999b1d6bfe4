//! Forward selection of effects by evidence, with a look back after each.

use asid_core::{Progress, Result};
use asid_effects::Start;
use nalgebra::DMatrix;

use crate::candidate::Candidate;

use super::columns::{Columns, Form};
use super::context::Context;
use super::estimate::Missing;
use super::fit::{Fitted, Hypothesis, Slopes, fit};
use super::screen::{Screened, isolability, rank, regressions};

/// How widely to search.
#[derive(Clone, Copy, Debug)]
pub struct Breadth {
    /// Share of the power of all that is missing without effects that a further effect must make up for: one that earns
    /// evidence and leaves the force as it was mends the noise model, and one that makes up for little is among the many
    /// small things by which any machine differs from its model. 0.04 is a fifth of the force.
    pub shrinks: f64,
    /// Sets that are fitted a little after each screening.
    pub raced: usize,
    /// Share of the leader's evidence that a set needs to be raced.
    pub share: f64,
    /// Evidence in screening below which nothing is raced, natural logarithm: the best of a hundred candidates reaches 3 to
    /// 5 by chance.
    pub least: f64,
    /// Share of the gain that the best has reached up to which a set may lie behind it after the short fits, and the evidence
    /// up to which it may in any case.
    pub behind: f64,
    /// See `behind`.
    pub near: f64,
    /// Sets of these that are fitted to the end.
    pub finished: usize,
    /// Most sets that are named one upon the other.
    pub depth: usize,
    /// Linearisations of a first short fit, and of a whole one.
    pub rounds: [usize; 2],
}

impl Default for Breadth {
    fn default() -> Self {
        Self {
            shrinks: 0.04,
            raced: 8,
            share: 0.1,
            least: 3.0,
            behind: 0.5,
            near: 20.0,
            finished: 3,
            depth: 4,
            rounds: [3, 15],
        }
    }
}

/// Leading candidates that are compared pair by pair.
const COMPARED: usize = 20;
/// Prior odds against an effect at a site where it comes to mind only after others.
const UNUSUAL: f64 = 10.0;

/// A set of effects, fitted.
#[derive(Clone, Debug)]
pub struct Set {
    /// Candidates, in the order in which they were added.
    pub candidates: Vec<usize>,
    /// The model.
    pub fitted: Fitted,
    /// How many named things it is: a group counts once.
    pub names: usize,
}

impl Set {
    /// Fits it on from where it stands, over at most `rounds` linearisations.
    fn fit(&mut self, context: &Context<'_>, rounds: usize, progress: &dyn Progress) -> Result<()> {
        let from = &self.fitted;
        self.fitted = fit(
            context,
            &from.hypothesis,
            &from.theta,
            (&from.estimate, &from.slopes),
            (rounds, progress),
        )?;
        Ok(())
    }
}

/// A round: what was screened and what was fitted upon a base.
#[derive(Clone, Debug)]
pub struct Round {
    /// Candidates of the base.
    pub base: Vec<usize>,
    /// Labels and evidences of screening, best first.
    pub screened: Vec<(Vec<usize>, f64)>,
    /// The leading candidates of screening, and the cosines of the smallest principal angle between each two.
    pub alike: (Vec<usize>, DMatrix<f64>),
    /// Sets that were fitted to the end, best first.
    pub confirmed: Vec<Set>,
}

/// A stage that was cut short, and the sets that it left out.
#[derive(Clone, Debug)]
pub struct Untried {
    /// What was left out.
    pub stage: &'static str,
    /// Candidates of each set.
    pub sets: Vec<Vec<usize>>,
}

/// What a search found.
pub struct Outcome {
    /// Without effects.
    pub none: Fitted,
    /// The rounds.
    pub rounds: Vec<Round>,
    /// What is missing without effects, and with those that stand.
    pub missing: [Missing; 2],
    /// The set that stands; that without effects where nothing earned its place.
    pub best: Set,
    /// What was left out because the work was stopped.
    pub untried: Vec<Untried>,
}

/// The model with some more candidates, and values to begin with.
fn with(
    base: &Fitted,
    columns: &Columns,
    candidates: &[Candidate],
    screened: &Screened,
) -> (Hypothesis, Vec<f64>, Vec<usize>) {
    let mut hypothesis = base.hypothesis.clone();
    let mut theta = base.theta.clone();
    for (&i, c) in base.hypothesis.free().iter().zip(&screened.base) {
        let u = &base.hypothesis.unknowns[i];
        theta[i] = (theta[i] + c * u.deviation).clamp(u.bounds[0], u.bounds[1]);
    }
    let mut added = Vec::new();
    for (&f, coefficients) in screened.forms.iter().zip(&screened.coefficients) {
        let form: &Form = &columns.forms[f];
        let candidate = &candidates[form.candidate];
        hypothesis.specs.push(candidate.spec.clone());
        hypothesis.unknowns.extend(form.unknowns(candidate));
        theta.extend(form.values(candidate, coefficients));
        added.push(form.candidate);
    }
    (hypothesis, theta, added)
}

/// Searches upon the model without effects.
///
/// # Errors
/// When the engine fails.
pub fn search(
    context: &Context<'_>,
    none: &Fitted,
    candidates: &[Candidate],
    breadth: Breadth,
    progress: &dyn Progress,
) -> Result<Outcome> {
    let threshold = threshold(candidates.len());
    let mut best = Set {
        candidates: Vec::new(),
        fitted: none.clone(),
        names: 0,
    };
    let at_first = none.estimate.missing(context);
    let mut none = none.clone();
    let left = |s: &Set| s.fitted.estimate.missing(context).relative_to(at_first);
    let mut rounds: Vec<Round> = Vec::new();
    let mut untried = Vec::new();
    for _ in 0..breadth.depth {
        if left(&best) < breadth.shrinks {
            break;
        }
        // The first screening is the least that an answer rests on.
        if !rounds.is_empty() && progress.is_stopped() {
            untried.push(Untried {
                stage: "further effects beside those named",
                sets: vec![best.candidates.clone()],
            });
            break;
        }
        let open: Vec<usize> = (0..candidates.len())
            .filter(|&c| !best.candidates.contains(&c) && is_due(candidates, &best, c))
            .collect();
        let told = (progress, &mut untried);
        let round = one_round(context, &best, candidates, &open, breadth, told)?;
        let next = round.confirmed.first().cloned();
        rounds.push(round);
        let Some(next) = next else { break };
        if context.has_segments() {
            let again = from_starts_of(context, (&best, &next), breadth, progress)?;
            if again.fitted.evidence > best.fitted.evidence {
                best = again;
                if best.candidates.is_empty() {
                    none = best.fitted.clone();
                }
            }
        }
        let shrinks = left(&best) - left(&next) > breadth.shrinks;
        if next.fitted.evidence - best.fitted.evidence < threshold || !shrinks {
            break;
        }
        best = next;
    }
    let none = &none;
    let best = if progress.is_stopped() {
        if !best.candidates.is_empty() {
            untried.push(Untried {
                stage: "values of the effects named that no search tries, such as an offset",
                sets: vec![best.candidates.clone()],
            });
        }
        best
    } else {
        free_what_is_given(context, candidates, best, (breadth, threshold), progress)?
    };
    let of = |f: &Fitted| f.estimate.missing(context);
    Ok(Outcome {
        none: none.clone(),
        missing: [of(none), of(&best.fitted)],
        rounds,
        best,
        untried,
    })
}

/// A set fitted once more from where another one has put the starts of segments: of the many ways to begin that leave little of
/// the readings a fit finds one, and what another one owes to a better one is no evidence for its effects.
fn from_starts_of(
    context: &Context<'_>,
    (set, other): (&Set, &Set),
    breadth: Breadth,
    progress: &dyn Progress,
) -> Result<Set> {
    let mut again = set.clone();
    again.fitted.estimate = other.fitted.estimate.clone();
    again.fitted.slopes = Slopes::default();
    again.fit(context, breadth.rounds[1], progress)?;
    Ok(again)
}

/// Fits what no search tries (an offset of friction between the directions) of the effects that were named, where it
/// earns its place.
fn free_what_is_given(
    context: &Context<'_>,
    candidates: &[Candidate],
    best: Set,
    (breadth, threshold): (Breadth, f64),
    progress: &dyn Progress,
) -> Result<Set> {
    let mut best = best;
    let mut at = best.fitted.hypothesis.unknowns.len();
    for &c in best.candidates.clone().iter().rev() {
        let parameters = candidates[c].parameters();
        at -= parameters.len();
        for (i, p) in parameters.iter().enumerate() {
            if p.start != Start::Given {
                continue;
            }
            let mut hypothesis = best.fitted.hypothesis.clone();
            let unknown = &mut hypothesis.unknowns[at + i];
            unknown.free = true;
            // As uncertain as the effect itself is large.
            let own = &best.fitted.theta[at..at + parameters.len()];
            let sizes = own.iter().zip(parameters);
            let size = sizes
                .filter(|(_, q)| q.unit == p.unit)
                .map(|(x, q)| (x - q.null).abs())
                .fold(0.0, f64::max);
            if size > 0.0 {
                unknown.deviation = unknown.deviation.min(size);
            }
            let (theta, from) = (&best.fitted.theta, &best.fitted);
            let from = (&from.estimate, &from.slopes);
            let rounds = (breadth.rounds[1], progress);
            let fitted = fit(context, &hypothesis, theta, from, rounds)?;
            if fitted.evidence - best.fitted.evidence > threshold {
                best.fitted = fitted;
            }
        }
    }
    Ok(best)
}

/// Labels of some candidates.
#[must_use]
pub fn name_of(candidates: &[Candidate], set: &[usize]) -> String {
    let labels: Vec<String> = set.iter().map(|&c| candidates[c].label()).collect();
    labels.join(" + ")
}

/// The candidate that another one refines: the simpler law at the same site.
fn refined_by(candidates: &[Candidate], finer: usize) -> Option<usize> {
    let fine = &candidates[finer];
    let simpler = fine.effect.refines();
    candidates
        .iter()
        .position(|c| c.spec.site == fine.spec.site && simpler.contains(&&*c.spec.name))
}

/// Whether a candidate's turn has come: a refinement's once the simpler law is named.
fn is_due(candidates: &[Candidate], set: &Set, candidate: usize) -> bool {
    refined_by(candidates, candidate).is_none_or(|simpler| set.candidates.contains(&simpler))
}

/// A set without one of its candidates, its other values as they are.
fn without(set: &Set, candidates: &[Candidate], out: usize) -> Set {
    let mut set = set.clone();
    let Some(place) = set.candidates.iter().position(|&c| c == out) else {
        return set;
    };
    let lengths =
        |c: &[usize]| -> usize { c.iter().map(|&c| candidates[c].parameters().len()).sum() };
    let fitted = &mut set.fitted;
    let study = fitted.theta.len() - lengths(&set.candidates);
    let first = study + lengths(&set.candidates[..place]);
    let range = first..first + candidates[out].parameters().len();
    fitted.theta.drain(range.clone());
    fitted.hypothesis.unknowns.drain(range);
    fitted.hypothesis.specs.remove(place);
    fitted.slopes = Slopes::default();
    set.candidates.remove(place);
    set
}

/// Deviations from null up to which a value counts as nothing, and the evidence that a set may lose when it is left out.
const IDLE: f64 = 2.0;
const IDLE_LOSS: f64 = 1.0;

/// A set without the members that do nothing in it: those of a group that are as the model has them, and those that a later
/// effect has taken the place of.
fn pruned(
    context: &Context<'_>,
    candidates: &[Candidate],
    set: Set,
    breadth: Breadth,
    progress: &dyn Progress,
) -> Result<Set> {
    let fitted = &set.fitted;
    let free = fitted.hypothesis.free();
    let parameters = |c: usize| candidates[c].parameters().len();
    let mut at = fitted.theta.len() - set.candidates.iter().map(|&c| parameters(c)).sum::<usize>();
    let mut idle = Vec::new();
    for &c in &set.candidates {
        let range = at..at + parameters(c);
        at = range.end;
        let strength = |i: usize| {
            let p = &candidates[c].parameters()[i - range.start];
            let k = free.iter().position(|&f| f == i)?;
            let deviation = fitted.covariance[(k, k)].max(0.0).sqrt();
            (p.start == Start::Slope).then(|| (fitted.theta[i] - p.null).abs() / deviation)
        };
        let strengths: Vec<f64> = range.clone().filter_map(strength).collect();
        if !strengths.is_empty() && strengths.iter().all(|s| *s < IDLE) {
            idle.push(c);
        }
    }
    if idle.is_empty() || idle.len() == set.candidates.len() {
        return Ok(set);
    }
    let mut smaller = set.clone();
    for c in idle {
        smaller = without(&smaller, candidates, c);
    }
    smaller.fit(context, breadth.rounds[1], progress)?;
    let kept = smaller.fitted.evidence > set.fitted.evidence - IDLE_LOSS;
    Ok(if kept { smaller } else { set })
}

/// Evidence that a further effect must earn: the best of `n` reaches about `ln n` by chance, and a factor of 20 upon it.
fn threshold(n: usize) -> f64 {
    (20.0 * n.max(1) as f64).ln()
}

/// Screens the open candidates upon a set and fits the few that lead.
fn one_round(
    context: &Context<'_>,
    base: &Set,
    candidates: &[Candidate],
    open: &[usize],
    breadth: Breadth,
    (progress, untried): (&dyn Progress, &mut Vec<Untried>),
) -> Result<Round> {
    progress.begin("screening", 1);
    let some: Vec<Candidate> = open.iter().map(|&c| candidates[c].clone()).collect();
    let fitted = &base.fitted;
    let model = (&fitted.hypothesis, &fitted.theta[..]);
    let columns = Columns::of(context, model, &fitted.estimate, &some)?;
    let sums = regressions(context, &fitted.estimate, &columns);
    let ranked = rank(&sums, &columns, &some);
    progress.end();
    let label = |s: &Screened| -> Vec<usize> {
        s.forms
            .iter()
            .map(|&f| open[columns.forms[f].candidate])
            .collect()
    };
    let screened: Vec<(Vec<usize>, f64)> = ranked.iter().map(|s| (label(s), s.gain)).collect();
    let singles = ranked.iter().filter(|s| s.forms.len() == 1);
    let leading: Vec<usize> = singles.map(|s| s.forms[0]).take(COMPARED).collect();
    let alike = (
        leading
            .iter()
            .map(|&f| open[columns.forms[f].candidate])
            .collect(),
        isolability(&sums[0], &columns, &leading),
    );
    let name = |set: &[usize]| name_of(candidates, set);
    let rows = screened.iter().map(|(set, gain)| (name(set), *gain));
    let upon = match &base.candidates[..] {
        [] => String::new(),
        set => format!(" upon {}", name(set)),
    };
    progress.ranking(&format!("screening{upon}"), &rows.collect::<Vec<_>>());
    let lead = ranked.first().map_or(0.0, |s| s.gain);
    let least = (breadth.share * lead).max(breadth.least);
    let due = ranked.iter().take(breadth.raced).filter(|s| s.gain > least);
    let due: Vec<&Screened> = due.collect();
    progress.begin("confirming", due.len() as u64);
    let mut racing = Vec::new();
    let mut left_out = Vec::new();
    for s in due {
        if !racing.is_empty() && progress.is_stopped() {
            left_out.push(label(s));
            continue;
        }
        progress.note(&format!("trying {}", name(&label(s))));
        let (hypothesis, theta, added) = with(fitted, &columns, &some, s);
        let mut members = base.candidates.clone();
        members.extend(added.iter().map(|&c| open[c]));
        let mut set = Set {
            candidates: members,
            fitted: Fitted {
                hypothesis,
                theta,
                ..fitted.clone()
            },
            names: base.names + 1,
        };
        for &c in &added {
            if let Some(simpler) = refined_by(candidates, open[c]) {
                set = without(&set, candidates, simpler);
                set.names = base.names;
            }
        }
        set.fit(context, breadth.rounds[0], progress)?;
        racing.push(set);
        progress.advance(1);
    }
    // What a set promises counts for it, but only what one has reached counts against the others.
    let hoped = |s: &Set| s.fitted.evidence + s.fitted.promised;
    racing.sort_by(|a, b| hoped(b).total_cmp(&hoped(a)));
    let reached = racing.iter().map(|s| s.fitted.evidence);
    let mut best = reached.fold(fitted.evidence, f64::max);
    let mut confirmed: Vec<Set> = Vec::new();
    let mut unfinished = Vec::new();
    for mut set in racing.into_iter().take(breadth.finished) {
        let behind = (breadth.behind * (best - fitted.evidence)).max(breadth.near);
        if best - hoped(&set) > behind {
            continue;
        }
        if progress.is_stopped() {
            unfinished.push(set.candidates.clone());
            confirmed.push(set);
            continue;
        }
        progress.note(&format!("fitting {}", name(&set.candidates)));
        // To the end by slopes of its own.
        set.fitted.slopes = Slopes::default();
        set.fit(context, breadth.rounds[1], progress)?;
        best = best.max(set.fitted.evidence);
        if progress.is_stopped() {
            unfinished.push(set.candidates.clone());
            confirmed.push(set);
            continue;
        }
        confirmed.push(pruned(context, candidates, set, breadth, progress)?);
    }
    progress.end();
    let cut = [
        ("confirmation of what leads in screening", left_out),
        ("fit to the end", unfinished),
    ];
    let cut = cut.into_iter().filter(|(_, sets)| !sets.is_empty());
    untried.extend(cut.map(|(stage, sets)| Untried { stage, sets }));
    let plant = context.plant();
    let unusual = |c: &usize| {
        let c = &candidates[*c];
        c.effect.unusual_at(plant, &c.spec.site)
    };
    let worth = |s: &Set| {
        let count = s.candidates.iter().filter(|c| unusual(c)).count();
        s.fitted.evidence - UNUSUAL.ln() * count as f64
    };
    confirmed.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
    let gain = |s: &Set| worth(s) - fitted.evidence;
    let rows = confirmed.iter().map(|s| (name(&s.candidates), gain(s)));
    progress.ranking(&format!("fits{upon}"), &rows.collect::<Vec<_>>());
    Ok(Round {
        base: base.candidates.clone(),
        screened,
        alike,
        confirmed,
    })
}
