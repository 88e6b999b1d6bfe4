//! A rollout of a batch, split into segments of frames with the same parameters. Each segment is
//! one call on the thread pool.

use std::ffi::c_int;
use std::ops::Range;

use asid_core::{Error, Result, Rollout, Simulator as _, Status};

use super::{MujocoSimulator, ids};
use crate::ffi::BadNumber;
use crate::rollout::{Frames, Job, Stage, run};

impl MujocoSimulator {
    /// Implements [`asid_core::Simulator::rollout`].
    pub(super) fn roll_out(&mut self, rollout: &Rollout<'_>, out: &mut [f64]) -> Result<()> {
        let layout = &self.compiled.layout;
        rollout.check(layout, self.batch_size(), self.plan.len(), out)?;
        if rollout.substeps == 0 {
            return Err(Error::Shape(
                "a frame needs at least one physics step".into(),
            ));
        }
        let segments = segments(rollout);
        // Check all values before the first step.
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
            sims.push(sim);
            jobs.push(Job {
                row,
                begun: rollout.frames > 0 && std::mem::take(&mut self.begun[sim]),
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
                memory: &self.memory,
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

    /// Writes checked parameters and the constants that depend on them.
    pub(super) fn write_parameters(&mut self, sims: &[usize], values: &[f64]) -> Result<()> {
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

    /// Current parameter values of some simulations.
    fn present(&self, sims: &[usize]) -> Vec<f64> {
        let columns = self.plan.len();
        sims.iter()
            .flat_map(|&s| &self.values[s * columns..(s + 1) * columns])
            .copied()
            .collect()
    }

    pub(super) fn check_values(&self, values: &[f64]) -> Result<()> {
        let columns = self.plan.len().max(1);
        values
            .chunks_exact(columns)
            .try_for_each(|row| self.plan.check(row))
    }

    /// Marks simulations that stopped, and those in which MuJoCo raised an error.
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
                // Changes by a hook are still in the model.
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
}

fn describe(bad: BadNumber) -> &'static str {
    match bad {
        BadNumber::Position => "a position is not finite or beyond 1e10",
        BadNumber::Velocity => "a velocity is not finite or beyond 1e10",
        BadNumber::Acceleration => "an acceleration is not finite or beyond 1e10",
        BadNumber::Command => "a command or applied force is not finite or beyond 1e10",
    }
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
