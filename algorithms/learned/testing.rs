//! Problems for tests, in the engine without a native library.

use std::sync::atomic::AtomicU64;

// Linked for the entries that they register.
use asid_rapier as _;
use asid_tasks as _;

use asid_core::progress::Silent;
use asid_core::registry::{BackendEntry, TaskEntry, find};
use asid_core::{Capabilities, Problem, Streams};

/// Runs `check` on a task.
pub fn with_problem(task: &str, check: impl FnOnce(&Problem<'_>)) {
    let task = (find::<TaskEntry>(task).unwrap().make)().unwrap();
    let backend = (find::<BackendEntry>("rapier").unwrap().make)().unwrap();
    let model = backend.load(task.scene()).unwrap();
    let parameters = task.parameters();
    let counter = AtomicU64::new(0);
    check(&Problem {
        task: &*task,
        model: &*model,
        capabilities: Capabilities::empty(),
        parameters: &parameters,
        signals: &task.exploration().signals,
        threads: 0,
        streams: Streams::new(3),
        progress: &Silent,
        physics_counter: &counter,
        env_counter: &counter,
    });
}
