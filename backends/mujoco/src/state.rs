//! State rows: the positions of their parts, and snapshots of them.
//!
//! MuJoCo's `mjSTATE_INTEGRATION` row contains everything that a step reads and does not compute
//! itself, including the solver's starting point. A copied row therefore continues to the bit.

use std::ops::Range;
use std::sync::Arc;

use asid_core::Status;
use mujoco_rs::mujoco_c::mjtState;

use crate::compiled::Compiled;
use crate::ffi::Batch;

/// Parts of a state row.
#[derive(Clone, Debug)]
pub struct StateLayout {
    /// Simulated time, one entry.
    pub time: Range<usize>,
    /// Positions.
    pub qpos: Range<usize>,
    /// Velocities.
    pub qvel: Range<usize>,
    /// Activations of actuators.
    pub act: Range<usize>,
    /// Delay buffers of actuators and sensors.
    pub history: Range<usize>,
    /// The solver's starting point.
    pub solver: Range<usize>,
}

impl StateLayout {
    /// Reads the layout from a batch.
    pub fn of(batch: &mut Batch) -> Self {
        let mut part = |bit: mjtState| batch.component(bit as u32);
        Self {
            time: part(mjtState::mjSTATE_TIME),
            qpos: part(mjtState::mjSTATE_QPOS),
            qvel: part(mjtState::mjSTATE_QVEL),
            act: part(mjtState::mjSTATE_ACT),
            history: part(mjtState::mjSTATE_HISTORY),
            solver: part(mjtState::mjSTATE_WARMSTART),
        }
    }
}

/// Content of a snapshot.
pub struct SavedStates {
    /// The scene of the states.
    pub compiled: Arc<Compiled>,
    /// State rows, concatenated.
    pub rows: Vec<f64>,
    /// Status of each row.
    pub status: Vec<Status>,
    /// Whether each row's episode has begun but taken no step.
    pub begun: Vec<bool>,
}
