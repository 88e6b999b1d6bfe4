//! A batch: whole-batch calls over independent simulations, on several threads.

use std::sync::Arc;

use asid_core::layout::{Layout, Recording};
use asid_core::simulator::{check_copy, check_len, check_sims, check_state};
use asid_core::{BatchConfig, Control, Error, Result, Rollout, Simulator, Snapshot, Status};

use crate::model::{Column, Compiled};
use crate::simulation::{Simulation, State};

/// A batch of simulations.
pub struct FlightSimulator {
    compiled: Arc<Compiled>,
    columns: Vec<Column>,
    sims: Vec<Simulation>,
    status: Vec<Status>,
    threads: usize,
    steps: u64,
}

/// Saved states, and the scene to which they belong.
struct Saved {
    compiled: Arc<Compiled>,
    states: Vec<State>,
}

impl FlightSimulator {
    /// Creates a batch.
    ///
    /// # Errors
    /// [`Error::Config`] without simulations, [`Error::Parameter`] for a target that this engine
    /// does not know.
    pub fn new(compiled: Arc<Compiled>, config: &BatchConfig) -> Result<Self> {
        if config.size == 0 {
            return Err(Error::Config {
                key: "size".into(),
                message: "a batch needs at least one simulation".into(),
            });
        }
        let columns = config.targets.iter().map(|t| Ok(compiled.resolve(t)?.0));
        let columns = columns.collect::<Result<Vec<_>>>()?;
        let mut batch = Self {
            sims: vec![Simulation::new(&compiled); config.size],
            status: vec![Status::Running; config.size],
            threads: config.thread_count().min(config.size),
            steps: 0,
            columns,
            compiled,
        };
        let all: Vec<usize> = (0..config.size).collect();
        batch.reset(&all)?;
        Ok(batch)
    }

    /// Updates the public copy of the statuses after states have changed.
    fn publish(&mut self, sims: &[usize]) {
        for &sim in sims {
            self.status[sim].clone_from(&self.sims[sim].state.status);
        }
    }
}

/// Checks that a parameter can take a value.
fn check_value(column: Column, value: f64) -> Result<()> {
    let (parameter, fits) = match column {
        Column::Gravity(_) => ("option/gravity", value.is_finite()),
        Column::Mass(_) => ("body/mass", value.is_finite() && value > 0.0),
    };
    if fits {
        return Ok(());
    }
    Err(Error::Parameter {
        parameter: parameter.into(),
        message: format!("{value} is not physical"),
    })
}

impl Simulator for FlightSimulator {
    fn layout(&self) -> &Layout {
        &self.compiled.layout
    }

    fn batch_size(&self) -> usize {
        self.sims.len()
    }

