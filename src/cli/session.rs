//! A task on an engine with resolved settings, opened by every working subcommand.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use anyhow::Result;
use asid_core::registry::{self, BackendEntry, Entry, TaskEntry};
use asid_core::signal::Signal;
use asid_core::{
    Backend, Capabilities, Error, Identifier, Model, Parameter, Problem, Streams, Task,
};
use asid_effects::refined_model::RefinedModel;
use asid_worlds::{Ensemble, MODEL_ERRORS, SimulatedWorld, TrackerErrors};

use super::failure;
use super::model::{self, Needs};
use super::options::{Algorithms, Common, Worlds};
use super::progress::Bars;
use super::result::{CostResult, figure};
use super::settings::{Config, Stage, difficulty};
use super::world::{PerturbedResult, World};

/// An open task.
pub struct Session {
    pub task: Box<dyn Task>,
    pub config: Config,
    pub parameters: Vec<Parameter>,
    pub signals: Vec<Signal>,
    /// The real world.
    real: World,
    /// The simulator of the method.
    pub model: Arc<dyn Model>,
    /// Its refined model, where it was given as such and not as a file.
    refined: Option<RefinedModel>,
    pub engine: String,
    capabilities: Capabilities,
    threads: usize,
    progress: Bars,
    physics_steps: AtomicU64,
    env_steps: AtomicU64,
}

impl Session {
    /// Opens a task for the whole pipeline; see [`Session::open_stage`].
    pub fn open(
        task: &str,
        common: &Common,
        algorithms: &Algorithms,
        worlds: &Worlds,
    ) -> Result<Self> {
        Self::open_stage(Stage::Run, task, common, algorithms, worlds)
    }

    /// Finds the task and the engine, resolves the settings, loads the scene and
    /// checks that every unknown acts.
    pub fn open_stage(
        stage: Stage,
        task: &str,
        common: &Common,
        algorithms: &Algorithms,
        worlds: &Worlds,
    ) -> Result<Self> {
        let task = (registry::find::<TaskEntry>(task)?.make)()?;
        let levels = difficulty::levels(&*task, common)?;
        let mut task = difficulty::at(task, &levels)?;
        let (config, parameters) = Config::resolve(stage, &*task, common, algorithms, worlds)?;
        if let Some(condition) = &config.condition
            && let Some(other) = task.under(condition)?
        {
            task = other;
        }
        let backend = backend(&config.backend)?;
        require(&*backend, task.spec().requires)?;
        let scene = backend.load(task.scene())?;
        for target in parameters.iter().flat_map(|p| &p.targets) {
            scene.nominal(target)?;
        }
        let needs = Needs {
            task: &*task,
            layout: scene.layout(),
            parameters: &parameters,
        };
        let model = match (&worlds.simulator.refined, &config.model) {
            (Some(source), _) => model::compile(&*backend, source)?,
            (None, Some(path)) => needs.open(&*backend, path, "simulator", &[])?.1,
            (None, None) => Arc::clone(&scene),
        };
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
        let mut session = Self {
            task,
            parameters,
            signals,
            real: World {
                model: Arc::clone(&scene),
                tracker: TrackerErrors::default(),
                perturbed: None,
            },
            model,
            refined: worlds.simulator.refined.clone(),
            engine: format!("{} {}", backend.name(), backend.version()),
            capabilities: backend.capabilities(),
            threads: common.threads.unwrap_or(0),
            progress: Bars::new(common.quiet),
            physics_steps: AtomicU64::new(0),
            env_steps: AtomicU64::new(0),
            config,
        };
        asid_algorithms::fisher::inert::check_parameters(&session.problem())?;
        let seed = common.machine.unwrap_or(session.config.seed);
        session.real = World::open(&session, &scene, world_streams(seed))?;
        Ok(session)
    }

