//! Roles of the simulations of an episode: the model as it is, and one for each column of its derivatives.

use super::Derivatives;

/// What one simulation an episode is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Role {
    /// The model as it is.
    Nominal,
    /// Coordinates of the state that nothing couples are moved, one of each [island](super::Islands), for `f` and `h`.
    State(usize),
    /// A coordinate of the state is moved all along, for `h` alone: a position by a constant, a speed by a constant and its
    /// position by a ramp. A reading that remembers (a delay, a filter) sees the past of a speed as its position; what the
    /// ramp has reached now is taken off again.
    Reading(usize),
    /// A speed is moved by a ramp, for how late a sensor of speeds is.
    Ramp(usize),
    /// Generalized forces act all along the row, one at each island.
    Force(usize),
    /// They act in the first physics step of the row.
    Jolt(usize),
    /// A variation of the parameters.
    Varied(usize),
}

impl Role {
    /// Those for the slopes in the state, by so many pushes; where readings remember, also those that are moved all along.
    pub(super) fn in_state((slots, nv): (usize, usize), remembers_readings: bool) -> Vec<Self> {
        let mut roles: Vec<Self> = (0..2 * slots).map(Self::State).collect();
        if remembers_readings {
            roles.extend((0..2 * nv).map(Self::Reading));
            roles.extend((0..nv).map(Self::Ramp));
        }
        roles
    }

    /// Those for the slopes in forces and for some variations.
    pub(super) fn others(slots: usize, want: Derivatives, variations: usize) -> Vec<Self> {
        let mut roles = Vec::new();
        if want.force {
            roles.extend((0..slots).map(Self::Force));
        }
        if want.jolt {
            roles.extend((0..slots).map(Self::Jolt));
        }
        roles.extend((0..variations).map(Self::Varied));
        roles
    }

    /// Whether it is placed and read at each row, and never stepped.
    pub(super) fn is_read_alone(self) -> bool {
        matches!(self, Self::Reading(_) | Self::Ramp(_))
    }

    /// Which coordinates of the state it moves for `f`; see [`Islands::moved`](super::Islands::moved).
    pub(super) fn slot(self) -> Option<usize> {
        match self {
            Self::State(i) => Some(i),
            _ => None,
        }
    }
}
