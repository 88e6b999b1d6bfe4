//! Which sets of a screening a race tries, and in which order.

use crate::latent_force::screen::Screened;

use super::replayed_order::{Candidacy, Replayed};
use super::round::Upon;
use super::screening::Look;
use super::set::Set;

/// Sets that are tried for each place of a race upon no effect, at most: one whose fit does not come to what stands leaves its place to the next.
/// Upon what makes up for most of the gap few come to it.
const TRIED: usize = 3;

/// A set that a race tries.
pub(super) struct Due<'d> {
    /// As it was screened.
    pub(super) screened: &'d Screened,
    /// Where its fit begins, if that is not where the screening has it.
    pub(super) elsewhere: Option<&'d Set>,
    /// See [`Candidacy::is_behind`].
    pub(super) is_behind: bool,
}

impl Upon<'_> {
    /// Sets that a race tries, first those that replays say come first, then those that are worth more than the `least`: what was replayed by what it left, the others
    /// as they are ranked, and at last what replays have found to leave most of the gap. Where no replay closes most of it, evidence that a fit of the base
    /// wanders by tells nothing.
    pub(super) fn due<'d>(
        &self,
        look: &'d Look,
        replayed: &'d Replayed,
        least: f64,
    ) -> Vec<Due<'d>> {
        let (ranked, price) = (&look.ranked, self.price());
        let least = match replayed.first {
            0 => least.max(self.base.fitted.wander),
            _ => least,
        };
        let of = |c: &'d Candidacy| Due {
            screened: &ranked[c.place],
            elsewhere: c.elsewhere.as_ref(),
            is_behind: c.is_behind,
        };
        let is_worth = |d: &Due<'_>| d.screened.worth(price) > least;
        let (first, others) = replayed.sets.split_at(replayed.first);
        let (behind, near): (Vec<Due<'_>>, Vec<_>) = others
            .iter()
            .map(of)
            .filter(is_worth)
            .partition(|d| d.is_behind);
        let is_known = |i: usize| replayed.sets.iter().any(|c| c.place == i);
        let unknown = ranked.iter().enumerate().filter(|(i, _)| !is_known(*i));
        let unknown = unknown.map(|(_, screened)| Due {
            screened,
            elsewhere: None,
            is_behind: false,
        });
        let places = if self.base.candidates.is_empty() {
            TRIED
        } else {
            1
        };
        let first = first.iter().map(of);
        let others = near
            .into_iter()
            .chain(unknown.filter(is_worth))
            .chain(behind);
        first
            .chain(others)
            .take(places * self.breadth.raced)
            .collect()
    }
}
