//! Saved states of an engine.

use std::ptr::NonNull;
use std::sync::Arc;

use crate::handle::ModelHandle;
use crate::table;

/// A snapshot of the engine, with its model.
pub struct SavedStates {
    /// The scene of the states, which lives as long as they do.
    pub model: Arc<ModelHandle>,
    /// The engine's handle.
    pub pointer: NonNull<table::Snapshot>,
}

// SAFETY: a snapshot is only read once it is made, as the header says, by any thread.
unsafe impl Send for SavedStates {}
// SAFETY: as above, and by several at once.
unsafe impl Sync for SavedStates {}

impl Drop for SavedStates {
    fn drop(&mut self) {
        if let Some(destroy) = self.model.engine.table.destroy_snapshot {
            self.model.engine.action("destroy_snapshot").run(|| {
                // SAFETY: made by `save`, destroyed here only, used by nobody.
                unsafe { destroy(self.pointer.as_ptr()) }
            });
        }
    }
}
