//! A batch: worlds stepped side by side on a pool of threads.
//!
//! Each world is stepped by one thread at a time and shares no mutable data, so results do not
//! depend on the number of threads.

use std::sync::Arc;

use asid_core::layout::{Channel, Layout};
use asid_core::simulator::{ParameterChange, check_copy, check_len, check_sims, check_state};
use asid_core::{
    BatchConfig, Control, Recording, Result, Rollout, Simulator, Snapshot, Status, Target,
};
use rayon::ThreadPool;
use rayon::prelude::*;

use crate::compiled::Compiled;
use crate::parameter::ParameterSlot;
use crate::pool;
use crate::state::State;
use crate::world::{StepInput, World};

/// A batch of simulations of one compiled scene.
pub struct Batch {
    compiled: Arc<Compiled>,
    worlds: Vec<World>,
    status: Vec<Status>,
    columns: Vec<(Target, ParameterSlot)>,
    pool: Option<Arc<ThreadPool>>,
}

/// States in a snapshot, with their scene.
struct Saved {
    compiled: Arc<Compiled>,
    states: Vec<State>,
}

impl Batch {
    /// Makes a batch with every simulation reset and with nominal parameters.
    ///
    /// # Errors
    /// When a target does not belong to the scene or two set the same thing, or no threads can be
    /// started.
    pub fn new(compiled: Arc<Compiled>, config: &BatchConfig) -> Result<Self> {
        let columns = ParameterSlot::resolve_all(&config.targets, &compiled)?;
        let threads = config.thread_count();
        let pool = if threads.min(config.size) > 1 {
            Some(pool::of(threads)?)
        } else {
            None
        };
        Ok(Self {
            worlds: (0..config.size).map(|_| World::new(&compiled)).collect(),
            status: vec![Status::Running; config.size],
            compiled,
            columns,
            pool,
        })
    }

    /// Runs `work` for each of some simulations with its row, in parallel.
    fn for_each<T: Send>(
        &mut self,
        sims: &[usize],
        rows: Vec<T>,
        work: impl Fn(&Compiled, usize, &mut World, T) + Sync,
    ) {
        let compiled = &self.compiled;
        let mut chosen = Vec::with_capacity(sims.len());
        let mut wanted = sims.iter().peekable();
        for (i, world) in self.worlds.iter_mut().enumerate() {
            if wanted.next_if(|&&s| s == i).is_some() {
                chosen.push(world);
            }
        }
        let jobs = chosen.into_iter().zip(rows).enumerate();
        match &self.pool {
            Some(pool) => {
                let jobs: Vec<_> = jobs.collect();
                pool.install(|| {
                    jobs.into_par_iter()
                        .with_max_len(1)
                        .for_each(|(row, (world, data))| work(compiled, row, world, data));
                });
            }
            None => jobs.for_each(|(row, (world, data))| work(compiled, row, world, data)),
        }
        for &sim in sims {
            self.status[sim].clone_from(&self.worlds[sim].state.status);
        }
    }

    fn check_recording(&self, record: &Recording) -> Result<()> {
        for channel in record.channels() {
            if let Channel::Sensor { index } = *channel {
                let sensor = &self.compiled.layout.sensors[index];
                self.compiled.sensors[index].check(&sensor.name, &sensor.kind)?;
            }
        }
        Ok(())
    }

    fn check_changes(&self, changes: &[ParameterChange<'_>]) -> Result<()> {
        for change in changes {
            let (target, slot) = &self.columns[change.column];
            for &value in change.values {
                slot.check(target, value)?;
            }
        }
        Ok(())
    }
}

impl Simulator for Batch {
    fn layout(&self) -> &Layout {
        &self.compiled.layout
    }

    fn batch_size(&self) -> usize {
        self.worlds.len()
    }

    fn set_parameters(&mut self, sims: &[usize], values: &[f64]) -> Result<()> {
        check_sims(sims, self.worlds.len())?;
        let columns = self.columns.len();
        check_len("parameters", values.len(), sims.len() * columns)?;
        for row in values.chunks_exact(columns.max(1)) {
            for ((target, slot), &value) in self.columns.iter().zip(row) {
                slot.check(target, value)?;
            }
        }
        for (row, &sim) in sims.iter().enumerate() {
            let world = &mut self.worlds[sim];
            for (column, (_, slot)) in self.columns.iter().enumerate() {
                slot.set(&mut world.tables, values[row * columns + column]);
            }
            world.state.rebuild(&self.compiled, &world.tables);
        }
        Ok(())
    }

    fn reset(&mut self, sims: &[usize]) -> Result<()> {
        check_sims(sims, self.worlds.len())?;
        let rows = vec![(); sims.len()];
        self.for_each(sims, rows, |compiled, _, world, ()| {
            world.reset(compiled);
        });
        Ok(())
    }

