//! Where whole replays begin: what multiple shooting finds of the study's parameters and of the starts.
//!
//! A replay of a whole log through many contacts depends so strongly on what it begins with that a fit of it
//! stops at the first of many local minima. Fits of short segments, whose starts are free, have few of them (Bock 1983):
//! they come near enough for replays to end where they should.

use asid_core::{Progress, Result};

use crate::latent_force::context::Context;
use crate::latent_force::estimate::Estimate;
use crate::latent_force::fit::{Hypothesis, Slopes, fit, settle_noise};
use crate::machine::Machine;
use crate::predict::State;
use crate::shot::Shot;

/// Linearisations and rounds of EM before the fit.
const FIRST: (usize, usize) = (2, 8);
/// Most linearisations of the fit: replays take it further.
const ROUNDS: usize = 6;
/// Mean square of what segments leave beyond their noise, in units of it, from which on something is missing: a gap of 1.5.
const SEEN: f64 = 1.25;

/// What replays take over.
pub struct Handover {
    /// The machine.
    pub machine: Machine,
    /// Where multiple shooting arrived; `None` where it was not asked for.
    pub shot: Option<Shot>,
}

/// Fits the study's parameters and the starts of all segments.
///
/// # Errors
/// As [`fit`].
pub(super) fn shoot(
    context: &Context<'_>,
    (hypothesis, nominal): (&Hypothesis, &[f64]),
    mut estimate: Estimate,
    progress: &dyn Progress,
) -> Result<Shot> {
    settle_noise(context, hypothesis, nominal, &mut estimate, FIRST, progress)?;
    let begin = (&estimate, &Slopes::default());
    let rounds = (ROUNDS, progress);
    let found = fit(context, hypothesis, nominal, begin, rounds)?;
    let layout = &context.plant().layout;
    let mut starts = vec![None; context.logs.episodes.len()];
    for (walk, states) in context.walks.iter().zip(&found.estimate.trajectory) {
        if walk.rows[0] == 0 {
            starts[walk.episode] = Some(State {
                qpos: states[..layout.nq].to_vec(),
                qvel: states[layout.nq..layout.nq + layout.nv].to_vec(),
            });
        }
    }
    Ok(Shot {
        lacks: found.estimate.missing(context).readings > SEEN,
        theta: found.theta,
        starts,
    })
}