    fn set_parameters(&mut self, sims: &[usize], values: &[f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        check_len("parameters", values.len(), sims.len() * self.columns.len())?;
        let columns = self.columns.iter().cycle();
        for (&column, &value) in columns.zip(values) {
            check_value(column, value)?;
        }
        for (&sim, row) in sims.iter().zip(values.chunks(self.columns.len().max(1))) {
            for (&column, &value) in self.columns.iter().zip(row) {
                self.sims[sim].set(&self.compiled, column, value);
            }
        }
        Ok(())
    }

    fn reset(&mut self, sims: &[usize]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let key = self.compiled.layout.keyframes.first();
        for &sim in sims {
            let state = &mut self.sims[sim].state;
            state.time = 0.0;
            state.qpos.copy_from_slice(&self.compiled.start);
            match key {
                Some(key) => state.qvel.copy_from_slice(&key.qvel),
                None => state.qvel.fill(0.0),
            }
            state.status = Status::Running;
        }
        self.publish(sims);
        Ok(())
    }

    fn set_state(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let (nq, nv) = (self.compiled.layout.nq, self.compiled.layout.nv);
        check_state(&self.compiled.layout, sims.len(), qpos, qvel)?;
        let length = |q: &[f64]| q[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
        if qpos.chunks(7).any(|q| length(q) < 1e-9) {
            return Err(Error::Shape("a quaternion of the state is zero".into()));
        }
        for (i, &sim) in sims.iter().enumerate() {
            let state = &mut self.sims[sim].state;
            state.qpos.copy_from_slice(&qpos[i * nq..(i + 1) * nq]);
            state.qvel.copy_from_slice(&qvel[i * nv..(i + 1) * nv]);
            for q in state.qpos.chunks_mut(7) {
                let length = length(q);
                q[3..7].iter_mut().for_each(|x| *x /= length);
            }
        }
        Ok(())
    }

    fn rollout(&mut self, rollout: &Rollout<'_>, out: &mut [f64]) -> Result<()> {
        rollout.check(self.layout(), self.batch_size(), self.columns.len(), out)?;
        if rollout.substeps == 0 {
            return Err(Error::Shape(
                "a frame needs at least one physics step".into(),
            ));
        }
        self.compiled.check_readings(rollout.record)?;
        for change in rollout.changes {
            for &value in change.values {
                check_value(self.columns[change.column], value)?;
            }
        }
        // Free bodies have no actuators, so there are no commands to apply.
        let (Control::Shared(_) | Control::PerSimulation(_)) = rollout.control;
        let length = rollout.frames * rollout.record.width();
        let mut wanted = rollout.sims.iter().peekable();
        let mut rest = out;
        let mut jobs = Vec::with_capacity(rollout.sims.len());
        for (number, sim) in self.sims.iter_mut().enumerate() {
            if wanted.next_if_eq(&&number).is_some() {
                let (mine, others) = rest.split_at_mut(length);
                rest = others;
                jobs.push((jobs.len(), sim, mine));
            }
        }
        let share = jobs.len().div_ceil(self.threads).max(1);
        let (compiled, columns) = (&*self.compiled, &self.columns[..]);
        let run = |jobs: &mut [(usize, &mut Simulation, &mut [f64])]| -> u64 {
            jobs.iter_mut()
                .map(|(row, sim, out)| sim.run(compiled, columns, rollout, *row, out))
                .sum()
        };
        self.steps += if self.threads == 1 {
            run(&mut jobs)
        } else {
            std::thread::scope(|scope| {
                let threads: Vec<_> = jobs
                    .chunks_mut(share)
                    .map(|chunk| scope.spawn(|| run(chunk)))
                    .collect();
                let join = |t: std::thread::ScopedJoinHandle<'_, u64>| {
                    t.join()
                        .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
                };
                threads.into_iter().map(join).sum::<u64>()
            })
        };
        self.publish(rollout.sims);
        Ok(())
    }

    fn read(&mut self, sims: &[usize], record: &Recording, out: &mut [f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let width = record.width();
        check_len("output", out.len(), sims.len() * width)?;
        self.compiled.check_readings(record)?;
        for (&sim, row) in sims.iter().zip(out.chunks_mut(width.max(1))) {
            if self.status[sim].is_running() {
                self.sims[sim].record(&self.compiled, record, row);
            } else {
                row.fill(f64::NAN);
            }
        }
        Ok(())
    }

    fn save(&mut self, sims: &[usize]) -> Result<Snapshot> {
        check_sims(sims, self.batch_size())?;
        let saved = Saved {
            compiled: self.compiled.clone(),
            states: sims.iter().map(|&s| self.sims[s].state.clone()).collect(),
        };
        Ok(Snapshot::new(saved, sims.len()))
    }

    fn load(&mut self, snapshot: &Snapshot, rows: &[usize], sims: &[usize]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let is_own = |s: &Saved| Arc::ptr_eq(&s.compiled, &self.compiled);
        let saved = snapshot.restored(rows, sims, is_own)?;
        for (&row, &sim) in rows.iter().zip(sims) {
            self.sims[sim].state.clone_from(&saved.states[row]);
        }
        self.publish(sims);
        Ok(())
    }

    fn copy_state(&mut self, from: &[usize], to: &[usize]) -> Result<()> {
        check_copy(from, to, self.batch_size())?;
        for (&source, &sim) in from.iter().zip(to) {
            let state = self.sims[source].state.clone();
            self.sims[sim].state = state;
        }
        self.publish(to);
        Ok(())
    }

    fn status(&self) -> &[Status] {
        &self.status
    }

    fn steps_taken(&self) -> u64 {
        self.steps
    }
}
