//! A batch whose simulations have effects, each with values and a state of its own.

use std::sync::{Arc, Mutex, PoisonError};

use asid_core::error::{Error, Result};
use asid_core::layout::{Channel, Layout, Recording};
use asid_core::simulator::{
    ParameterChange, Rollout, Simulator, Snapshot, Status, StepHook, StepView, check_len,
    check_sims,
};

use super::Placed;
use super::rows::{Effects, Row};

/// What a column of a batch sets.
#[derive(Clone, Copy, Debug)]
pub enum Column {
    /// A column of the engine's batch.
    Model(usize),
    /// A parameter of an effect.
    Effect(usize, usize),
    /// The number of the episode.
    Episode,
}

/// A batch whose simulations have effects.
pub struct RefinedSimulator {
    inner: Box<dyn Simulator>,
    effects: Effects,
    placed: Arc<Vec<Placed>>,
    /// Ranges of commands, by the index of the actuator.
    ranges: Vec<(usize, [f64; 2])>,
    columns: Vec<Column>,
    /// Values of the engine's columns before any effect.
    base: Vec<f64>,
    /// Physics steps of each simulation since its episode began.
    steps: Vec<u64>,
    /// Those of them that the engine did not take: it began later in the episode.
    passed: Vec<u64>,
    rows: Vec<Mutex<Row>>,
    /// Positions and speeds of all joints, and their values before simulations were placed
    /// elsewhere.
    state: Recording,
    before: Vec<f64>,
}

/// Steps of a simulation, and the saved states of its effects.
#[derive(Clone)]
struct Memory {
    steps: u64,
    passed: u64,
    effects: Vec<Vec<f64>>,
}

/// The engine's snapshot, and a memory for each row of it.
struct Saved {
    inner: Snapshot,
    memories: Vec<Memory>,
}

fn lock(row: &Mutex<Row>) -> std::sync::MutexGuard<'_, Row> {
    row.lock().unwrap_or_else(PoisonError::into_inner)
}

impl RefinedSimulator {
    /// Gives the engine's batch `inner` some effects.
    ///
    /// `base` are the values of the columns of `inner` before any effect, and `columns` what the
    /// caller sets.
    pub(super) fn new(
        inner: Box<dyn Simulator>,
        effects: Effects,
        base: Vec<f64>,
        columns: Vec<Column>,
    ) -> Result<Self> {
        let size = inner.batch_size();
        let actuators = effects.plant.layout.actuators.iter().enumerate();
        let ranges = actuators.filter_map(|(i, actuator)| Some((i, actuator.ctrl_range?)));
        Ok(Self {
            state: inner.layout().recording(&inner.layout().state_channels())?,
            before: Vec::new(),
            inner,
            ranges: ranges.collect(),
            placed: Arc::clone(&effects.placed),
            effects,
            columns,
            base,
            steps: vec![0; size],
            passed: vec![0; size],
            rows: (0..size).map(|_| Mutex::default()).collect(),
        })
    }

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
            passed: self.passed[sim],
            effects: effects.collect(),
        }
    }

    fn remember(&mut self, sim: usize, memory: &Memory) {
        self.steps[sim] = memory.steps;
        self.passed[sim] = memory.passed;
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

    /// Advances the time of the effects of some simulations by `steps` physics steps, without a
    /// step.
    ///
    /// This is for simulations that begin within an episode: effects that grow with time have it
    /// since the episode's beginning.
    pub fn pass_time(&mut self, sims: &[usize], steps: u64) {
        for &sim in sims {
            self.steps[sim] += steps;
            self.passed[sim] += steps;
        }
    }

    /// Copies the states of simulations `from` to simulations `to`, which keep their effects'
    /// states.
    ///
    /// This is for simulations that differ from their source in their readings alone.
    ///
    /// # Errors
    /// As [`Simulator::copy_state`].
    pub fn follow(&mut self, from: &[usize], to: &[usize]) -> Result<()> {
        self.inner.copy_state(from, to)?;
        for (&source, &sim) in from.iter().zip(to) {
            self.steps[sim] = self.steps[source];
            self.passed[sim] = self.passed[source];
        }
        Ok(())
    }

    /// Places the engine's simulations by `put` at positions and velocities, and tells the effects.
    fn put(
        &mut self,
        sims: &[usize],
        qpos: &[f64],
        qvel: &[f64],
        put: impl Fn(&mut dyn Simulator) -> Result<()>,
    ) -> Result<()> {
        let busy = |s: &usize| lock(&self.rows[*s]).iter().any(Option::is_some);
        if !self.placed.iter().any(|p| p.effect.steps()) || !sims.iter().any(busy) {
            return put(&mut *self.inner);
        }
        let (nq, nv) = (self.layout().nq, self.layout().nv);
        self.before.resize(sims.len() * (nq + nv), 0.0);
        self.inner.read(sims, &self.state, &mut self.before)?;
        put(&mut *self.inner)?;
        let to = qpos
            .chunks_exact(nq.max(1))
            .zip(qvel.chunks_exact(nv.max(1)));
        let before = self.before.chunks_exact((nq + nv).max(1));
        for ((&sim, from), (q, v)) in sims.iter().zip(before).zip(to) {
            let (from_q, from_v) = from.split_at(nq);
            for acting in lock(&self.rows[sim]).iter_mut().flatten() {
                acting.displaced([from_q, from_v], [q, v]);
            }
        }
        Ok(())
    }

    /// The changes of a rollout, with the columns of the engine's batch.
    ///
    /// # Errors
    /// When an effect has or uses such a column: it would act by the value from before.
    fn changes<'c>(&self, changes: &[ParameterChange<'c>]) -> Result<Vec<ParameterChange<'c>>> {
        let of_engine = |change: &ParameterChange<'c>| match self.columns.get(change.column) {
            Some(&Column::Model(column)) if !self.effects.uses(column) => {
                Ok(ParameterChange { column, ..*change })
            }
            Some(_) => Err(Error::Failed(format!(
                "parameter change of column {} at frame {}: an effect has or uses it; end the rollout there, and call \
                 set_parameters",
                change.column, change.frame
            ))),
            None => Err(Error::Shape(format!(
                "parameter change of column {} of {}",
                change.column,
                self.columns.len()
            ))),
        };
        changes.iter().map(of_engine).collect()
    }

    /// Applies the effects on sensors to rows of a simulation's readings.
    ///
    /// The first row is `first` physics steps after the beginning of its episode, and each further
    /// row `substeps` later.
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

