//! Handles: numbers that are looked up, never addresses that are dereferenced.

use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, RwLock, TryLockError};

use asid_core::{Error, Layout, Model, Result, Simulator, Snapshot};

use crate::layout::LayoutTable;
use crate::table;

/// A compiled scene behind a handle.
pub struct ModelEntry {
    /// The engine's model.
    pub model: Arc<dyn Model>,
    /// Its layout in the form for the other side.
    pub layout: LayoutTable,
}

/// A batch behind a handle.
pub struct BatchEntry {
    /// The batch; `None` once it has panicked.
    pub simulator: Mutex<Option<Box<dyn Simulator>>>,
    /// Names and indices.
    pub layout: Layout,
    /// Columns of its parameters.
    pub columns: usize,
}

/// The values behind handles of one kind.
pub struct Handles<T> {
    live: RwLock<HashMap<usize, Arc<T>>>,
    what: &'static str,
}

/// Compiled scenes.
pub static MODELS: LazyLock<Handles<ModelEntry>> = LazyLock::new(|| Handles::new("model"));
/// Batches.
pub static BATCHES: LazyLock<Handles<BatchEntry>> = LazyLock::new(|| Handles::new("batch"));
/// Snapshots.
pub static SNAPSHOTS: LazyLock<Handles<Snapshot>> = LazyLock::new(|| Handles::new("snapshot"));

/// The next handle; each number is used once, whatever its kind.
static NEXT: AtomicUsize = AtomicUsize::new(1);

impl<T> Handles<T> {
    fn new(what: &'static str) -> Self {
        Self {
            live: RwLock::default(),
            what,
        }
    }

    /// Creates a handle for a value.
    pub fn insert<Opaque>(&self, value: T) -> *mut Opaque {
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let mut live = self.live.write().unwrap_or_else(|e| e.into_inner());
        live.insert(number, Arc::new(value));
        std::ptr::without_provenance_mut(number)
    }

    /// The value behind a handle.
    ///
    /// # Errors
    /// When the handle was destroyed or never created.
    pub fn get<Opaque>(&self, handle: *const Opaque) -> Result<Arc<T>> {
        let live = self.live.read().unwrap_or_else(|e| e.into_inner());
        live.get(&handle.addr()).cloned().ok_or_else(|| {
            Error::Shape(format!(
                "there is no such {}: it was destroyed, or never made",
                self.what
            ))
        })
    }

    /// Removes a handle; an unknown one is ignored.
    pub fn remove<Opaque>(&self, handle: *mut Opaque) -> Option<Arc<T>> {
        let mut live = self.live.write().unwrap_or_else(|e| e.into_inner());
        live.remove(&handle.addr())
    }
}

/// The batch of a handle, locked for this thread.
pub struct Held {
    entry: Arc<BatchEntry>,
}

impl Held {
    /// Looks a handle up.
    ///
    /// # Errors
    /// As [`Handles::get`].
    pub fn new(handle: *const table::Batch) -> Result<Self> {
        Ok(Self {
            entry: BATCHES.get(handle)?,
        })
    }

    /// The entry.
    pub fn entry(&self) -> &BatchEntry {
        &self.entry
    }

    /// Runs `body` on the batch; a panic removes the batch.
    ///
    /// # Errors
    /// When another thread uses the batch, or it panicked before.
    pub fn run<R>(&self, body: impl FnOnce(&mut dyn Simulator) -> Result<R>) -> Result<R> {
        let mut guard: MutexGuard<'_, Option<Box<dyn Simulator>>> =
            match self.entry.simulator.try_lock() {
                Ok(guard) => guard,
                Err(TryLockError::WouldBlock) => {
                    return Err(Error::Failed("another thread uses this batch".into()));
                }
                Err(TryLockError::Poisoned(_)) => {
                    return Err(Error::Failed(
                        "the batch panicked in an earlier call".into(),
                    ));
                }
            };
        match guard.as_mut() {
            Some(simulator) => body(&mut **simulator),
            None => Err(Error::Failed(
                "the batch panicked in an earlier call".into(),
            )),
        }
    }
}