    fn set_state(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        check_sims(sims, self.worlds.len())?;
        let (nq, nv) = (self.compiled.layout.nq, self.compiled.layout.nv);
        check_state(&self.compiled.layout, sims.len(), qpos, qvel)?;
        let rows = vec![(); sims.len()];
        self.for_each(sims, rows, |compiled, row, world, ()| {
            let (time, status) = (world.state.time, world.state.status.clone());
            let qpos = &qpos[row * nq..(row + 1) * nq];
            world.place(compiled, qpos, &qvel[row * nv..(row + 1) * nv], time);
            // One that has diverged stands still until it is reset, loaded or copied into.
            world.state.status = status;
        });
        Ok(())
    }

    fn rollout(&mut self, rollout: &Rollout<'_>, out: &mut [f64]) -> Result<()> {
        rollout.check(
            &self.compiled.layout,
            self.worlds.len(),
            self.columns.len(),
            out,
        )?;
        self.check_recording(rollout.record)?;
        self.check_changes(rollout.changes)?;
        let (frames, width) = (rollout.frames, rollout.record.width());
        let nu = self.compiled.layout.nu();
        let slots: Vec<ParameterSlot> = self.columns.iter().map(|(_, slot)| *slot).collect();
        let mut rows: Vec<&mut [f64]> = Vec::with_capacity(rollout.sims.len());
        let mut rest = out;
        for _ in rollout.sims {
            let (row, after) = rest.split_at_mut(frames * width);
            rows.push(row);
            rest = after;
        }
        let run = |compiled: &Compiled, row: usize, world: &mut World, out: &mut [f64]| {
            let mut wrenches = Vec::with_capacity(rollout.forces.len());
            for frame in 0..frames {
                for change in rollout.changes.iter().filter(|c| c.frame == frame) {
                    let slot = slots[change.column];
                    slot.set(&mut world.tables, change.values[row]);
                    if slot.is_structural() && world.state.status.is_running() {
                        world.state.rebuild(compiled, &world.tables);
                    }
                }
                let at = row * frames + frame;
                let ctrl = match rollout.control {
                    Control::Shared(c) => &c[frame * nu..(frame + 1) * nu],
                    Control::PerSimulation(c) => &c[at * nu..(at + 1) * nu],
                };
                wrenches.clear();
                wrenches.extend(
                    rollout
                        .forces
                        .iter()
                        .map(|f| (f.body, &f.wrench[at * 6..(at + 1) * 6])),
                );
                for substep in 0..rollout.substeps {
                    let input = StepInput {
                        ctrl,
                        wrenches: &wrenches,
                        hook: rollout.hook,
                        slots: &slots,
                        row,
                        step: frame * rollout.substeps + substep,
                    };
                    world.step(compiled, &input);
                }
                world.read(
                    compiled,
                    rollout.record,
                    &mut out[frame * width..(frame + 1) * width],
                );
            }
        };
        self.for_each(rollout.sims, rows, run);
        Ok(())
    }

    fn read(&mut self, sims: &[usize], record: &Recording, out: &mut [f64]) -> Result<()> {
        check_sims(sims, self.worlds.len())?;
        let width = record.width();
        check_len("output", out.len(), sims.len() * width)?;
        self.check_recording(record)?;
        for (row, &sim) in sims.iter().enumerate() {
            let out = &mut out[row * width..(row + 1) * width];
            self.worlds[sim].read(&self.compiled, record, out);
        }
        Ok(())
    }

    fn save(&mut self, sims: &[usize]) -> Result<Snapshot> {
        check_sims(sims, self.worlds.len())?;
        let saved = Saved {
            compiled: Arc::clone(&self.compiled),
            states: sims.iter().map(|&s| self.worlds[s].state.clone()).collect(),
        };
        Ok(Snapshot::new(saved, sims.len()))
    }

    fn load(&mut self, snapshot: &Snapshot, rows: &[usize], sims: &[usize]) -> Result<()> {
        check_sims(sims, self.worlds.len())?;
        let is_own = |s: &Saved| Arc::ptr_eq(&s.compiled, &self.compiled);
        let saved = snapshot.restored(rows, sims, is_own)?;
        self.for_each(sims, rows.to_vec(), |compiled, _, world, row| {
            world.adopt(compiled, &saved.states[row]);
        });
        Ok(())
    }

    fn copy_state(&mut self, from: &[usize], to: &[usize]) -> Result<()> {
        check_copy(from, to, self.worlds.len())?;
        for (&source, &target) in from.iter().zip(to) {
            let (low, high) = self.worlds.split_at_mut(source.max(target));
            let (source, world) = if source < target {
                (&low[source], &mut high[0])
            } else {
                (&high[0], &mut low[target])
            };
            world.adopt(&self.compiled, &source.state);
            self.status[target].clone_from(&world.state.status);
        }
        Ok(())
    }

    fn status(&self) -> &[Status] {
        &self.status
    }

    fn steps_taken(&self) -> u64 {
        self.worlds.iter().map(|w| w.steps).sum()
    }
}