/// The hook of a rollout: the effects of each row, then the caller's own hook.
struct RowHook<'a> {
    rows: &'a [Mutex<Row>],
    ranges: &'a [(usize, [f64; 2])],
    sims: &'a [usize],
    passed: &'a [u64],
    timestep: f64,
    then: Option<&'a dyn StepHook>,
}

impl StepHook for RowHook<'_> {
    fn before_step(&self, row: usize, step: usize, view: &mut StepView<'_>) {
        let sim = self.sims[row];
        view.time += self.passed[sim] as f64 * self.timestep;
        // A range limits the command that is given, and effects act behind it.
        for &(actuator, [low, high]) in self.ranges {
            view.ctrl[actuator] = view.ctrl[actuator].clamp(low, high);
        }
        for acting in lock(&self.rows[sim]).iter_mut().flatten() {
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
        check_len("parameters", values.len(), sims.len() * d)?;
        let mut engine = Vec::with_capacity(sims.len() * self.base.len());
        let mut rows = Vec::with_capacity(sims.len());
        let mut given: Vec<Vec<f64>> = self.placed.iter().map(|p| p.values.clone()).collect();
        for i in 0..sims.len() {
            let first = engine.len();
            engine.extend_from_slice(&self.base);
            let mut episode = 0;
            for (column, &value) in self.columns.iter().zip(&values[i * d..]) {
                match *column {
                    Column::Model(at) => engine[first + at] = value,
                    Column::Effect(effect, parameter) => given[effect][parameter] = value,
                    Column::Episode => episode = value as usize,
                }
            }
            rows.push(self.effects.row(&given, episode, &mut engine[first..])?);
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
            self.passed[sim] = 0;
            lock(&self.rows[sim])
                .iter_mut()
                .flatten()
                .for_each(|a| a.restart());
        }
        Ok(())
    }

    fn set_state(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        self.put(sims, qpos, qvel, |inner| inner.set_state(sims, qpos, qvel))
    }

    fn displace(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        self.put(sims, qpos, qvel, |inner| inner.displace(sims, qpos, qvel))
    }

    fn rollout(&mut self, rollout: &Rollout<'_>, out: &mut [f64]) -> Result<()> {
        check_sims(rollout.sims, self.batch_size())?;
        let hook = RowHook {
            rows: &self.rows,
            ranges: &self.ranges,
            sims: rollout.sims,
            passed: &self.passed,
            timestep: self.inner.layout().timestep,
            then: rollout.hook,
        };
        let changes = self.changes(rollout.changes)?;
        let mut with = *rollout;
        with.changes = &changes;
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
