//! Forward selection of effects by evidence, with a look back after each.

mod prior;
mod prune;
mod round;
mod set;

use asid_core::{Progress, Result};

use crate::candidate::Candidate;
use crate::chance::threshold;
use crate::settings::Breadth;

use super::context::Context;
use super::estimate::Missing;
use super::fit::Fitted;

pub use prior::log_prior;
pub use round::{Round, Sight};
pub use set::{Set, name_of};

use round::Upon;
use set::{free_what_is_given, from_starts_of, is_due};

/// Deviations of the evidence about its plateaus by which a further effect must rise above the threshold: 95 %.
const WANDER: f64 = 2.0;

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

/// Searches upon the model without effects, among `candidates` without those that are `known` to act or not.
///
/// # Errors
/// When the engine fails.
pub fn search(
    context: &Context<'_>,
    none: &Fitted,
    (candidates, known): (&[Candidate], &[usize]),
    breadth: Breadth,
    progress: &dyn Progress,
) -> Result<Outcome> {
    let threshold = threshold(candidates.len(), breadth.false_alarms);
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
    // The set that stands with what no search tries, such as an offset of its friction: a rival of every further effect, which
    // needs no further name.
    let mut freed: Option<Set> = None;
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
            .filter(|c| !best.candidates.contains(c) && !known.contains(c))
            .filter(|&c| is_due(candidates, &best, c))
            .collect();
        let upon = Upon {
            context,
            base: &best,
            at_first,
            candidates,
            open: &open,
            breadth,
            progress,
        };
        let round = upon.round(&mut untried)?;
        let next = round.confirmed.first().cloned();
        rounds.push(round);
        let stopped = progress.is_stopped();
        if let (true, false, Some(next)) = (context.has_segments(), stopped, &next) {
            let again = from_starts_of(context, (&best, next), breadth, progress)?;
            if again.fitted.evidence > best.fitted.evidence {
                best = again;
                if best.candidates.is_empty() {
                    none = best.fitted.clone();
                }
            }
        }
        let next = next.filter(|n| {
            // A first fit that was cut short has not told yet how much of the force it makes up for.
            let cut_short = stopped && best.candidates.is_empty();
            let shrinks = cut_short || left(&best) - left(n) > breadth.shrinks;
            let unsure = WANDER * n.fitted.wander.hypot(best.fitted.wander);
            shrinks && n.fitted.evidence - best.fitted.evidence > threshold + unsure
        });
        if let Some(own) = freed.take() {
            let evidence = own.fitted.evidence + threshold;
            if next.as_ref().is_none_or(|n| n.fitted.evidence < evidence) {
                best = own;
                continue;
            }
        }
        let Some(next) = next else { break };
        best = next;
        if stopped {
            untried.push(Untried {
                stage: "values of the effects named that no search tries, such as an offset",
                sets: vec![best.candidates.clone()],
            });
            break;
        }
        freed = free_what_is_given(context, candidates, &best, (breadth, threshold), progress)?;
    }
    let best = freed.unwrap_or(best);
    let none = &none;
    let of = |f: &Fitted| f.estimate.missing(context);
    Ok(Outcome {
        none: none.clone(),
        missing: [of(none), of(&best.fitted)],
        rounds,
        best,
        untried,
    })
}
