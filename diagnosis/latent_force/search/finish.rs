//! End of a round: sets that are not far behind are fitted to the end, and members without an
//! effect are removed.

use std::collections::BTreeSet;

use asid_core::Result;

use crate::latent_force::fit::{Extent, Slopes};

use super::open_loop::{MOST, OpenLoopGap};
use super::prior::log_prior;
use super::prune::{Counts, earned, pruned, pruned_at_once};
use super::round::Upon;
use super::set::{Set, from_fit_of, name_of};

/// Fitted sets, and the sets for which there was no time.
pub(super) struct Fits {
    pub(super) sets: Vec<Set>,
    pub(super) left_out: Vec<Vec<usize>>,
}

impl Upon<'_> {
    /// Fits to the end the sets that are not far behind, and prunes each.
    ///
    /// They are compared with the best of them and with the evidence that another set has
    /// `reached`. Those that come first in the order of a screening, by prior odds and the price of
    /// each further name too, have the places.
    pub(super) fn finish(&self, raced: Vec<Set>, reached: f64) -> Result<Fits> {
        let (context, breadth, progress) = (self.context, self.breadth, self.progress);
        let base = self.base.fitted.evidence;
        // A set's own predicted gain counts for it; only reached evidence counts against others.
        let hoped = |s: &Set| s.fitted.evidence + s.fitted.promised;
        let mut raced = raced;
        let order = |s: &Set| hoped(s) + self.odds(s);
        raced.sort_by(|a, b| order(b).total_cmp(&order(a)));
        // Compared after equally many linearisations: a set that was fitted to the end would lead
        // by these alone.
        let best = raced
            .iter()
            .map(|s| s.fitted.evidence)
            .fold(reached, f64::max);
        let least = best - (breadth.behind * (best - base)).max(breadth.near);
        let mut best_to_the_end = reached;
        let mut fits = Fits {
            sets: Vec::new(),
            left_out: Vec::new(),
        };
        for mut set in raced.into_iter().take(breadth.finished) {
            if hoped(&set) < least {
                continue;
            }
            if !progress.is_stopped() {
                progress.note(&format!(
                    "fitting {}",
                    name_of(self.candidates, &set.candidates)
                ));
                // The fit to the end uses its own derivatives.
                set.fitted.slopes = Slopes::default();
                let whole = Extent::from((breadth.rounds[1], progress));
                let rival = (!context.has_segments()).then_some(best_to_the_end - breadth.near);
                set.fit(context, Extent { rival, ..whole })?;
            }
            best_to_the_end = best_to_the_end.max(set.fitted.evidence);
            let at_once = pruned_at_once(self.candidates, set.clone());
            // Removing members does not save a set that is far behind.
            let is_far = hoped(&at_once) < best_to_the_end - breadth.near;
            set = if progress.is_stopped() {
                fits.left_out.push(set.candidates);
                at_once
            } else if is_far && !context.has_segments() {
                at_once
            } else {
                let least = (breadth, self.at_first);
                pruned(context, self.candidates, set, least, progress)?
            };
            fits.sets.push(set);
        }
        let others = fits.sets.clone();
        let counts = |before: &Set, after: &Set| self.counts(before, after);
        for set in &mut fits.sets {
            let own = (set.clone(), self.base, &others[..]);
            let least = (breadth, self.threshold(), &counts as &Counts<'_>);
            *set = earned(context, self.candidates, own, least, progress)?;
        }
        let mut seen = BTreeSet::new();
        let members = |s: &Set| s.candidates.iter().copied().collect::<BTreeSet<usize>>();
        fits.sets.retain(|s| seen.insert(members(s)));
        if context.has_segments() {
            self.level(&mut fits.sets)?;
        }
        Ok(fits)
    }

    /// Prior odds of a set, in nats, less the price of each name beyond the first that it adds.
    fn odds(&self, set: &Set) -> f64 {
        let first = self.base.names.count() + 1;
        let more = set.names.count().saturating_sub(first) as f64;
        log_prior(self.context.plant(), self.candidates, &set.candidates) - self.price() * more
    }

    /// Whether a set makes up for as much of what the set `before` leaves as a further name must.
    ///
    /// It must do so for the force, for most of the force at some joint, or for the gap of replays.
    /// If the set before leaves neither force nor gap, nothing counts: the search would end there.
    pub(super) fn counts(&self, before: &Set, after: &Set) -> Result<bool> {
        let (context, breadth) = (self.context, self.breadth);
        let left = |s: &Set| {
            s.fitted
                .estimate
                .missing(context)
                .relative_to(self.at_first)
        };
        let mut gap = OpenLoopGap::by(self.open_loop);
        let no_force = left(before) < breadth.shrinks;
        let how = (breadth, self.progress);
        if no_force && !gap.is_left(context, (&self.base.fitted, before), how)? {
            return Ok(false);
        }
        let estimates = (&before.fitted.estimate, &after.fitted.estimate);
        if left(before) - left(after) > breadth.shrinks
            || (estimates.0).is_made_up_for_by(estimates.1, context, 1.0 - MOST)
        {
            return Ok(true);
        }
        if no_force {
            gap.is_closed_by(after, breadth)
        } else {
            self.open_loop.is_mostly_closed(context, (before, after))
        }
    }

    /// Refits the sets behind the best from the initial states that the best has found for its
    /// segments.
    fn level(&self, sets: &mut [Set]) -> Result<()> {
        sets.sort_by(|a, b| b.fitted.evidence.total_cmp(&a.fitted.evidence));
        let Some((best, others)) = sets.split_first_mut() else {
            return Ok(());
        };
        for set in others {
            if self.progress.is_stopped() {
                break;
            }
            let again = from_fit_of(self.context, (set, best), self.breadth, self.progress)?;
            if again.fitted.evidence > set.fitted.evidence {
                *set = again;
            }
        }
        Ok(())
    }
}
