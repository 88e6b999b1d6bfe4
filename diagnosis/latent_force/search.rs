//! Forward selection of effects by evidence, with corrections after each.

mod about_replays;
mod begun;
#[cfg(test)]
pub mod by_hand;
mod by_replays;
mod confused;
mod due;
mod exchanged;
mod finer;
mod finish;
mod freed;
mod given_back;
mod line;
mod line_fit;
mod measure;
mod names;
mod open_loop;
mod own_steps;
mod path;
mod prior;
mod prune;
mod race;
mod replayed_order;
mod round;
mod savage_dickey;
mod screening;
mod second_look;
mod set;
mod tolerances;
mod twins;

use asid_core::{Progress, Result};

use crate::candidate::{Candidate, threshold};
use crate::settings::Breadth;

use super::context::Context;
use super::estimate::{Estimate, Missing};
use super::fit::Fitted;

pub use names::Names;
pub use open_loop::OpenLoop;
pub use own_steps::with_own_steps;
pub use prior::log_prior;
pub use round::{Round, Seen};
pub use screening::Sight;
pub use set::{Set, labels_of, name_of, refined_by};
pub use tolerances::Tolerances;

use path::Path;
use prior::worth;
use set::{from_fit_of, is_due};

/// Stage that looks for further effects besides a set.
const FURTHER: &str = "further effects beside those named";
/// Stage that frees the given values of the named effects.
const GIVEN: &str = "values of the effects named that no search tries, such as an offset";

/// A stage that was cut short, with the sets that it left out.
#[derive(Clone, Debug)]
pub struct Untried {
    /// What was left out.
    pub stage: &'static str,
    /// Candidates of each set.
    pub sets: Vec<Vec<usize>>,
}

impl Untried {
    /// A stage that was cut short with a set as its base.
    fn upon(set: &Set, stage: &'static str) -> Self {
        Self {
            stage,
            sets: vec![set.candidates.clone()],
        }
    }
}

/// Result of a search.
pub struct Outcome {
    /// The fitted model without effects.
    pub none: Fitted,
    /// The rounds.
    pub rounds: Vec<Round>,
    /// What is missing without effects, and with the set that stands.
    pub missing: [Missing; 2],
    /// The set that stands: the model without effects if nothing earned its place.
    pub best: Set,
    /// What was left out because the search was stopped.
    pub untried: Vec<Untried>,
}

/// Whether a set includes tolerances.
fn has_tolerances(candidates: &[Candidate], set: &Set) -> bool {
    set.candidates.iter().any(|&c| candidates[c].is_tolerance)
}

/// Whether a set holds the effect of a candidate within its tolerance.
fn is_within(candidates: &[Candidate], set: &Set, candidate: usize) -> bool {
    let like = |&c: &usize| {
        candidates[c].is_tolerance && candidates[c].label() == candidates[candidate].label()
    };
    set.candidates.iter().any(like)
}

/// Candidates that are open with a set as the base.
///
/// These exclude members of the set, effects that it holds within their tolerances, and candidates
/// that are `known` to act or not. A refinement is open only if the law that it refines is named.
fn open_upon(candidates: &[Candidate], known: &[usize], set: &Set) -> Vec<usize> {
    (0..candidates.len())
        .filter(|&c| !candidates[c].is_tolerance && !is_within(candidates, set, c))
        .filter(|c| !set.candidates.contains(c) && !known.contains(c))
        .filter(|&c| is_due(candidates, set, c))
        .collect()
}

/// Refits the set that stands from the result of the `next` set, and keeps the fit if its evidence
/// is higher.
///
/// If the set that stands has no effects, `none` becomes that better fit too. Nothing is refitted
/// once time is out. Along rows, nothing is refitted either unless `next` exceeds the set that
/// stands by the `threshold`.
fn fit_from(
    context: &Context<'_>,
    (next, threshold): (Option<&Set>, f64),
    (best, none): (&mut Set, &mut Fitted),
    (breadth, progress): (Breadth, &dyn Progress),
) -> Result<()> {
    let rises = |n: &&Set| context.has_segments() || n.rises_above(best, threshold);
    let Some(next) = next.filter(rises).filter(|_| !progress.is_stopped()) else {
        return Ok(());
    };
    progress.note("fitting what stands from there");
    let again = from_fit_of(context, (best, next), breadth, progress)?;
    if again.fitted.evidence > best.fitted.evidence {
        *best = again;
        if best.candidates.is_empty() {
            *none = best.fitted.clone();
        }
    }
    Ok(())
}

