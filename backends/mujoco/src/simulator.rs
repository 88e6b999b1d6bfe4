//! A batch of simulations.

use std::ffi::c_int;
use std::ops::Range;
use std::sync::Arc;

use asid_core::layout::{JointKind, Layout, Recording};
use asid_core::simulator::check_sims;
use asid_core::{BatchConfig, Control, Error, Result, Rollout, Simulator, Snapshot, Status};

use crate::compiled::{Compiled, compile};
use crate::ffi::{BadNumber, Batch};
use crate::history::CommandMemory;
use crate::parameter::{Fields, Plan};
use crate::rollout::{Frames, Job, Stage, has_halves, prepare, read, run};
use crate::state::{SavedStates, StateLayout};

/// Largest memory for the state rows of a batch, bytes. Beyond it the C++
/// allocator would end the process.
const MAX_STATE_BYTES: usize = 8 << 30;

/// A batch of simulations of one scene.
pub struct MujocoSimulator {
    compiled: Arc<Compiled>,
    batch: Batch,
    states: StateLayout,
    /// A state row right after a reset.
    fresh: Vec<f64>,
    plan: Plan,
    fields: Fields,
    /// Present values of the parameters, `n x columns`.
    values: Vec<f64>,
    status: Vec<Status>,
    /// Which episodes have begun but not run: actuators with a memory then settle on the first command.
    begun: Vec<bool>,
    memory: CommandMemory,
    /// First entry of `qpos` of each quaternion.
    quaternions: Vec<usize>,
    /// Address and length of each sensor.
    sensors: Vec<(usize, usize)>,
    halves: bool,
    steps: u64,
}

