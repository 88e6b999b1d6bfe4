//! Rivals of the set that stands, compared again with the error of each model's own time steps.

use asid_core::{Progress, Result};

use crate::candidate::Candidate;
use crate::latent_force::context::Context;
use crate::latent_force::fit::OwnSteps;
use crate::machine::Machine;

use super::prior::worth;
use super::{Outcome, Set};

/// Most rivals that are compared again: as many as are listed, with some in reserve.
const MOST: usize = 8;
/// Share of the evidence of the set that stands from which on a set is a rival.
///
/// The error of steps changes how well an effect explains the logs, and not whether it explains most
/// of them.
const RIVAL: f64 = 0.5;

/// Gives the rivals of the set that stands the evidence that they have relative to it if each model
/// has the error of its own time steps. A rival of no more names that is then worth more takes its
/// place.
///
/// `finer` is the machine at half its time step. Nothing changes where all walks are segments, or
/// once time is out.
///
/// # Errors
/// When the engine fails.
pub fn with_own_steps(
    context: &Context<'_>,
    candidates: &[Candidate],
    finer: &Machine,
    outcome: &mut Outcome,
    progress: &dyn Progress,
) -> Result<()> {
    let Outcome {
        none,
        rounds,
        best,
        missing,
        ..
    } = outcome;
    if context.step_error.columns() == 0 || best.candidates.is_empty() || progress.is_stopped() {
        return Ok(());
    }
    let rise = |set: &Set| set.fitted.evidence - none.evidence;
    let least = RIVAL * rise(best);
    let is_rival = |set: &Set| set.candidates != best.candidates && rise(set) >= least;
    let mut rivals: Vec<&mut Set> = rounds.iter_mut().flat_map(|r| &mut r.confirmed).collect();
    rivals.retain(|set| is_rival(set));
    rivals.sort_by(|a, b| rise(b).total_cmp(&rise(a)));
    rivals.truncate(MOST);
    if rivals.is_empty() {
        return Ok(());
    }
    let steps = OwnSteps {
        context,
        finer,
        none,
    };
    let of_best = steps.gain(&best.fitted)?;
    for rival in &mut rivals {
        if progress.is_stopped() {
            return Ok(());
        }
        rival.fitted.evidence += steps.gain(&rival.fitted)? - of_best;
    }
    let worth = |set: &Set| worth(context, candidates, set);
    rivals.retain(|set| set.names.count() <= best.names.count());
    let likeliest = (rivals.into_iter()).max_by(|a, b| worth(a).total_cmp(&worth(b)));
    if let Some(rival) = likeliest.filter(|rival| worth(rival) > worth(best)) {
        std::mem::swap(best, rival);
        missing[1] = best.fitted.estimate.missing(context);
    }
    Ok(())
}
