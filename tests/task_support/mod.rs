//! Problems of built-in tasks on the built-in engines.

pub mod visits;

use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use asid::core::progress::Silent;
use asid::core::registry::{BackendEntry, TaskEntry, all, find};
use asid::core::{Backend, Model, Parameter, Problem, Streams, Task};

/// The task of this name.
pub fn task(name: &str) -> Box<dyn Task> {
    (find::<TaskEntry>(name).unwrap().make)().unwrap()
}

/// Calls `check` with a problem on an engine, and with the compiled model.
pub fn on_engine(
    backend: &dyn Backend,
    task: &dyn Task,
    parameters: &[Parameter],
    seed: u64,
    check: impl FnOnce(&Problem<'_>, &Arc<dyn Model>),
) {
    let model = backend.load(task.scene()).unwrap();
    let (physics, env) = (AtomicU64::new(0), AtomicU64::new(0));
    let problem = Problem {
        task,
        model: &*model,
        capabilities: backend.capabilities(),
        parameters,
        signals: &task.exploration().signals,
        threads: 0,
        streams: Streams::new(seed),
        progress: &Silent,
        physics_counter: &physics,
        env_counter: &env,
    };
    check(&problem, &model);
}

/// Calls `check` with a problem of a task for each engine.
pub fn on_every_engine(name: &str, seed: u64, check: impl Fn(&str, &Problem<'_>)) {
    let task = task(name);
    for entry in all::<BackendEntry>() {
        let backend = (entry.make)().unwrap();
        on_engine(&*backend, &*task, &task.parameters(), seed, |problem, _| {
            check(entry.name, problem);
        });
    }
}