impl MujocoSimulator {
    /// Makes a batch, every simulation reset and with nominal parameters.
    ///
    /// # Errors
    /// [`Error::Config`] for a size of 0 or one that does not fit in memory.
    pub fn new(compiled: Arc<Compiled>, plan: Plan, config: &BatchConfig) -> Result<Self> {
        let size = config.size;
        let refuse = |message: String| Error::Config {
            key: "size".into(),
            message,
        };
        let layout = &compiled.layout;
        let row = 2 * (layout.nq + layout.nv) + 6 * layout.bodies.len() + plan.len();
        if size == 0 {
            return Err(refuse("a batch needs at least one simulation".into()));
        }
        if size > MAX_STATE_BYTES / (8 * row) {
            return Err(refuse(format!(
                "{size} simulations of this scene need more than {} GiB for their states",
                MAX_STATE_BYTES >> 30
            )));
        }
        let threads = match config.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n => n,
        };
        let threads = threads.min(size).min(1024);
        let mut batch = if plan.moves_mass() {
            Batch::new(&compile(&compiled.scene, false)?, size, threads)
        } else {
            Batch::new(&compiled.model, size, threads)
        }
        .map_err(Error::Failed)?;
        let fields = plan.expand(&mut batch)?;
        let states = StateLayout::of(&mut batch);
        let quaternions = layout
            .joints
            .iter()
            .filter_map(|j| match j.kind {
                JointKind::Free => Some(j.qpos + 3),
                JointKind::Ball => Some(j.qpos),
                JointKind::Hinge | JointKind::Slide => None,
            })
            .collect();
        let all: Vec<c_int> = ids(0..size);
        if plan.derives() {
            batch.set_const(&all).map_err(Error::Failed)?;
        }
        batch.reset(&all, !layout.keyframes.is_empty());
        let fresh = batch.state(0).to_vec();
        let [act, history, _] = states.memory.each_ref().map(|part| part.start);
        let memory = CommandMemory::of(&compiled.model, act, history, &fresh);
        let values = std::iter::repeat_with(|| plan.nominal())
            .take(size)
            .flatten()
            .collect();
        Ok(Self {
            sensors: layout.sensors.iter().map(|s| (s.address, s.len)).collect(),
            halves: has_halves(&compiled.model),
            batch,
            states,
            fresh,
            fields,
            values,
            status: vec![Status::Running; size],
            begun: vec![true; size],
            memory,
            quaternions,
            steps: 0,
            plan,
            compiled,
        })
    }

    /// Writes parameters that are checked, and what follows from them.
    fn write_parameters(&mut self, sims: &[usize], values: &[f64]) -> Result<()> {
        let columns = self.plan.len();
        let mut derived: Vec<c_int> = Vec::new();
        for (i, &sim) in sims.iter().enumerate() {
            let new = &values[i * columns..(i + 1) * columns];
            let old = &mut self.values[sim * columns..(sim + 1) * columns];
            if self
                .plan
                .write(&mut self.batch, &self.fields, sim, old, new)
            {
                derived.push(sim as c_int);
            }
            old.copy_from_slice(new);
        }
        self.batch.set_const(&derived).map_err(Error::Failed)
    }

    /// Values of the rollout's parameters with the changes at a frame.
    fn changed(&self, rollout: &Rollout<'_>, frame: usize, values: &mut [f64]) {
        let columns = self.plan.len();
        for change in rollout.changes.iter().filter(|c| c.frame == frame) {
            for (row, &value) in change.values.iter().enumerate() {
                values[row * columns + change.column] = value;
            }
        }
    }

    /// Present parameter values of some simulations.
    fn present(&self, sims: &[usize]) -> Vec<f64> {
        let columns = self.plan.len();
        sims.iter()
            .flat_map(|&s| &self.values[s * columns..(s + 1) * columns])
            .copied()
            .collect()
    }

    fn check_values(&self, values: &[f64]) -> Result<()> {
        let columns = self.plan.len().max(1);
        values
            .chunks_exact(columns)
            .try_for_each(|row| self.plan.check(row))
    }

    /// Marks simulations that stopped, and those that MuJoCo raised an error in.
    fn settle(&mut self, sims: &[usize], jobs: &[Job<'_>]) {
        for (&sim, job) in sims.iter().zip(jobs) {
            let stopped = match (self.batch.failure(sim), job.stopped) {
                (Some(message), _) => {
                    let done = job.steps as f64 * self.compiled.layout.timestep;
                    let at = self.states.time.start;
                    Some((self.batch.state(sim)[at] + done, message))
                }
                (None, Some((time, bad))) => Some((time, describe(bad).to_owned())),
                (None, None) => None,
            };
            if let Some((time, message)) = stopped {
                // What a hook changed is still in the model.
                let columns = self.plan.len();
                let set = &self.values[sim * columns..(sim + 1) * columns];
                let unknown = vec![f64::NAN; columns];
                let (batch, fields) = (&mut self.batch, &self.fields);
                self.plan.write(batch, fields, sim, &unknown, set);
                self.status[sim] = Status::Diverged {
                    time,
                    message: format!("{message} at {time:.6} s"),
                };
            }
        }
    }

    fn running(&self, sims: &[usize]) -> Vec<usize> {
        let runs = |s: &usize| self.status[*s].is_running();
        sims.iter().copied().filter(runs).collect()
    }
}

fn describe(bad: BadNumber) -> &'static str {
    match bad {
        BadNumber::Position => "a position is not finite or beyond 1e10",
        BadNumber::Velocity => "a velocity is not finite or beyond 1e10",
        BadNumber::Acceleration => "an acceleration is not finite or beyond 1e10",
        BadNumber::Command => "a command or applied force is not finite or beyond 1e10",
    }
}

fn ids(sims: impl IntoIterator<Item = usize>) -> Vec<c_int> {
    // Sizes are limited far below what the integer holds.
    sims.into_iter().map(|s| s as c_int).collect()
}

fn expect(what: &str, have: usize, want: usize) -> Result<()> {
    if have == want {
        return Ok(());
    }
    Err(Error::Shape(format!(
        "{what} has {have} values where {want} are needed"
    )))
}

/// Frames between parameter changes, in order.
fn segments(rollout: &Rollout<'_>) -> Vec<Range<usize>> {
    let mut starts: Vec<usize> = rollout.changes.iter().map(|c| c.frame).collect();
    starts.push(0);
    starts.sort_unstable();
    starts.dedup();
    let ends = starts[1..].iter().copied().chain([rollout.frames]);
    starts.iter().zip(ends).map(|(&a, b)| a..b).collect()
}

impl Simulator for MujocoSimulator {
    fn layout(&self) -> &Layout {
        &self.compiled.layout
    }

    fn batch_size(&self) -> usize {
        self.status.len()
    }

