//! A compiled scene with effects: a model like any other.
//!
//! The effects wrap the engine's model and its batches, so that exploration,
//! identification, the task's solver and the diagnosis use a refined simulator
//! without knowing it. Each simulation of a batch has effects of its own, whose
//! parameters are columns like the scene's: `effect/NAME@SITE/PARAMETER`. A row
//! whose effect has null values runs without it, at no cost.

use std::sync::{Arc, Mutex, PoisonError};

use crate::{Acting, Acts, Effect, EffectSpec, Site};
use asid_core::backend::{Backend, Capabilities, Model};
use asid_core::error::{Error, Result};
use asid_core::layout::{Channel, Layout, Recording};
use asid_core::scene::Scene;
use asid_core::simulator::{
    BatchConfig, Rollout, Simulator, Snapshot, Status, StepHook, StepView, check_sims,
};
use asid_core::target::Target;
use asid_mjcf::plant::Plant;

/// An effect found, with the place where it acts.
struct Placed {
    label: String,
    site: String,
    effect: Box<dyn Effect>,
    values: Vec<f64>,
    targets: Vec<Target>,
    /// Sensor whose readings it changes, by index.
    sensor: Option<usize>,
}

impl Placed {
    fn parameter(&self, target: &Target) -> Result<usize> {
        let parameters = self.effect.parameters();
        let place = parameters.iter().position(|p| p.name == target.attribute);
        place.ok_or_else(|| {
            Error::unknown(
                "effect parameter",
                &target.attribute,
                parameters.iter().map(|p| p.name),
            )
        })
    }
}

/// A model with effects and with parameters set to other than the document's values.
pub struct Refined {
    inner: Arc<dyn Model>,
    plant: Arc<Plant>,
    placed: Arc<Vec<Placed>>,
    fixed: Vec<(Target, f64)>,
}

impl Refined {
    /// Gives `model`, which `backend` compiled of the scene that `plant` was read from, some
    /// parameters and effects.
    ///
    /// # Errors
    /// When an effect, site, parameter or target is unknown, or is not for this engine.
    pub fn new(
        backend: &dyn Backend,
        model: Arc<dyn Model>,
        plant: Arc<Plant>,
        fixed: &[(Target, f64)],
        effects: &[EffectSpec],
    ) -> Result<Arc<Self>> {
        let mut placed: Vec<Placed> = Vec::with_capacity(effects.len());
        for spec in effects {
            let effect = spec.find(&plant)?;
            let values = spec.values_of(&*effect)?;
            let label = spec.label();
            if placed.iter().any(|p| p.label == label) {
                return Err(Error::Config {
                    key: "effect".into(),
                    message: format!("`{label}` is named twice"),
                });
            }
            let lacking = needs(&*effect) - backend.capabilities();
            if !lacking.is_empty() {
                return Err(Error::Incapable {
                    backend: backend.name().to_owned(),
                    what: format!("give a scene the effect `{label}`: it needs {lacking:?}"),
                });
            }
            let targets = effect.targets(&plant, &spec.site);
            for target in &targets {
                model.nominal(target)?;
            }
            let sensors = &plant.layout.sensors;
            let sensor = match effect.acts() {
                Acts::Measurement => sensors.iter().position(|s| s.name == spec.site),
                _ => None,
            };
            placed.push(Placed {
                label,
                site: spec.site.clone(),
                effect,
                values,
                targets,
                sensor,
            });
        }
        // A force may depend on the command that reaches the drive.
        placed.sort_by_key(|p| p.effect.acts() != Acts::Command);
        for (target, _) in fixed {
            model.nominal(target)?;
        }
        let refined = Arc::new(Self {
            inner: model,
            plant,
            placed: Arc::new(placed),
            fixed: fixed.to_vec(),
        });
        // Values are checked where a simulation is made; a batch of one makes it now.
        refined.simulator(&BatchConfig {
            size: 1,
            threads: 1,
            targets: Vec::new(),
        })?;
        Ok(refined)
    }

