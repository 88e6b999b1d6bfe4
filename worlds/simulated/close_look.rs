//! Looks at a world between its frames.
//!
//! A copy of the world plays the same commands and is read after every physics step, so that looking leaves
//! the world as it is, to the bit. It shows what a frame does not: a touch that is shorter, and
//! the state that a late tracker reports.

use asid_core::error::Result;
use asid_core::layout::Recording;
use asid_core::simulator::{Control, Rollout, Simulator};

/// Readings of the copy after each physics step.
pub(super) struct CloseLook {
    recording: Recording,
    /// The simulation that is the copy.
    copy: [usize; 1],
    frames: usize,
    substeps: usize,
    ctrl: Vec<f64>,
    rows: Vec<f64>,
}

impl CloseLook {
    /// Readings of these channels over so many frames of so many physics steps.
    pub(super) fn new(recording: Recording, copy: usize, frames: usize, substeps: usize) -> Self {
        Self {
            rows: vec![0.0; frames * substeps * recording.width()],
            recording,
            copy: [copy],
            frames,
            substeps,
            ctrl: Vec::new(),
        }
    }

    /// Lets the copy go from the state of `world` on with the commands of the frames.
    pub(super) fn play(
        &mut self,
        simulator: &mut dyn Simulator,
        world: usize,
        ctrl: &[f64],
    ) -> Result<()> {
        simulator.copy_state(&[world], &self.copy)?;
        let nu = ctrl.len() / self.frames.max(1);
        self.ctrl.clear();
        for row in ctrl.chunks_exact(nu.max(1)) {
            for _ in 0..self.substeps {
                self.ctrl.extend_from_slice(row);
            }
        }
        let steps = self.frames * self.substeps;
        let control = Control::Shared(&self.ctrl);
        let rollout = Rollout::new(&self.copy, steps, 1, control, &self.recording);
        simulator.rollout(&rollout, &mut self.rows)
    }

    /// Rows of readings, one a physics step.
    pub(super) fn rows(&self) -> std::slice::ChunksExact<'_, f64> {
        self.rows.chunks_exact(self.recording.width().max(1))
    }
}