    fn set_parameters(&mut self, sims: &[usize], values: &[f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        expect("parameters", values.len(), sims.len() * self.plan.len())?;
        self.check_values(values)?;
        self.write_parameters(sims, values)
    }

    fn reset(&mut self, sims: &[usize]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        // A reset state depends on no parameter, so it is copied like any other.
        for &sim in sims {
            self.batch.state(sim).copy_from_slice(&self.fresh);
            self.batch.clear_warnings(sim);
            self.status[sim] = Status::Running;
            self.begun[sim] = true;
        }
        Ok(())
    }

    fn set_state(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let (nq, nv) = (self.compiled.layout.nq, self.compiled.layout.nv);
        expect("qpos", qpos.len(), sims.len() * nq)?;
        expect("qvel", qvel.len(), sims.len() * nv)?;
        if qpos.iter().chain(qvel).any(|x| !x.is_finite()) {
            return Err(Error::Shape(
                "the state holds a value that is not finite".into(),
            ));
        }
        let norm = |row: &[f64], at: usize| {
            let q = &row[at..at + 4];
            q.iter().map(|x| x * x).sum::<f64>().sqrt()
        };
        for row in qpos.chunks_exact(nq.max(1)) {
            if self.quaternions.iter().any(|&at| norm(row, at) < 1e-9) {
                return Err(Error::Shape("a quaternion of the state is zero".into()));
            }
        }
        for (i, &sim) in sims.iter().enumerate() {
            let row = self.batch.state(sim);
            let positions = &mut row[self.states.qpos.clone()];
            positions.copy_from_slice(&qpos[i * nq..(i + 1) * nq]);
            for &at in &self.quaternions {
                let length = norm(positions, at);
                positions[at..at + 4].iter_mut().for_each(|x| *x /= length);
            }
            row[self.states.qvel.clone()].copy_from_slice(&qvel[i * nv..(i + 1) * nv]);
            // Nothing else remembers the state from before.
            for part in &self.states.memory {
                row[part.clone()].copy_from_slice(&self.fresh[part.clone()]);
            }
            self.begun[sim] = true;
        }
        Ok(())
    }

    fn rollout(&mut self, rollout: &Rollout<'_>, out: &mut [f64]) -> Result<()> {
        let layout = &self.compiled.layout;
        rollout.check(layout, self.batch_size(), self.plan.len(), out)?;
        if rollout.substeps == 0 {
            return Err(Error::Shape(
                "a frame needs at least one physics step".into(),
            ));
        }
        let segments = segments(rollout);
        // All values are checked before the first step.
        if !rollout.changes.is_empty() {
            let mut values = self.present(rollout.sims);
            for segment in &segments {
                self.changed(rollout, segment.start, &mut values);
                self.check_values(&values)?;
            }
        }
        let nu = layout.nu();
        let width = rollout.record.width();
        let stage = Stage::of(rollout.record, &self.compiled.model);
        let length = rollout.frames * width;
        let mut rest = &mut *out;
        let mut jobs = Vec::with_capacity(rollout.sims.len());
        let mut sims = Vec::with_capacity(rollout.sims.len());
        for (row, &sim) in rollout.sims.iter().enumerate() {
            let (mine, others) = rest.split_at_mut(length);
            rest = others;
            if !self.status[sim].is_running() {
                mine.fill(f64::NAN);
                continue;
            }
            if std::mem::take(&mut self.begun[sim]) && rollout.frames > 0 && !self.memory.is_empty()
            {
                let first = match rollout.control {
                    Control::Shared(all) => &all[..nu],
                    Control::PerSimulation(all) => &all[row * rollout.frames * nu..][..nu],
                };
                self.memory.hold(self.batch.state(sim), first);
            }
            sims.push(sim);
            jobs.push(Job {
                row,
                out: mine,
                frames: 0,
                steps: 0,
                stopped: None,
                parameters: std::array::from_fn(|_| Vec::new()),
            });
        }
        for range in segments {
            if !rollout.changes.is_empty() {
                let mut values = self.present(rollout.sims);
                self.changed(rollout, range.start, &mut values);
                self.write_parameters(rollout.sims, &values)?;
            }
            let frames = Frames {
                rollout,
                range,
                nu,
                stage,
                sensors: &self.sensors,
                halves: self.halves,
                columns: self.plan.columns(),
            };
            if rollout.hook.is_some() {
                let columns = self.plan.len();
                for (&sim, job) in sims.iter().zip(&mut jobs) {
                    let set = &self.values[sim * columns..(sim + 1) * columns];
                    job.parameters = std::array::from_fn(|_| set.to_vec());
                }
            }
            let numbers = ids(sims.iter().copied());
            for job in &mut jobs {
                job.steps = 0;
            }
            self.batch.apply(
                &numbers,
                &mut jobs,
                &|job, sim| run(job, sim, &frames),
                true,
            );
            self.steps += jobs.iter().map(|j| j.steps).sum::<u64>();
            self.settle(&sims, &jobs);
            let mut row = 0;
            let status = &self.status;
            jobs.retain_mut(|job| {
                let runs = status[sims[row]].is_running();
                row += 1;
                if !runs {
                    job.out[job.frames * width..].fill(f64::NAN);
                }
                runs
            });
            sims.retain(|&s| status[s].is_running());
        }
        Ok(())
    }

    fn read(&mut self, sims: &[usize], record: &Recording, out: &mut [f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let width = record.width();
        expect("output", out.len(), sims.len() * width)?;
        out.fill(f64::NAN);
        let running = ids(self.running(sims));
        if width == 0 {
            return Ok(());
        }
        let status = &self.status;
        let mut rows: Vec<&mut [f64]> = out
            .chunks_exact_mut(width)
            .zip(sims)
            .filter(|&(_, &s)| status[s].is_running())
            .map(|(row, _)| row)
            .collect();
        let stage = Stage::of(record, &self.compiled.model);
        let sensors = &self.sensors;
        self.batch.apply(
            &running,
            &mut rows,
            &|row, sim| {
                prepare(sim, stage);
                read(sim, record, sensors, row);
            },
            false,
        );
        Ok(())
    }

    fn save(&mut self, sims: &[usize]) -> Result<Snapshot> {
        check_sims(sims, self.batch_size())?;
        let mut rows = Vec::with_capacity(sims.len() * self.batch.nstate());
        for &sim in sims {
            rows.extend_from_slice(self.batch.state(sim));
        }
        let saved = SavedStates {
            compiled: self.compiled.clone(),
            rows,
            status: sims.iter().map(|&s| self.status[s].clone()).collect(),
            begun: sims.iter().map(|&s| self.begun[s]).collect(),
        };
        Ok(Snapshot::new(saved, sims.len()))
    }

    fn load(&mut self, snapshot: &Snapshot, rows: &[usize], sims: &[usize]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        expect("rows", rows.len(), sims.len())?;
        let saved = snapshot
            .data::<SavedStates>()
            .filter(|s| Arc::ptr_eq(&s.compiled, &self.compiled))
            .ok_or_else(|| Error::Shape("the snapshot is of another scene".into()))?;
        if let Some(row) = rows.iter().find(|&&r| r >= snapshot.rows()) {
            return Err(Error::Shape(format!(
                "row {row} of a snapshot with {} rows",
                snapshot.rows()
            )));
        }
        let width = self.batch.nstate();
        for (&row, &sim) in rows.iter().zip(sims) {
            let state = &saved.rows[row * width..(row + 1) * width];
            self.batch.state(sim).copy_from_slice(state);
            self.batch.clear_warnings(sim);
            self.status[sim] = saved.status[row].clone();
            self.begun[sim] = saved.begun[row];
        }
        Ok(())
    }

    fn copy_state(&mut self, from: &[usize], to: &[usize]) -> Result<()> {
        let size = self.batch_size();
        check_sims(to, size)?;
        expect("from", from.len(), to.len())?;
        if let Some(sim) = from.iter().find(|&&s| s >= size) {
            return Err(Error::Shape(format!("simulation {sim} of {size}")));
        }
        if let Some(sim) = from.iter().find(|s| to.binary_search(s).is_ok()) {
            return Err(Error::Shape(format!(
                "simulation {sim} is copied from and to"
            )));
        }
        for (&source, &sim) in from.iter().zip(to) {
            self.batch.copy_state(source, sim);
            self.batch.clear_warnings(sim);
            self.status[sim] = self.status[source].clone();
            self.begun[sim] = self.begun[source];
        }
        Ok(())
    }

    fn status(&self) -> &[Status] {
        &self.status
    }

    fn steps_taken(&self) -> u64 {
        self.steps
    }
}
