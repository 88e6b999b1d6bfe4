//! Forward selection of effects by evidence, with a look back after each.

mod breadth;
mod round;
mod set;

use asid_core::{Progress, Result};

use crate::candidate::Candidate;

use super::context::Context;
use super::estimate::Missing;
use super::fit::Fitted;

pub use breadth::Breadth;
pub use round::Round;
pub use set::{Set, name_of};

use round::Upon;
use set::{free_what_is_given, from_starts_of, is_due};

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
            .filter(|c| !best.candidates.contains(c) && !known.contains(c))
            .filter(|&c| is_due(candidates, &best, c))
            .collect();
        let upon = Upon {
            context,
            base: &best,
            candidates,
            open: &open,
            breadth,
            progress,
        };
        let round = upon.round(&mut untried)?;
        let next = round.confirmed.first().cloned();
        rounds.push(round);
        let Some(next) = next else { break };
        let stopped = progress.is_stopped();
        if context.has_segments() && !stopped {
            let again = from_starts_of(context, (&best, &next), breadth, progress)?;
            if again.fitted.evidence > best.fitted.evidence {
                best = again;
                if best.candidates.is_empty() {
                    none = best.fitted.clone();
                }
            }
        }
        // A fit that was cut short has not told yet how much of the force it makes up for.
        let shrinks = stopped || left(&best) - left(&next) > breadth.shrinks;
        if next.fitted.evidence - best.fitted.evidence < threshold || !shrinks {
            break;
        }
        best = next;
        if stopped {
            untried.push(Untried {
                stage: "values of the effects named that no search tries, such as an offset",
                sets: vec![best.candidates.clone()],
            });
            break;
        }
        // Before further effects, which would stand in for it.
        best = free_what_is_given(context, candidates, best, (breadth, threshold), progress)?;
    }
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

/// Evidence that a further effect must earn: the best of `n` reaches about `ln n` by chance, and a factor of 20 upon it.
fn threshold(n: usize) -> f64 {
    (20.0 * n.max(1) as f64).ln()
}
