//! Response of the state to generalized forces over a row, and the forces behind a change of it.

use std::ops::Range;

use nalgebra::{DMatrix, Dyn, LU};

use crate::latent_force::step_map::LinearEpisode;

/// Slopes of the state after a row in generalized forces, `rows x nx x nv` along a walk.
#[derive(Clone, Debug, Default)]
pub(super) struct ForceSlopes {
    /// In a force held over the row.
    pub(super) held: Vec<f64>,
    /// In one that acts in the first physics step alone.
    pub(super) jolt: Vec<f64>,
}

impl ForceSlopes {
    /// Those of a linearised walk, which are taken out of it.
    pub(super) fn take(from: &mut LinearEpisode) -> Self {
        Self {
            held: std::mem::take(&mut from.b),
            jolt: std::mem::take(&mut from.jolt),
        }
    }

    /// Those of some rows, each `size` numbers.
    pub(super) fn part(&self, rows: Range<usize>, size: usize) -> Self {
        let own = rows.start * size..rows.end * size;
        let of = |all: &[f64]| all.get(own.clone()).map_or_else(Vec::new, <[f64]>::to_vec);
        Self {
            held: of(&self.held),
            jolt: of(&self.jolt),
        }
    }
}

/// What the change of the state over a row says of the forces behind it: one held over the row and one at its beginning, at
/// each joint. Two, since places and speeds are two numbers a joint, and a force that fades, as of a late command, moves a
/// place further than one that is held.
///
/// Over a row of a single physics step the two are one, and the speeds say it all.
pub(super) struct Row {
    /// Change of the state by a unit of each force, `nx x nx`: the held ones, then those at the beginning; or `nx x nv`.
    pub(super) response: DMatrix<f64>,
    /// Of as many of its last rows as it has columns.
    pub(super) factors: LU<f64, Dyn, Dyn>,
}

impl Row {
    /// Of a row of some physics steps with these slopes.
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