    /// Compiles a scene with effects.
    ///
    /// # Errors
    /// As [`Backend::load`] and [`Refined::new`].
    pub fn load(backend: &dyn Backend, scene: &Scene, effects: &[EffectSpec]) -> Result<Arc<Self>> {
        let plant = Arc::new(Plant::of(scene)?);
        Self::new(backend, backend.load(scene)?, plant, &[], effects)
    }

    /// The effect and its parameter that a target names; `None` for a target of the scene.
    fn effect_column(&self, target: &Target) -> Result<Option<(usize, usize)>> {
        if target.element != "effect" {
            return Ok(None);
        }
        let labels = self.placed.iter().map(|p| &*p.label);
        let effect = self
            .placed
            .iter()
            .position(|p| p.label == target.name)
            .ok_or_else(|| Error::unknown("effect of this model", &target.name, labels))?;
        let parameter = self.placed[effect].parameter(target)?;
        Ok(Some((effect, parameter)))
    }
}

/// What an engine must be able to do for an effect.
#[must_use]
pub fn needs(effect: &dyn Effect) -> Capabilities {
    if effect.steps() {
        effect.needs() | Capabilities::STEP_HOOKS
    } else {
        effect.needs()
    }
}

impl Model for Refined {
    fn layout(&self) -> &Layout {
        self.inner.layout()
    }

    fn engine(&self) -> String {
        self.inner.engine()
    }

    fn nominal(&self, target: &Target) -> Result<f64> {
        if let Some((effect, parameter)) = self.effect_column(target)? {
            return Ok(self.placed[effect].values[parameter]);
        }
        let fixed = self.fixed.iter().find(|(t, _)| t == target);
        fixed.map_or_else(|| self.inner.nominal(target), |(_, value)| Ok(*value))
    }

    fn simulator(&self, config: &BatchConfig) -> Result<Box<dyn Simulator>> {
        let mut targets: Vec<Target> = Vec::new();
        let mut place = |target: &Target| match targets.iter().position(|t| t == target) {
            Some(i) => i,
            None => {
                targets.push(target.clone());
                targets.len() - 1
            }
        };
        let columns = config
            .targets
            .iter()
            .map(|target| {
                Ok(match self.effect_column(target)? {
                    None => Column::Model(place(target)),
                    Some((effect, parameter)) => Column::Effect(effect, parameter),
                })
            })
            .collect::<Result<Vec<_>>>()?;
        for (target, _) in &self.fixed {
            place(target);
        }
        let places: Vec<Vec<usize>> = self
            .placed
            .iter()
            .map(|p| p.targets.iter().map(&mut place).collect())
            .collect();
        let base = targets
            .iter()
            .map(|t| self.nominal(t))
            .collect::<Result<Vec<_>>>()?;
        let inner = self.inner.simulator(&BatchConfig {
            targets,
            ..config.clone()
        })?;
        let nominal = config
            .targets
            .iter()
            .map(|t| self.nominal(t))
            .collect::<Result<Vec<_>>>()?;
        let mut simulator = RefinedSimulator {
            inner,
            plant: Arc::clone(&self.plant),
            placed: Arc::clone(&self.placed),
            places,
            columns,
            base,
            steps: vec![0; config.size],
            rows: (0..config.size).map(|_| Mutex::default()).collect(),
        };
        let all: Vec<usize> = (0..config.size).collect();
        simulator.set_parameters(&all, &nominal.repeat(config.size))?;
        Ok(Box::new(simulator))
    }
}

/// What a column of a batch sets.
#[derive(Clone, Copy, Debug)]
enum Column {
    /// A column of the engine's batch.
    Model(usize),
    /// A parameter of an effect.
    Effect(usize, usize),
}

/// Effects at work in one simulation; `None` where one has its null values.
type Row = Vec<Option<Box<dyn Acting>>>;

struct RefinedSimulator {
    inner: Box<dyn Simulator>,
    plant: Arc<Plant>,
    placed: Arc<Vec<Placed>>,
    /// Columns of the engine's batch that each effect's targets are.
    places: Vec<Vec<usize>>,
    columns: Vec<Column>,
    /// Values of the engine's columns before any effect.
    base: Vec<f64>,
    /// Physics steps of each simulation since its episode began.
    steps: Vec<u64>,
    rows: Vec<Mutex<Row>>,
}

