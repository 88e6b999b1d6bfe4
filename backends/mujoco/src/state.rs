//! State rows: where their parts lie, and snapshots of them.
//!
//! MuJoCo's `mjSTATE_INTEGRATION` row is everything a step reads and did not
//! compute itself, the solver's starting point included, so a copied row goes
//! on to the bit.

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
    /// What the past left behind besides position and velocity: activations
    /// and delay buffers of actuators and sensors, the solver's starting point.
    pub memory: [Range<usize>; 3],
}

impl StateLayout {
    /// Reads the layout off a batch.
    pub fn of(batch: &mut Batch) -> Self {
        let mut part = |bit: mjtState| batch.component(bit as u32);
        Self {
            time: part(mjtState::mjSTATE_TIME),
            qpos: part(mjtState::mjSTATE_QPOS),
            qvel: part(mjtState::mjSTATE_QVEL),
            memory: [
                part(mjtState::mjSTATE_ACT),
                part(mjtState::mjSTATE_HISTORY),
                part(mjtState::mjSTATE_WARMSTART),
            ],
        }
    }
}

/// What a snapshot holds.
pub struct SavedStates {
    /// The scene it is of.
    pub compiled: Arc<Compiled>,
    /// State rows one after the other.
    pub rows: Vec<f64>,
    /// Status of each row.
    pub status: Vec<Status>,
    /// Whether each row's episode has begun but not run.
    pub begun: Vec<bool>,
}