/// Whether time ran out before the set that stands could be refitted from the initial states of the
/// next set.
///
/// Only that refit shows how much of a further effect's evidence is due to better initial states or
/// to more linearisations.
fn is_cut_short(context: &Context<'_>, best: &Set, progress: &dyn Progress) -> bool {
    context.has_segments() && !best.candidates.is_empty() && progress.is_stopped()
}

/// The set that follows the one that stands after a round.
///
/// This is the `next` set, which has earned its place. If there is none and time is left, it is the
/// set that stands with tolerances, if these earn their place. Once tolerances are included, the
/// names of the set are settled again.
fn upon_tolerances(
    context: &Context<'_>,
    candidates: &[Candidate],
    (best, next, at_first): (&Set, Option<Set>, Missing),
    round: Option<&mut Round>,
    how: (Breadth, &dyn Progress),
) -> Result<Option<Set>> {
    let Some(round) = round.filter(|_| !has_tolerances(candidates, best)) else {
        return Ok(next);
    };
    let Some(tolerances) = round.tolerances.clone() else {
        return Ok(next);
    };
    let next = match next {
        None if !how.1.is_stopped() => {
            tolerances.earned(context, candidates, (best, at_first), how)?
        }
        next => next,
    };
    match next {
        Some(next) if has_tolerances(candidates, &next) => {
            let settled = tolerances.settled(context, candidates, (next, at_first), how)?;
            round.confirmed.push(settled.clone());
            Ok(Some(settled))
        }
        next => Ok(next),
    }
}

/// A search: its data, its candidates and its settings.
struct Search<'s> {
    context: &'s Context<'s>,
    candidates: &'s [Candidate],
    /// Candidates that are known to act or not.
    known: &'s [usize],
    breadth: Breadth,
    open_loop: OpenLoop<'s>,
    progress: &'s dyn Progress,
    /// The estimate without effects, and what is missing there.
    without: &'s Estimate,
    at_first: Missing,
    /// Evidence by which a name must exceed the set that stands.
    threshold: f64,
}

/// Searches for effects, starting from the model without effects.
///
/// The search uses the `candidates` that are not `known` to act or not. If hardly any force is
/// missing but `open_loop` replays still leave a gap, a further name counts by how much of that gap
/// it closes. A stiff drive that became softer is an example.
///
/// Which of two first names is correct may show only once the second name is there. If one was not
/// far behind the one that was taken, and something was still missing, the search also continues
/// from it. The more likely end stands. At the end, sets that no fit has separated from a name that
/// stands are added as rivals.
///
/// # Errors
/// When the engine fails.
pub fn search(
    context: &Context<'_>,
    none: &Fitted,
    (candidates, known): (&[Candidate], &[usize]),
    breadth: Breadth,
    (open_loop, progress): (OpenLoop<'_>, &dyn Progress),
) -> Result<Outcome> {
    let search = Search {
        context,
        candidates,
        known,
        breadth,
        open_loop,
        progress,
        without: &none.estimate,
        at_first: none.estimate.missing(context),
        threshold: threshold(candidates, context.has_segments(), breadth.false_alarms),
    };
    let mut none = none.clone();
    let mut path = search.follow(Path::from(Set::without_effects(&none)), &mut none)?;
    if let Some(second) = search.second(&path) {
        if progress.is_stopped() {
            path.untried.push(Untried::upon(&second, FURTHER));
        } else {
            let other = search.follow(Path::from(second), &mut none)?;
            path = path.or(other, |set| worth(context, candidates, set));
        }
    }
    path = search.refine(path)?;
    path = search.exchange(path)?;
    search.with_twins(&mut path)?;
    let missing = [&none, &path.best.fitted].map(|f| f.estimate.missing(context));
    Ok(Outcome {
        none,
        missing,
        rounds: path.rounds,
        best: path.best,
        untried: path.untried,
    })
}