/// Memories of a simulation's effects, and its steps.
#[derive(Clone)]
struct Memory {
    steps: u64,
    effects: Vec<Vec<f64>>,
}

/// The engine's snapshot, and a memory for each of its rows.
struct Saved {
    inner: Snapshot,
    memories: Vec<Memory>,
}

fn lock(row: &Mutex<Row>) -> std::sync::MutexGuard<'_, Row> {
    row.lock().unwrap_or_else(PoisonError::into_inner)
}

impl RefinedSimulator {
    fn memory(&self, sim: usize) -> Memory {
        let row = lock(&self.rows[sim]);
        let effects = row.iter().map(|acting| {
            let mut memory = Vec::new();
            if let Some(acting) = acting {
                acting.save(&mut memory);
            }
            memory
        });
        Memory {
            steps: self.steps[sim],
            effects: effects.collect(),
        }
    }

    fn remember(&mut self, sim: usize, memory: &Memory) {
        self.steps[sim] = memory.steps;
        let mut row = lock(&self.rows[sim]);
        for (acting, memory) in row.iter_mut().zip(&memory.effects) {
            if let Some(acting) = acting {
                if memory.is_empty() {
                    acting.restart();
                } else {
                    acting.load(memory);
                }
            }
        }
    }

    /// Lets the sensors' effects change `frames` rows of a simulation's readings, the first
    /// after `first` physics steps of its episode and each `substeps` later than the one before.
    fn measure(
        &self,
        sim: usize,
        record: &Recording,
        (first, substeps): (u64, u64),
        readings: &mut [f64],
    ) {
        if self.placed.iter().all(|p| p.sensor.is_none()) {
            return;
        }
        let mut row = lock(&self.rows[sim]);
        for (acting, placed) in row.iter_mut().zip(self.placed.iter()) {
            let (Some(acting), Some(sensor)) = (acting, placed.sensor) else {
                continue;
            };
            let channels = record.channels().iter().enumerate();
            for (i, _) in
                channels.filter(|(_, c)| matches!(c, Channel::Sensor { index } if *index == sensor))
            {
                let range = record.range(i);
                for (k, frame) in readings.chunks_exact_mut(record.width()).enumerate() {
                    let steps = first + k as u64 * substeps;
                    let time = steps as f64 * self.inner.layout().timestep;
                    acting.read(time, &mut frame[range.clone()]);
                }
            }
        }
    }
}

/// The hook of a rollout: effects of each row, then what the caller brought.
struct RowHook<'a> {
    rows: &'a [Mutex<Row>],
    sims: &'a [usize],
    then: Option<&'a dyn StepHook>,
}

impl StepHook for RowHook<'_> {
    fn before_step(&self, row: usize, step: usize, view: &mut StepView<'_>) {
        for acting in lock(&self.rows[self.sims[row]]).iter_mut().flatten() {
            acting.before_step(view);
        }
        if let Some(hook) = self.then {
            hook.before_step(row, step, view);
        }
    }
}

impl Simulator for RefinedSimulator {
    fn layout(&self) -> &Layout {
        self.inner.layout()
    }

    fn batch_size(&self) -> usize {
        self.inner.batch_size()
    }

