//! Observes a world between its frames.
//!
//! A copy of the world plays the same commands and is read after every physics step, so that the
//! world itself stays bit-identical. The copy shows what frames miss: short contacts, and the
//! states that a late tracker reports.

use asid_core::error::Result;
use asid_core::layout::Recording;
use asid_core::simulator::{Control, Rollout, Simulator};

/// Readings of the copy after each physics step.
pub(super) struct CloseLook {
    recording: Recording,
    /// Index of the simulation that is the copy.
    copy: [usize; 1],
    frames: usize,
    substeps: usize,
    ctrl: Vec<f64>,
    rows: Vec<f64>,
}

impl CloseLook {
    /// Prepares readings of these channels over `frames` frames of `substeps` physics steps each.
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

    /// Plays the frames' commands in the copy, from the state of `world` on.
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

    /// Rows of readings, one per physics step.
    pub(super) fn rows(&self) -> std::slice::ChunksExact<'_, f64> {
        self.rows.chunks_exact(self.recording.width().max(1))
    }
}
