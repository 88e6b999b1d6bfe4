//! The gap of the open loop: what a further name counts by where hardly any force is missing, as of a stiff drive that was made softer.

use asid_core::{Progress, Result};

use crate::findings::{LEAST_GAP, NEGLIGIBLE};
use crate::latent_force::context::Context;
use crate::latent_force::fit::Fitted;
use crate::settings::Breadth;

use super::set::Set;

/// Share of what the set that stands leaves of the gap that a further name must close to count by it, where it leaves the missing force as it is:
/// more than half, as in a small gap ([`crate::decision`]). What errors add up to over a whole log may change by a few per cent for
/// any reason.
pub(super) const MOST: f64 = 0.5;

/// Open-loop replays of whole logs.
#[derive(Clone, Copy)]
pub struct OpenLoop<'o> {
    /// Excess power that they leave of the training logs, of a set.
    pub excess: &'o dyn Fn(&Set) -> Result<f64>,
    /// Residuals of the training logs that they leave, of a set; their squares add up to the mean square in units of the noise.
    pub residuals: &'o dyn Fn(&Set) -> Result<Vec<f64>>,
    /// The same of replays that begin where the logs themselves say, as far as they do.
    pub as_logged: &'o dyn Fn(&Set) -> Result<Vec<f64>>,
    /// A set with its values fitted to them, after the excess power that they then leave.
    pub fitted: &'o dyn Fn(&Set) -> Result<(f64, Set)>,
    /// States of a set along the walks, `rows x (nq + nv)` each.
    pub states: &'o dyn Fn(&Set) -> Result<Vec<Vec<f64>>>,
    /// Physics steps of one of all training logs.
    pub steps: usize,
    /// Whether they leave a gap without effects. Where they do not, no set could close one: a screening tells what the logs could have
    /// shown, and nothing is fitted.
    pub is_gap: bool,
}

impl OpenLoop<'_> {
    /// Whether a set rises above the one before it by a threshold: by more than what the evidence of both scatters by, or, of segments, where replays of whole
    /// logs confirm it by most of the gap that the one before leaves with its values fitted to them. Evidence scatters by how segments begin, which these
    /// do not depend on.
    pub(super) fn rises(
        &self,
        context: &Context<'_>,
        (before, after): (&Set, &Set),
        threshold: f64,
    ) -> Result<bool> {
        if after.rises_above(before, threshold) {
            return Ok(true);
        }
        let is_more = after.fitted.evidence - before.fitted.evidence > threshold;
        if !is_more || !context.has_segments() {
            return Ok(false);
        }
        let most = (self.excess)(after)? / (1.0 - MOST);
        Ok(most < (self.excess)(before)? && most < (self.fitted)(before)?.0)
    }

    /// Whether a set closes most of the gap that the one before it leaves. A sensor that reads to another scale hardly changes which force is
    /// missing, and all that is foretold.
    pub(super) fn is_mostly_closed(
        &self,
        context: &Context<'_>,
        (before, after): (&Set, &Set),
    ) -> Result<bool> {
        if context.has_segments() {
            return Ok(false);
        }
        let now = (self.excess)(before)?;
        let is_there = now.is_finite() && now > LEAST_GAP * LEAST_GAP - 1.0;
        Ok(is_there && (self.excess)(after)? < (1.0 - MOST) * now)
    }
}

/// The gap of the open loop, which counts where hardly any force is missing.
pub(super) struct OpenLoopGap<'o> {
    replay: OpenLoop<'o>,
    /// Excess power without effects and of the set that stands, once that counts.
    excess: Option<[f64; 2]>,
}

impl<'o> OpenLoopGap<'o> {
    /// The gap by some replays.
    pub(super) fn by(replay: OpenLoop<'o>) -> Self {
        Self {
            replay,
            excess: None,
        }
    }

    /// Whether the set that stands leaves as much of it as a further effect must close.
    pub(super) fn is_left(
        &mut self,
        context: &Context<'_>,
        (none, best): (&Fitted, &Set),
        (breadth, progress): (Breadth, &dyn Progress),
    ) -> Result<bool> {
        self.excess = if context.has_segments() || progress.is_stopped() {
            None
        } else {
            let first = match self.excess {
                Some([first, _]) => first,
                None => (self.replay.excess)(&Set::without_effects(none))?,
            };
            Some([first, (self.replay.excess)(best)?])
        };
        Ok(self.excess.is_some_and(|[first, now]| {
            now.is_finite() && now > (breadth.shrinks * first).max(NEGLIGIBLE * NEGLIGIBLE)
        }))
    }

    /// Whether a set closes as much of it.
    pub(super) fn is_closed_by(&self, set: &Set, breadth: Breadth) -> Result<bool> {
        Ok(match self.excess {
            Some([first, now]) => now - (self.replay.excess)(set)? > breadth.shrinks * first,
            None => false,
        })
    }
}
