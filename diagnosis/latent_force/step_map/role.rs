//! Roles of the simulations of an episode: the unperturbed model, and one per column of its
//! derivatives.

use super::Derivatives;

/// Purpose of one simulation per episode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Role {
    /// The unperturbed model.
    Nominal,
    /// Perturbs uncoupled coordinates of the state, one of each [island](super::Islands), for `f`
    /// and `h`.
    State(usize),
    /// Perturbs a coordinate of the state throughout, for `h` alone.
    ///
    /// A position is perturbed by a constant, a speed by a constant and its position by a ramp. A
    /// reading with memory (a delay, a filter) sees the past of a speed through its position. The
    /// present value of the ramp is subtracted again.
    Reading(usize),
    /// Perturbs a speed by a ramp, which shows the delay of a sensor of speeds.
    Ramp(usize),
    /// Applies generalized forces throughout the row, one per island.
    Force(usize),
    /// Applies these forces in the first physics step of the row.
    Jolt(usize),
    /// A variation of the parameters.
    Varied(usize),
}

impl Role {
    /// Returns the roles for derivatives with respect to the state.
    ///
    /// `slots` perturbations cover all degrees of freedom. Where readings have memory, the roles
    /// include the perturbations throughout.
    pub(super) fn in_state((slots, nv): (usize, usize), remembers_readings: bool) -> Vec<Self> {
        let mut roles: Vec<Self> = (0..2 * slots).map(Self::State).collect();
        if remembers_readings {
            roles.extend((0..2 * nv).map(Self::Reading));
            roles.extend((0..nv).map(Self::Ramp));
        }
        roles
    }

    /// Returns the roles for derivatives with respect to forces and for some variations.
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

    /// Whether the role is placed and read at each row, and never stepped.
    pub(super) fn is_read_alone(self) -> bool {
        matches!(self, Self::Reading(_) | Self::Ramp(_))
    }

    /// Returns which coordinates of the state the role perturbs for `f`; see
    /// [`Islands::moved`](super::Islands::moved).
    pub(super) fn slot(self) -> Option<usize> {
        match self {
            Self::State(i) => Some(i),
            _ => None,
        }
    }
}