    fn set_parameters(&mut self, sims: &[usize], values: &[f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let d = self.columns.len();
        if values.len() != sims.len() * d {
            return Err(Error::Shape(format!(
                "parameters has {} values where {} are needed",
                values.len(),
                sims.len() * d
            )));
        }
        let mut engine = Vec::with_capacity(sims.len() * self.base.len());
        let mut rows = Vec::with_capacity(sims.len());
        let mut given: Vec<Vec<f64>> = self.placed.iter().map(|p| p.values.clone()).collect();
        for i in 0..sims.len() {
            let first = engine.len();
            engine.extend_from_slice(&self.base);
            for (column, &value) in self.columns.iter().zip(&values[i * d..]) {
                match *column {
                    Column::Model(at) => engine[first + at] = value,
                    Column::Effect(effect, parameter) => given[effect][parameter] = value,
                }
            }
            let mut row = Row::with_capacity(given.len());
            for ((placed, values), columns) in self.placed.iter().zip(&given).zip(&self.places) {
                let null = placed.effect.parameters().iter().map(|p| p.null);
                if !values.is_empty() && null.eq(values.iter().copied()) {
                    row.push(None);
                    continue;
                }
                let acting = placed.effect.attach(&Site {
                    plant: &self.plant,
                    name: &placed.site,
                    values,
                    columns,
                })?;
                row.push(Some(acting));
            }
            // What the model is comes first: other effects may depend on it, or take it over.
            for of_model in [true, false] {
                for (acting, placed) in row.iter().zip(self.placed.iter()) {
                    if let Some(acting) = acting
                        && (placed.effect.acts() == Acts::Model) == of_model
                    {
                        acting.set(&mut engine[first..]);
                    }
                }
            }
            rows.push(row);
        }
        self.inner.set_parameters(sims, &engine)?;
        for (&sim, row) in sims.iter().zip(rows) {
            let memory = self.memory(sim);
            *lock(&self.rows[sim]) = row;
            self.remember(sim, &memory);
        }
        Ok(())
    }

    fn reset(&mut self, sims: &[usize]) -> Result<()> {
        self.inner.reset(sims)?;
        for &sim in sims {
            self.steps[sim] = 0;
            lock(&self.rows[sim])
                .iter_mut()
                .flatten()
                .for_each(|a| a.restart());
        }
        Ok(())
    }

    fn set_state(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        self.inner.set_state(sims, qpos, qvel)
    }

    fn rollout(&mut self, rollout: &Rollout<'_>, out: &mut [f64]) -> Result<()> {
        check_sims(rollout.sims, self.batch_size())?;
        let hook = RowHook {
            rows: &self.rows,
            sims: rollout.sims,
            then: rollout.hook,
        };
        let mut with = *rollout;
        let busy = rollout
            .sims
            .iter()
            .any(|&s| lock(&self.rows[s]).iter().any(Option::is_some));
        if busy && self.placed.iter().any(|p| p.effect.steps()) {
            with.hook = Some(&hook);
        }
        self.inner.rollout(&with, out)?;
        let substeps = rollout.substeps as u64;
        let row = rollout.frames * rollout.record.width();
        for (&sim, readings) in rollout.sims.iter().zip(out.chunks_exact_mut(row.max(1))) {
            let first = self.steps[sim] + substeps;
            self.measure(sim, rollout.record, (first, substeps), readings);
        }
        for &sim in rollout.sims {
            self.steps[sim] += rollout.frames as u64 * substeps;
        }
        Ok(())
    }

    fn read(&mut self, sims: &[usize], record: &Recording, out: &mut [f64]) -> Result<()> {
        self.inner.read(sims, record, out)?;
        for (&sim, row) in sims.iter().zip(out.chunks_exact_mut(record.width().max(1))) {
            self.measure(sim, record, (self.steps[sim], 0), row);
        }
        Ok(())
    }

    fn save(&mut self, sims: &[usize]) -> Result<Snapshot> {
        let saved = Saved {
            inner: self.inner.save(sims)?,
            memories: sims.iter().map(|&s| self.memory(s)).collect(),
        };
        Ok(Snapshot::new(saved, sims.len()))
    }

    fn load(&mut self, snapshot: &Snapshot, rows: &[usize], sims: &[usize]) -> Result<()> {
        let saved = snapshot
            .data::<Saved>()
            .ok_or_else(|| Error::Shape("the snapshot is of another scene".into()))?;
        self.inner.load(&saved.inner, rows, sims)?;
        for (&row, &sim) in rows.iter().zip(sims) {
            self.remember(sim, &saved.memories[row]);
        }
        Ok(())
    }

    fn copy_state(&mut self, from: &[usize], to: &[usize]) -> Result<()> {
        self.inner.copy_state(from, to)?;
        for (&source, &sim) in from.iter().zip(to) {
            let memory = self.memory(source);
            self.remember(sim, &memory);
        }
        Ok(())
    }

    fn status(&self) -> &[Status] {
        self.inner.status()
    }

    fn steps_taken(&self) -> u64 {
        self.inner.steps_taken()
    }
}
