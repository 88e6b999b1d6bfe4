//! A task on an engine with resolved settings: what every working subcommand opens.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use anyhow::Result;
use asid_core::effect::EffectSpec;
use asid_core::refined::Refined;
use asid_core::registry::{self, BackendEntry, Entry, TaskEntry};
use asid_core::signal::Signal;
use asid_core::{
    Backend, Capabilities, Error, Model, Parameter, Plant, Problem, Scene, SimulatedWorld, Streams,
    Task,
};

use super::config::{Config, Stage};
use super::options::{Algorithms, Common, Real};
use super::progress::Bars;
use super::result::CostResult;

/// An open task.
pub struct Session {
    pub task: Box<dyn Task>,
    pub config: Config,
    pub parameters: Vec<Parameter>,
    pub signals: Vec<Signal>,
    pub model: Arc<dyn Model>,
    pub engine: String,
    capabilities: Capabilities,
    threads: usize,
    progress: Bars,
    physics_steps: AtomicU64,
    env_steps: AtomicU64,
}

impl Session {
    /// Opens a task for the whole pipeline; see [`Session::open_stage`].
    pub fn open(task: &str, common: &Common, algorithms: &Algorithms, real: &Real) -> Result<Self> {
        Self::open_stage(Stage::Run, task, common, algorithms, real)
    }

    /// Finds the task and the engine, resolves the settings, loads the scene and
    /// checks that every unknown acts.
    pub fn open_stage(
        stage: Stage,
        task: &str,
        common: &Common,
        algorithms: &Algorithms,
        real: &Real,
    ) -> Result<Self> {
        let mut task = (registry::find::<TaskEntry>(task)?.make)()?;
        let (config, parameters) = Config::resolve(stage, &*task, common, algorithms, real)?;
        if let Some(condition) = &config.condition
            && let Some(other) = task.under(condition)?
        {
            task = other;
        }
        let backend = backend(&config.backend)?;
        require(&*backend, task.requires())?;
        let model = backend.load(task.scene())?;
        for target in parameters.iter().flat_map(|p| &p.targets) {
            model.nominal(target)?;
        }
        let signals = config
            .noise
            .iter()
            .map(|(sensor, &noise)| Signal {
                sensor: sensor.clone(),
                noise,
            })
            .collect::<Vec<_>>();
        let signals = task
            .exploration()
            .signals
            .iter()
            .filter_map(|s| signals.iter().find(|n| n.sensor == s.sensor).cloned())
            .collect();
        let session = Self {
            task,
            parameters,
            signals,
            model,
            engine: format!("{} {}", backend.name(), backend.version()),
            capabilities: backend.capabilities(),
            threads: common.threads.unwrap_or(0),
            progress: Bars::new(common.quiet),
            physics_steps: AtomicU64::new(0),
            env_steps: AtomicU64::new(0),
            config,
        };
        asid_core::sensitivity::check_parameters(&session.problem())?;
        Ok(session)
    }

