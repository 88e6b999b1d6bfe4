//! A task on an engine, with the reward of its exploration.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use asid_algorithms::fisher::FisherSettings;
use asid_core::progress::Silent;
use asid_core::registry::{BackendEntry, TaskEntry, default_backend, find};
use asid_core::{Backend, Error, Model, Parameter, Problem, Result, Streams, Task};

/// The request for a batch of episodes.
#[derive(Clone, Debug)]
pub struct Request {
    /// Name of the task.
    pub task: String,
    /// Name of the engine; `None` for the default of the command line.
    pub backend: Option<String>,
    /// Number of parallel episodes.
    pub episodes: usize,
    /// Settings of the reward of a step.
    pub fisher: FisherSettings,
    /// Threads; 0 for one a core.
    pub threads: usize,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// The objects that a problem borrows.
pub struct Opened {
    task: Box<dyn Task>,
    backend: Box<dyn Backend>,
    model: Arc<dyn Model>,
    parameters: Vec<Parameter>,
    counter: AtomicU64,
    threads: usize,
    seed: u64,
}

/// The streams of a seed, equal to those of the command line's `--seed`.
pub fn streams(seed: u64) -> Streams {
    Streams::new(seed).sealed("method")
}

impl Opened {
    /// Finds task and engine, and compiles the scene.
    ///
    /// # Errors
    /// When a name is unknown, the engine lacks what the task needs, or refuses its scene.
    pub fn new(request: &Request) -> Result<Self> {
        if request.episodes == 0 {
            return Err(Error::Config {
                key: "num_envs".into(),
                message: "must be at least 1".into(),
            });
        }
        let task = (find::<TaskEntry>(&request.task)?.make)()?;
        let backend = backend(request.backend.as_deref(), &*task)?;
        let model = backend.load(task.scene())?;
        Ok(Self {
            parameters: task.parameters(),
            counter: AtomicU64::new(0),
            threads: request.threads,
            seed: request.seed,
            task,
            backend,
            model,
        })
    }

    /// Name and version of the engine.
    pub fn engine(&self) -> String {
        format!("{} {}", self.backend.name(), self.backend.version())
    }

    /// The problem, with the task's tracker noise.
    pub fn problem(&self) -> Problem<'_> {
        Problem {
            task: &*self.task,
            model: &*self.model,
            capabilities: self.backend.capabilities(),
            parameters: &self.parameters,
            signals: &self.task.exploration().signals,
            threads: self.threads,
            streams: streams(self.seed),
            progress: &Silent,
            physics_counter: &self.counter,
            env_counter: &self.counter,
        }
    }
}

/// The engine of this name, after checking that it can do what the task needs.
fn backend(name: Option<&str>, task: &dyn Task) -> Result<Box<dyn Backend>> {
    let entry = match name {
        Some(name) => find::<BackendEntry>(name)?,
        None => default_backend().ok_or_else(|| Error::Failed("no engine is built in".into()))?,
    };
    let backend = (entry.make)()?;
    let lacking = task.spec().requires - backend.capabilities();
    if lacking.is_empty() {
        return Ok(backend);
    }
    let names: Vec<String> = lacking
        .iter_names()
        .map(|(n, _)| n.to_lowercase().replace('_', " "))
        .collect();
    Err(Error::Incapable {
        backend: entry.name.to_owned(),
        what: format!("do what this task needs: {}", names.join(", ")),
    })
}
