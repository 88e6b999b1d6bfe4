//! What a linearisation computes: the point, and which derivatives are new.

use super::role::Role;
use super::{Derivatives, Variation};

/// Which parts of a linearisation are computed anew: all by default. Other parts are zero.
#[derive(Clone, Copy, Default)]
pub struct Anew<'r> {
    /// Walks whose derivatives with respect to the state are computed; empty for all.
    pub state: &'r [bool],
    /// [`LinearEpisode::carried`](super::LinearEpisode::carried) of the other walks; empty for none.
    pub carried: &'r [Vec<f64>],
    /// Variations whose columns are kept, except along the walks of `columns`; empty for none.
    pub kept: &'r [bool],
    /// Walks along which the columns of all variations are computed; empty for none.
    pub columns: &'r [bool],
    /// For each segment: coordinates of its initial state on which its readings do not depend.
    /// Their derivatives are zero. Empty for none.
    pub blind: &'r [Vec<bool>],
}

/// The linearisation point and what is wanted there.
#[derive(Clone, Copy)]
pub(super) struct Request<'r> {
    pub(super) theta: &'r [f64],
    pub(super) trajectory: &'r [Vec<f64>],
    pub(super) want: Derivatives,
    pub(super) push: &'r [f64],
    pub(super) variations: &'r [Variation],
    pub(super) anew: Anew<'r>,
    /// Whether each variation changes only what acts in every physics step alike.
    pub(super) at_once: &'r [bool],
    /// Whether each variation changes the readings of an unchanged state.
    pub(super) read: &'r [bool],
    /// Whether each variation changes readings alone.
    pub(super) alone: &'r [bool],
}

impl<'r> Request<'r> {
    /// Whether derivatives with respect to the state are computed for a walk, if any are wanted.
    pub(super) fn due(&self, walk: usize) -> bool {
        self.anew.state.get(walk).is_none_or(|due| *due)
    }

    /// Coordinates of a walk's initial state whose derivatives are zero; empty for none.
    pub(super) fn blind(&self, walk: usize) -> &'r [bool] {
        self.anew.blind.get(walk).map_or(&[], Vec::as_slice)
    }

    /// Whether a role is read at each row and never stepped.
    pub(super) fn is_read_alone(&self, role: Role) -> bool {
        match role {
            Role::Varied(i) => self.alone[i],
            _ => role.is_read_alone(),
        }
    }

    /// Whether the column of a variation is wanted along the walks whose columns are `due`, or else
    /// along the other walks.
    pub(super) fn wants(&self, variation: usize, due: bool) -> bool {
        due || !self.anew.kept.get(variation).is_some_and(|kept| *kept)
    }
}
