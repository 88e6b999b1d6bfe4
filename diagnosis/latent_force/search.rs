//! Forward selection of effects by evidence, with a look back after each.

mod about_replays;
mod begun;
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
mod open_loop;
mod path;
mod prior;
mod prune;
mod race;
mod replayed_order;
mod round;
mod screening;
mod second_look;
mod set;
mod tolerances;
mod twins;

use asid_core::{Progress, Result};

use crate::candidate::{Candidate, nameable};
use crate::chance::threshold;
use crate::settings::Breadth;

use super::context::Context;
use super::estimate::Missing;
use super::fit::Fitted;

pub use open_loop::OpenLoop;
pub use prior::log_prior;
pub use round::{Round, Seen};
pub use screening::Sight;
pub use set::{Set, labels_of, name_of};
pub use tolerances::Tolerances;

use path::Path;
use prior::worth;
use set::{from_fit_of, is_due};

/// The stage that looks for what is missing beside a set.
const FURTHER: &str = "further effects beside those named";
/// The stage that frees what is given of the effects that are named.
const GIVEN: &str = "values of the effects named that no search tries, such as an offset";

/// A stage that was cut short, and the sets that it left out.
#[derive(Clone, Debug)]
pub struct Untried {
    /// What was left out.
    pub stage: &'static str,
    /// Candidates of each set.
    pub sets: Vec<Vec<usize>>,
}

impl Untried {
    /// What was left out of a stage upon a set.
    fn upon(set: &Set, stage: &'static str) -> Self {
        Self {
            stage,
            sets: vec![set.candidates.clone()],
        }
    }
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

/// Whether a set has what an ordinary machine has of everything.
fn has_tolerances(candidates: &[Candidate], set: &Set) -> bool {
    set.candidates.iter().any(|&c| candidates[c].is_tolerance)
}

/// Whether a set has a candidate within its tolerance.
fn is_within(candidates: &[Candidate], set: &Set, candidate: usize) -> bool {
    let like = |&c: &usize| {
        candidates[c].is_tolerance && candidates[c].label() == candidates[candidate].label()
    };
    set.candidates.iter().any(like)
}

/// Candidates that are tried upon a set: not those in it, within their tolerances or else, nor those that are `known` to act or not.
fn open_upon(candidates: &[Candidate], known: &[usize], set: &Set) -> Vec<usize> {
    (0..candidates.len())
        .filter(|&c| !candidates[c].is_tolerance && !is_within(candidates, set, c))
        .filter(|c| !set.candidates.contains(c) && !known.contains(c))
        .filter(|&c| is_due(candidates, set, c))
        .collect()
}

/// Fits the set that stands from where the `next` one has come to, where there is time and that raises its evidence; what is
/// without effects is then the better model without effects too. One that does not rise above it by the `threshold` as it is changes nothing.
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

/// Whether time has ended before the set that stands could be fitted from the starts of segments of the next one: what a further effect
/// owes to better starts, or to more rounds, is only known then.
fn is_cut_short(context: &Context<'_>, best: &Set, progress: &dyn Progress) -> bool {
    context.has_segments() && !best.candidates.is_empty() && progress.is_stopped()
}

/// What follows on the set that stands after a round: the `next` one that has earned it, or where none has and the search goes on the set with
/// tolerances beside it, if these earn it; with the names that it has once tolerances are among it.
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

/// A search: what it is in, and what it chooses from.
struct Search<'s> {
    context: &'s Context<'s>,
    candidates: &'s [Candidate],
    /// Candidates that are known to act or not.
    known: &'s [usize],
    breadth: Breadth,
    open_loop: OpenLoop<'s>,
    progress: &'s dyn Progress,
    /// What is missing without effects.
    at_first: Missing,
    /// Evidence by which a name must rise above the set that stands.
    threshold: f64,
}

/// Searches upon the model without effects, among `candidates` without those that are `known` to act or not. Where hardly any force is missing
/// and `open_loop` replays still leave a gap, as of a stiff drive that was made softer, what a further name closes of that gap counts.
///
/// Which of two first names is the right one may only show once the second is there: where one is not far behind the one that was taken, and
/// something was missing beside that, the search goes on from it too, and what is more likely in the end stands. What no fit has told from a name
/// that stands is a rival at the end too.
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
        at_first: none.estimate.missing(context),
        threshold: threshold(nameable(candidates), breadth.false_alarms),
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