    /// The problem as algorithms see it.
    pub fn problem(&self) -> Problem<'_> {
        Problem {
            task: &*self.task,
            model: &*self.model,
            capabilities: self.capabilities,
            parameters: &self.parameters,
            signals: &self.signals,
            threads: self.threads,
            streams: Streams::new(self.config.seed),
            progress: &self.progress,
            physics_counter: &self.physics_steps,
            env_counter: &self.env_steps,
        }
    }

    /// The start pose of a stage that is told it, in the order of its coordinates.
    pub fn start(&self) -> Vec<f64> {
        let coordinates = self.config.command.start(&*self.task).iter();
        coordinates
            .filter_map(|c| self.config.start.get(&c.name).copied())
            .collect()
    }

    /// The hidden truth: as given, and otherwise drawn by the seed from the condition's
    /// range or from the prior.
    pub fn truth(&self) -> Vec<f64> {
        let mut rng = Streams::new(self.config.seed).stream("truth");
        let conditions = self.task.conditions();
        let chosen = self.config.condition.as_ref();
        let condition = conditions.iter().find(|c| Some(&c.name) == chosen);
        self.parameters
            .iter()
            .map(|p| {
                let named = condition.and_then(|c| c.truth.iter().find(|(n, _)| *n == p.name));
                let drawn = match named {
                    // A fixed value to the bit, also on a logarithmic scale.
                    Some((_, [low, high])) if low == high => {
                        let _ = p.sample(&mut rng);
                        *low
                    }
                    Some((_, range)) => Parameter {
                        range: *range,
                        ..p.clone()
                    }
                    .sample(&mut rng),
                    None => p.sample(&mut rng),
                };
                self.config
                    .real
                    .truth
                    .get(&p.name)
                    .copied()
                    .unwrap_or(drawn)
            })
            .collect()
    }

    /// The simulated real world with this truth.
    pub fn world(&self, truth: &[f64]) -> Result<SimulatedWorld<'_>> {
        let real = &self.config.real;
        let scene = match &real.model {
            None => self.task.scene().clone(),
            Some(path) => Scene::from_file(path)?,
        };
        let model = match &real.model {
            None if real.backend == self.config.backend => Arc::clone(&self.model),
            _ => load(&real.backend, &*self.task, &scene)?,
        };
        if let Some(path) = &real.model {
            self.check_real(&*model).map_err(|e| Error::Scene {
                scene: path.display().to_string(),
                message: format!("cannot stand for the task's real world: {e}"),
            })?;
        }
        let effects = real
            .effects
            .iter()
            .map(|text| text.parse::<EffectSpec>())
            .collect::<asid_core::Result<Vec<_>>>()?;
        let model = if effects.is_empty() {
            model
        } else {
            let backend = backend(&real.backend)?;
            let plant = Arc::new(Plant::of(&scene)?);
            Refined::new(&*backend, model, plant, &[], &effects)?
        };
        let streams = Streams::new(self.config.seed).child("real world");
        Ok(SimulatedWorld::new(
            &*self.task,
            &*model,
            &self.parameters,
            truth,
            &self.signals,
            streams,
        )?)
    }

    /// Checks that a model has what the task's protocols need.
    fn check_real(&self, model: &dyn Model) -> asid_core::Result<()> {
        let (ours, theirs) = (self.model.layout(), model.layout());
        let (exploration, downstream) = (self.task.exploration(), self.task.downstream());
        if ours.actuators.len() != theirs.actuators.len() {
            return Err(Error::Shape(format!(
                "it has {} actuators, the task commands {}",
                theirs.actuators.len(),
                ours.actuators.len()
            )));
        }
        for (i, actuator) in ours.actuators.iter().enumerate() {
            if theirs.actuator(&actuator.name)? != i {
                return Err(Error::Shape(format!(
                    "actuator `{}` has another place in the order",
                    actuator.name
                )));
            }
        }
        theirs.recording(&exploration.channels())?;
        theirs.recording(&downstream.channels)?;
        for body in exploration.contact.iter().flatten() {
            theirs.body(body)?;
        }
        for target in self.parameters.iter().flat_map(|p| &p.targets) {
            model.nominal(target)?;
        }
        for frame_period in [exploration.frame_period, downstream.frame_period] {
            asid_core::problem::substeps(theirs, frame_period)?;
        }
        let (mut qpos, _) = asid_core::problem::home(theirs);
        let middle: Vec<f64> = exploration
            .start
            .iter()
            .map(asid_core::task::Coordinate::center)
            .collect();
        self.task.place(theirs, &middle, &mut qpos)
    }

    /// Cost so far.
    pub fn cost(&self, wall_s: f64) -> CostResult {
        CostResult {
            wall_s,
            physics_steps: self.physics_steps.load(Ordering::Relaxed),
            env_steps: self.env_steps.load(Ordering::Relaxed),
        }
    }
}

fn load(backend_name: &str, task: &dyn Task, scene: &Scene) -> Result<Arc<dyn Model>> {
    let backend = backend(backend_name)?;
    require(&*backend, task.requires())?;
    Ok(backend.load(scene)?)
}

/// The engine of this name; one that was left out of the build says how to get it.
pub fn backend(name: &str) -> Result<Box<dyn Backend>> {
    match registry::find::<BackendEntry>(name) {
        Ok(entry) => Ok((entry.make)()?),
        Err(unknown) => Err(super::list::missing(BackendEntry::KIND, name)
            .unwrap_or(unknown)
            .into()),
    }
}

fn require(backend: &dyn Backend, needed: Capabilities) -> Result<()> {
    let lacking = needed - backend.capabilities();
    if lacking.is_empty() {
        return Ok(());
    }
    let names: Vec<String> = lacking
        .iter_names()
        .map(|(n, _)| n.to_lowercase().replace('_', " "))
        .collect();
    Err(Error::Incapable {
        backend: backend.name().to_owned(),
        what: format!("do what this task needs: {}", names.join(", ")),
    }
    .into())
}
