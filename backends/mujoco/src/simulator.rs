//! A batch of simulations.

mod rollout;

use std::ffi::c_int;
use std::sync::Arc;

use asid_core::layout::{Layout, Recording};
use asid_core::simulator::{check_copy, check_len, check_sims, check_state};
use asid_core::{BatchConfig, Error, Result, Rollout, Simulator, Snapshot, Status};

use crate::compiled::{Compiled, compile};
use crate::ffi::Batch;
use crate::history::CommandMemory;
use crate::parameter::{Fields, Plan};
use crate::rollout::{Stage, has_halves, prepare, read};
use crate::state::{SavedStates, StateLayout};

/// Largest memory for the state rows of a batch, bytes. Above it the C++ allocator would end the
/// process.
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
    /// Current values of the parameters, `n x columns`.
    values: Vec<f64>,
    status: Vec<Status>,
    /// Which episodes have begun but taken no step: actuators with a memory then settle on the
    /// first command.
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
    /// Makes a batch with every simulation reset and with nominal parameters.
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
        let threads = config.thread_count().min(size).min(1024);
        let mut batch = if plan.moves_mass() {
            Batch::new(&compile(&compiled.scene, false)?, size, threads)
        } else {
            Batch::new(&compiled.model, size, threads)
        }
        .map_err(Error::Failed)?;
        let fields = plan.expand(&mut batch)?;
        let states = StateLayout::of(&mut batch);
        let all: Vec<c_int> = ids(0..size);
        if plan.derives() {
            batch.set_const(&all).map_err(Error::Failed)?;
        }
        batch.reset(&all, !layout.keyframes.is_empty());
        // An episode begins at time zero, whatever time the keyframe states.
        for sim in 0..size {
            batch.state(sim)[states.time.clone()].fill(0.0);
        }
        let fresh = batch.state(0).to_vec();
        let memory = CommandMemory::of(&compiled.model, &fresh[states.act.clone()]);
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
            quaternions: layout.quaternions(),
            steps: 0,
            plan,
            compiled,
        })
    }

    /// Sets positions and velocities; memory of commands and readings stays.
    fn put(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let (nq, nv) = (self.compiled.layout.nq, self.compiled.layout.nv);
        check_state(&self.compiled.layout, sims.len(), qpos, qvel)?;
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
            // The solver begins as after a reset, wherever it ended.
            let solver = self.states.solver.clone();
            row[solver.clone()].copy_from_slice(&self.fresh[solver]);
        }
        Ok(())
    }

    fn running(&self, sims: &[usize]) -> Vec<usize> {
        let runs = |s: &usize| self.status[*s].is_running();
        sims.iter().copied().filter(runs).collect()
    }
}

fn ids(sims: impl IntoIterator<Item = usize>) -> Vec<c_int> {
    // Sizes are limited far below what the integer holds.
    sims.into_iter().map(|s| s as c_int).collect()
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
        check_len("parameters", values.len(), sims.len() * self.plan.len())?;
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
        self.put(sims, qpos, qvel)?;
        for &sim in sims {
            let row = self.batch.state(sim);
            for part in [&self.states.act, &self.states.history] {
                row[part.clone()].copy_from_slice(&self.fresh[part.clone()]);
            }
            self.begun[sim] = true;
        }
        Ok(())
    }

    fn displace(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        self.put(sims, qpos, qvel)
    }

    fn rollout(&mut self, rollout: &Rollout<'_>, out: &mut [f64]) -> Result<()> {
        self.roll_out(rollout, out)
    }

    fn read(&mut self, sims: &[usize], record: &Recording, out: &mut [f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let width = record.width();
        check_len("output", out.len(), sims.len() * width)?;
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
        let is_own = |s: &SavedStates| Arc::ptr_eq(&s.compiled, &self.compiled);
        let saved = snapshot.restored(rows, sims, is_own)?;
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
        check_copy(from, to, self.batch_size())?;
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