    /// The problem as passed to algorithms.
    pub fn problem(&self) -> Problem<'_> {
        Problem {
            task: &*self.task,
            model: &*self.model,
            capabilities: self.capabilities,
            parameters: &self.parameters,
            signals: &self.signals,
            threads: self.threads,
            streams: Streams::new(self.config.seed).sealed("method"),
            progress: &self.progress,
            physics_counter: &self.physics_steps,
            env_counter: &self.env_steps,
        }
    }

    /// The [models](Self::ensemble_if) in which an identifier simulates.
    ///
    /// # Errors
    /// Where models are asked for and the identifier does not measure the scatter that they cause.
    pub fn ensemble_for(&self, identifier: &dyn Identifier) -> Result<Option<Ensemble>> {
        let scatter = identifier.assumes().scatter;
        if self.config.model_errors.members > 0 && !scatter {
            return Err(Error::Config {
                key: format!("{MODEL_ERRORS}.members"),
                message: format!(
                    "the identifier {} does not measure how simulations scatter; set it to 0, or \
                     identify by reps, cem or cma-es",
                    self.config.identifier.name
                ),
            }
            .into());
        }
        self.ensemble_if(scatter)
    }

    /// Compiles the models in which the method identifies: its simulator with errors that are drawn
    /// by the seed. `None` where the simulator is taken as it is, and for an identifier that does
    /// not measure the scatter that they cause.
    pub fn ensemble_if(&self, scatter: bool) -> Result<Option<Ensemble>> {
        let config = &self.config;
        let errors = config.model_errors;
        if errors.members == 0 || !scatter {
            return Ok(None);
        }
        let source = match (&self.refined, &config.model) {
            (Some(source), _) => source.clone(),
            (None, Some(path)) => RefinedModel::open(path)?,
            (None, None) => model::of_task(&*self.task),
        };
        let backend = backend(&config.backend)?;
        let given = (&source.parameters[..], &source.effects[..]);
        let streams = Streams::new(config.seed).sealed("model errors");
        let made = errors.ensemble(&*backend, &source.scene, given, &self.parameters, streams)?;
        let (ensemble, left_out) = made.unzip();
        let asked_for = left_out.filter(|_| config.members_given);
        for part in asked_for.into_iter().flatten() {
            failure::warn(&format!("model_errors leaves out {part}"));
        }
        Ok(ensemble)
    }

    /// Random streams of the real world, which cannot be derived from those of the method.
    fn world_streams(&self) -> Streams {
        world_streams(self.config.seed)
    }

    /// The start pose of a stage that takes one, in the order of its coordinates.
    pub fn start(&self) -> Vec<f64> {
        let coordinates = self.config.command.start(&*self.task).iter();
        coordinates
            .filter_map(|c| self.config.start.get(&c.name).copied())
            .collect()
    }

    /// The hidden truth: as given, else drawn by the seed from the condition's range or from the
    /// prior.
    pub fn truth(&self) -> Vec<f64> {
        let streams = self.world_streams().child("truth");
        let conditions = self.task.conditions();
        let chosen = self.config.condition.as_ref();
        let condition = conditions.iter().find(|c| Some(&c.name) == chosen);
        self.parameters
            .iter()
            .map(|p| {
                // Each unknown has its own stream, so that adding an unknown does not change the
                // others.
                let mut rng = streams.stream(&p.name);
                let named = condition.and_then(|c| c.truth.iter().find(|(n, _)| *n == p.name));
                let drawn = match named {
                    // A fixed value stays exact to the bit, also on a logarithmic scale.
                    Some((_, [low, high])) if low == high => *low,
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

    /// The simulated real world with this truth. Warns of a given value outside the prior.
    ///
    /// # Errors
    /// When the engine fails, or the tracker's errors make no sense.
    pub fn world(&self, truth: &[f64]) -> Result<SimulatedWorld<'_>> {
        let given = &self.config.real.truth;
        for p in &self.parameters {
            if let Some(said) = given.get(&p.name).and_then(|x| outside(p, *x)) {
                failure::warn(&said);
            }
        }
        let world = SimulatedWorld::new(
            &*self.task,
            &*self.real.model,
            &self.parameters,
            truth,
            &self.signals,
            self.world_streams(),
        )?;
        Ok(world.with_tracker(self.real.tracker.clone())?)
    }

    /// The perturbations of the real world, where it is a perturbed one.
    pub fn perturbed(&self) -> Option<&PerturbedResult> {
        self.real.perturbed.as_ref()
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

/// Random streams of the real world of this seed.
fn world_streams(seed: u64) -> Streams {
    Streams::new(seed).sealed("world")
}

/// Warning about a true value outside the prior, with the end and the distance; `None` for one
/// inside.
fn outside(parameter: &Parameter, value: f64) -> Option<String> {
    let [low, high] = parameter.range;
    let (beyond, end) = if value < low {
        (low - value, "below its lower end")
    } else if value > high {
        (value - high, "above its upper end")
    } else {
        return None;
    };
    let unit = match &*parameter.unit {
        "" => String::new(),
        unit => format!(" {unit}"),
    };
    Some(format!(
        "--truth {}={value} lies outside of the prior, {} to {}{unit}: {}{unit} {end}; no estimate inside of the prior finds it",
        parameter.name,
        figure(low),
        figure(high),
        figure(beyond)
    ))
}

/// The engine of this name; for one left out of the build, the error says how to get it.
pub fn backend(name: &str) -> Result<Box<dyn Backend>> {
    match registry::find::<BackendEntry>(name) {
        Ok(entry) => Ok((entry.make)()?),
        Err(unknown) => Err(super::list::missing(BackendEntry::KIND, name)
            .unwrap_or(unknown)
            .into()),
    }
}

/// Checks that an engine can do what a task needs.
pub fn require(backend: &dyn Backend, needed: Capabilities) -> Result<()> {
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
