//! A problem, described in a file for the Python side.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use anyhow::{Context, Result, bail};
use asid_algorithms::fisher::{FisherBatch, FisherSettings};
use asid_core::parameter::Scale;
use asid_core::progress::Silent;
use asid_core::registry::{ExplorerEntry, TaskEntry, find};
use asid_core::task::Coordinate;
use asid_core::{Backend, Capabilities, Model, Parameter, Problem, Streams, Task};
use serde_json::{Value, json};

use super::THREADS;
use crate::workload::Episodes;

/// Episodes that both sides must play alike. About one in five random pushes meets the object.
const REFERENCES: usize = 16;

/// Seed of the reference episodes.
const REFERENCE_SEED: u64 = 2;

/// Smallest return, nat, of an episode in which the hand met the object; without contact it is
/// below 0.5.
const MET: f64 = 1.0;

/// The compared explorer.
pub const EXPLORER: &str = "fisher-ppo";

/// A task on an engine, and the file that describes it.
pub struct Described {
    /// Name of the task.
    pub name: &'static str,
    /// The task.
    pub task: Box<dyn Task>,
    /// Its compiled scene.
    pub model: Arc<dyn Model>,
    /// Capabilities of the engine.
    pub capabilities: Capabilities,
    /// Its unknowns.
    pub parameters: Vec<Parameter>,
    /// Path of the description.
    pub file: PathBuf,
    /// Environment steps taken so far.
    pub steps: AtomicU64,
    physics: AtomicU64,
}

impl Described {
    /// Compiles the task; writes scene and description into `folder`, which it creates.
    ///
    /// # Errors
    /// If the engine refuses the scene, or if a file cannot be written.
    pub fn new(name: &'static str, backend: &dyn Backend, folder: &Path) -> Result<Self> {
        let task = (find::<TaskEntry>(name)?.make)()?;
        let model = backend.load(task.scene())?;
        let described = Self {
            name,
            parameters: task.parameters(),
            model,
            task,
            capabilities: backend.capabilities(),
            file: folder.join("problem.json"),
            steps: AtomicU64::new(0),
            physics: AtomicU64::new(0),
        };
        std::fs::create_dir_all(folder)?;
        std::fs::write(folder.join("scene.xml"), described.task.scene().xml())?;
        let text = serde_json::to_string(&described.description()?)?;
        std::fs::write(&described.file, text)
            .with_context(|| format!("cannot write {}", described.file.display()))?;
        Ok(described)
    }

    /// The problem for an algorithm.
    pub fn problem(&self, seed: u64) -> Problem<'_> {
        Problem {
            task: &*self.task,
            model: &*self.model,
            capabilities: self.capabilities,
            parameters: &self.parameters,
            signals: &self.task.exploration().signals,
            threads: THREADS,
            streams: Streams::new(seed),
            progress: &Silent,
            physics_counter: &self.physics,
            env_counter: &self.steps,
        }
    }

    fn description(&self) -> Result<Value> {
        let protocol = self.task.exploration();
        let defaults: Value = serde_json::to_value((find::<ExplorerEntry>(EXPLORER)?.defaults)())?;
        let coordinates = |all: &[Coordinate]| -> Vec<Value> {
            all.iter()
                .map(|c| json!({"name": c.name, "range": c.range}))
                .collect()
        };
        let parameters: Vec<Value> = self
            .parameters
            .iter()
            .map(|p| {
                let target = &p.targets[0];
                json!({
                    "name": p.name,
                    "targets": p.targets.len(),
                    "element": target.element,
                    "object": target.name,
                    "attribute": target.attribute,
                    "index": target.index,
                    "range": p.range,
                    "linear": p.scale == Scale::Linear,
                })
            })
            .collect();
        let signals: Vec<Value> = protocol
            .signals
            .iter()
            .map(|s| json!({"sensor": s.sensor, "noise": s.noise}))
            .collect();
        Ok(json!({
            "task": self.name,
            "scene": "scene.xml",
            "threads": THREADS,
            "parameters": parameters,
            "action": coordinates(&protocol.action),
            "start": coordinates(&protocol.start),
            "signals": signals,
            "horizon": protocol.horizon,
            "frames_per_step": protocol.frames_per_step,
            "frame_period": protocol.frame_period,
            "fisher": defaults["fisher"],
            "ppo": defaults["ppo"],
            "environments": defaults["environments"],
            "reference": self.reference(&defaults["fisher"])?,
        }))
    }

    /// Episodes as this side plays them: commands and results.
    fn reference(&self, fisher: &Value) -> Result<Value> {
        let settings: FisherSettings = serde_json::from_value(fisher.clone())?;
        let n = REFERENCES;
        let episodes = Episodes::random(&*self.task, &self.parameters, n, REFERENCE_SEED);
        let problem = self.problem(0);
        let mut batch = FisherBatch::new(&problem, &settings, n)?;
        let mut readings = vec![0.0; n * batch.width()];
        let mut reward = vec![0.0; n];
        let (mut positions, mut rewards) = (Vec::new(), Vec::new());
        let rows = |all: &[f64], each: usize| -> Vec<Vec<f64>> {
            all.chunks_exact(each).map(<[f64]>::to_vec).collect()
        };
        // The first signal of the compared tasks is the object's position.
        let width = batch.width();
        let first = |all: &[f64]| -> Vec<Vec<f64>> {
            all.chunks_exact(width).map(|r| r[..3].to_vec()).collect()
        };
        batch.begin(&episodes.theta, &episodes.starts, &mut readings)?;
        positions.push(first(&readings));
        for actions in &episodes.actions {
            batch.step(actions, &mut readings, &mut reward)?;
            positions.push(first(&readings));
            rewards.push(reward.clone());
        }
        let returns = |e: usize| rewards.iter().map(|r: &Vec<f64>| r[e]).sum::<f64>();
        if !(0..n).any(|e| returns(e) > MET) {
            bail!("no reference episode of {} meets the object", self.name);
        }
        let protocol = self.task.exploration();
        let nu = self.model.layout().nu();
        let commands = episodes.commands(&*self.task, nu)?;
        let block = protocol.frames_per_step * nu;
        // Order: control step, episode, frame.
        let commands: Vec<Vec<Vec<Vec<f64>>>> = (0..protocol.horizon)
            .map(|step| {
                commands
                    .chunks_exact(protocol.horizon * block)
                    .map(|row| rows(&row[step * block..(step + 1) * block], nu))
                    .collect()
            })
            .collect();
        let action: Vec<_> = episodes
            .actions
            .iter()
            .map(|a| rows(a, protocol.action.len()))
            .collect();
        Ok(json!({
            "theta": rows(&episodes.theta, self.parameters.len()),
            "starts": rows(&episodes.starts, protocol.start.len()),
            "actions": action,
            "commands": commands,
            "positions": positions,
            "rewards": rewards,
        }))
    }
}
