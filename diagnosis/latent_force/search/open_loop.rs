//! The open-loop gap, by which a further name counts if hardly any force is missing.
//!
//! A stiff drive that was made softer is an example.

use asid_core::{Progress, Result};

use crate::findings::{LEAST_GAP, NEGLIGIBLE};
use crate::latent_force::context::Context;
use crate::latent_force::fit::Fitted;
use crate::settings::Breadth;

use super::set::Set;

/// Share of the remaining gap that a further name must close to count by it, if it leaves the
/// missing force as it is.
///
/// It is more than half, as for a small gap ([`crate::decision`]). Errors that accumulate over a
/// whole log may change by a few per cent for any reason.
pub(super) const MOST: f64 = 0.5;

/// Open-loop replays of whole logs.
#[derive(Clone, Copy)]
pub struct OpenLoop<'o> {
    /// Excess power that replays of a set leave of the training logs.
    pub excess: &'o dyn Fn(&Set) -> Result<f64>,
    /// Residuals that replays of a set leave of the training logs; the sum of their squares is the
    /// mean square in units of the noise.
    pub residuals: &'o dyn Fn(&Set) -> Result<Vec<f64>>,
    /// The same for replays from the initial states that the logs give, as far as they do.
    pub as_logged: &'o dyn Fn(&Set) -> Result<Vec<f64>>,
    /// A set with its values fitted to replays, and the excess power that is then left.
    pub fitted: &'o dyn Fn(&Set) -> Result<(f64, Set)>,
    /// States of a set along the walks, `rows x (nq + nv)` each.
    pub states: &'o dyn Fn(&Set) -> Result<Vec<Vec<f64>>>,
    /// Physics steps of one replay of all training logs.
    pub steps: usize,
    /// Whether replays leave a gap without effects.
    ///
    /// If they do not, no set could close one. The screening then gives the detection limits, and
    /// nothing is fitted.
    pub is_gap: bool,
}

impl OpenLoop<'_> {
    /// Whether a set exceeds the one before it by a threshold.
    ///
    /// It does if the difference also exceeds the scatter of both. In segments it also does if
    /// replays of whole logs confirm it. They must leave less than half of what the set before
    /// leaves, both as it is and with its values fitted to them. The evidence scatters with the
    /// initial states of segments, and these replays do not depend on them.
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

    /// Whether a set closes most of the gap that the set before it leaves.
    ///
    /// A sensor with a wrong scale hardly changes which force is missing, but changes all
    /// predictions.
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

/// The open-loop gap, which counts if hardly any force is missing.
pub(super) struct OpenLoopGap<'o> {
    replay: OpenLoop<'o>,
    /// Excess power without effects and with the set that stands; `None` if it does not count.
    excess: Option<[f64; 2]>,
}

impl<'o> OpenLoopGap<'o> {
    /// The gap by given replays.
    pub(super) fn by(replay: OpenLoop<'o>) -> Self {
        Self {
            replay,
            excess: None,
        }
    }

    /// Whether the set that stands leaves more of the gap than a further effect must close.
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

    /// Whether a set closes as much of the gap as a further effect must.
    pub(super) fn is_closed_by(&self, set: &Set, breadth: Breadth) -> Result<bool> {
        Ok(match self.excess {
            Some([first, now]) => now - (self.replay.excess)(set)? > breadth.shrinks * first,
            None => false,
        })
    }
}
