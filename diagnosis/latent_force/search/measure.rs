//! Tests whether a set makes up for enough to count as a further name.

use asid_core::Result;

use super::Search;
use super::open_loop::{MOST, OpenLoopGap};
use super::prune::{Counts, earned};
use super::set::Set;

/// The set that stands, and what is left with it.
pub(super) struct Measure<'m> {
    pub(super) search: &'m Search<'m>,
    pub(super) stands: &'m Set,
    /// Whether hardly any force is missing, so that the open-loop gap counts.
    pub(super) no_force: bool,
    pub(super) gap: &'m OpenLoopGap<'m>,
    /// Whether the first fits were cut short: they do not show yet how much of the force they make
    /// up for.
    pub(super) cut_short: bool,
}

impl Measure<'_> {
    /// Whether a set makes up for as much as a further name must.
    ///
    /// It must do so for the force, for most of the force at some joint, or for the open-loop gap.
    pub(super) fn counts(&self, set: &Set) -> Result<bool> {
        let (search, stands) = (self.search, self.stands);
        let (context, breadth) = (search.context, search.breadth);
        let left = |s: &Set| {
            let missing = s.fitted.estimate.missing(context);
            missing.relative_to(search.at_first)
        };
        let [before, after] = [stands, set].map(|s| &s.fitted.estimate);
        if self.cut_short
            || left(stands) - left(set) > breadth.shrinks
            || before.is_made_up_for_by(after, context, 1.0 - MOST)
        {
            return Ok(true);
        }
        if self.no_force {
            self.gap.is_closed_by(set, breadth)
        } else {
            search.open_loop.is_mostly_closed(context, (stands, set))
        }
    }

    /// The first of the sets that were fitted upon a base that exceeds the base and counts.
    ///
    /// If `base` is only a trial base, each name beyond the set that stands must be needed.
    pub(super) fn first(&self, fitted: &[Set], base: Option<&Set>) -> Result<Option<Set>> {
        let first = self.first_above(base.unwrap_or(self.stands), fitted)?;
        match (first, base) {
            (Some(all), Some(_)) => {
                let missed = self.missed(all.clone(), fitted)?;
                Ok(self.first_above(self.stands, &[missed])?.cloned())
            }
            (first, _) => Ok(first.cloned()),
        }
    }

    /// The first of some sets that exceeds another set by the threshold and counts.
    fn first_above<'s>(&self, other: &Set, sets: &'s [Set]) -> Result<Option<&'s Set>> {
        let threshold = self.search.threshold;
        for set in sets {
            let open_loop = &self.search.open_loop;
            if open_loop.rises(self.search.context, (other, set), threshold)? && self.counts(set)? {
                return Ok(Some(set));
            }
        }
        Ok(None)
    }

    /// Removes from a set with several names beyond the set that stands those that are not needed
    /// ([`earned`]).
    fn missed(&self, set: Set, others: &[Set]) -> Result<Set> {
        let search = self.search;
        let upon = search.upon(self.stands, &[]);
        let counts = |before: &Set, after: &Set| upon.counts(before, after);
        let least = (search.breadth, search.threshold, &counts as &Counts<'_>);
        let sets = (set, self.stands, others);
        earned(
            search.context,
            search.candidates,
            sets,
            least,
            search.progress,
        )
    }
}
