//! Response of the state to generalized forces over a row, and the forces behind a change of the
//! state.

use std::ops::Range;

use nalgebra::{DMatrix, Dyn, LU};

use crate::latent_force::step_map::LinearEpisode;

/// Derivatives of the next state with respect to generalized forces, `rows x nx x nv` along a walk.
#[derive(Clone, Debug, Default)]
pub(super) struct ForceSlopes {
    /// For a force held over the row.
    pub(super) held: Vec<f64>,
    /// For a force that acts in the first physics step alone.
    pub(super) jolt: Vec<f64>,
}

impl ForceSlopes {
    /// Takes the derivatives out of a linearised walk.
    pub(super) fn take(from: &mut LinearEpisode) -> Self {
        Self {
            held: std::mem::take(&mut from.b),
            jolt: std::mem::take(&mut from.jolt),
        }
    }

    /// Returns the derivatives of some rows, each `size` numbers.
    pub(super) fn part(&self, rows: Range<usize>, size: usize) -> Self {
        let own = rows.start * size..rows.end * size;
        let of = |all: &[f64]| all.get(own.clone()).map_or_else(Vec::new, <[f64]>::to_vec);
        Self {
            held: of(&self.held),
            jolt: of(&self.jolt),
        }
    }
}

/// Relates a change of the state over a row to two forces at each joint: one held over the row and
/// one at its beginning.
///
/// Two are needed because positions and speeds are two numbers per joint. A force that fades, as of
/// a late command, moves a position further than one that is held. Over a row of a single physics
/// step the two forces are the same, and the speeds alone determine it.
pub(super) struct Row {
    /// Change of the state per unit force, `nx x nx`: held forces, then those at the beginning.
    /// `nx x nv` over a single step.
    pub(super) response: DMatrix<f64>,
    /// LU factors of as many of its last rows as it has columns.
    pub(super) factors: LU<f64, Dyn, Dyn>,
}

impl Row {
    /// Builds the response of a row of `steps` physics steps from its derivatives.
    pub(super) fn of(slopes: &ForceSlopes, nv: usize, steps: usize) -> Self {
        let half = |from: &[f64]| DMatrix::from_row_slice(2 * nv, nv, from);
        let mut response = half(&slopes.held);
        if steps > 1 {
            response = response.resize_horizontally(2 * nv, 0.0);
            response.columns_mut(nv, nv).copy_from(&half(&slopes.jolt));
        }
        let n = response.ncols();
        Self {
            factors: response.rows(2 * nv - n, n).into_owned().lu(),
            response,
        }
    }
}
