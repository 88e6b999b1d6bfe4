//! The sets of a screening that a race tries, and their order.

use crate::latent_force::screen::Screened;

use super::replayed_order::{Candidacy, Replayed};
use super::round::Upon;
use super::screening::Look;
use super::set::Set;

/// Most sets that are tried for each place of a race upon the model without effects.
///
/// A set whose fit does not reach the base gives its place to the next one. In later rounds few
/// reach a base that makes up for most of the gap, so that further tries gain little.
const TRIED: usize = 3;

/// A set that a race tries.
pub(super) struct Due<'d> {
    /// The screened set.
    pub(super) screened: &'d Screened,
    /// Where its fit begins, if not at the screened values.
    pub(super) elsewhere: Option<&'d Set>,
    /// See [`Candidacy::is_behind`].
    pub(super) is_behind: bool,
}

impl Upon<'_> {
    /// The sets that a race tries, in this order:
    ///
    /// 1. those that replays put first;
    /// 2. the other replayed sets, in ascending order of what they leave;
    /// 3. the rest of the ranking;
    /// 4. sets whose replays leave most of the gap.
    ///
    /// All but the first must be worth more than `least`. If no replay closes most of the gap, they
    /// must also exceed the scatter of the base's evidence, since less evidence carries no
    /// information.
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
