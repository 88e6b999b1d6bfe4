//! An engine's batch as a [`Simulator`].
//!
//! Everything that a caller could get wrong is checked here before the engine is called: lengths,
//! indices, non-finite numbers, snapshots of other scenes. An engine behind the table may rely on
//! it. The engine's own faults are caught as far as they are visible from outside. These are
//! readings that are not numbers although the simulation is reported as running, and calls that
//! report a panic. After a panic the batch is not called again.

use std::ptr::NonNull;
use std::sync::Arc;

use asid_core::layout::{Layout, Recording};
use asid_core::simulator::{check_copy, check_len, check_sims, check_state};
use asid_core::{BatchConfig, Capabilities, Error, Result, Rollout, Simulator, Snapshot, Status};

use crate::batch::BatchHandle;
use crate::failure::broken;
use crate::handle::ModelHandle;
use crate::snapshot::SavedStates;
use crate::{readings, rollout, slices};

/// A batch of an engine of a plugin.
pub struct LoadedSimulator {
    batch: BatchHandle,
    status: Vec<Status>,
    /// First entry of `qpos` of each quaternion.
    quaternions: Vec<usize>,
}

impl LoadedSimulator {
    /// Makes a batch.
    ///
    /// # Errors
    /// [`Error::Config`] for no simulations; the engine's own errors.
    pub fn new(model: Arc<ModelHandle>, config: &BatchConfig) -> Result<Self> {
        Ok(Self {
            quaternions: model.layout().quaternions(),
            batch: BatchHandle::new(model, config)?,
            status: vec![Status::Running; config.size],
        })
    }
}

fn finite(what: &str, values: &[f64]) -> Result<()> {
    match values.iter().find(|x| !x.is_finite()) {
        None => Ok(()),
        Some(x) => Err(Error::Shape(format!(
            "{what} holds {x}, which is not finite"
        ))),
    }
}

impl Simulator for LoadedSimulator {
    fn layout(&self) -> &Layout {
        self.batch.model.layout()
    }

    fn batch_size(&self) -> usize {
        self.status.len()
    }

    fn set_parameters(&mut self, sims: &[usize], values: &[f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        check_len(
            "parameters",
            values.len(),
            sims.len() * self.batch.columns.len(),
        )?;
        finite("parameters", values)?;
        let set = self.batch.engine().table.set_parameters;
        self.batch.call("set_parameters", set, |f, batch, error| {
            // SAFETY: lengths are checked; everything lives until the call returns.
            unsafe {
                f(
                    batch,
                    slices::sims(sims),
                    sims.len() as u64,
                    values.as_ptr(),
                    error,
                )
            }
        })
    }

    fn reset(&mut self, sims: &[usize]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let reset = self.batch.engine().table.reset;
        self.batch.call("reset", reset, |f, batch, error| {
            // SAFETY: indices are checked; everything lives until the call returns.
            unsafe { f(batch, slices::sims(sims), sims.len() as u64, error) }
        })?;
        self.batch.refresh(&mut self.status)
    }

    fn set_state(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        check_state(self.layout(), sims.len(), qpos, qvel)?;
        for row in qpos.chunks_exact(self.layout().nq.max(1)) {
            let length = |at: usize| row[at..at + 4].iter().map(|x| x * x).sum::<f64>().sqrt();
            if self.quaternions.iter().any(|&at| length(at) < 1e-9) {
                return Err(Error::Shape("a quaternion of the state is zero".into()));
            }
        }
        let set = self.batch.engine().table.set_state;
        self.batch.call("set_state", set, |f, batch, error| {
            // SAFETY: lengths are checked; everything lives until the call returns.
            unsafe {
                f(
                    batch,
                    slices::sims(sims),
                    sims.len() as u64,
                    qpos.as_ptr(),
                    qvel.as_ptr(),
                    error,
                )
            }
        })
    }

    fn rollout(&mut self, rollout: &Rollout<'_>, out: &mut [f64]) -> Result<()> {
        rollout.check(
            self.layout(),
            self.batch_size(),
            self.batch.columns.len(),
            out,
        )?;
        if rollout.substeps == 0 {
            return Err(Error::Shape(
                "a frame needs at least one physics step".into(),
            ));
        }
        if !rollout.forces.is_empty() {
            self.batch
                .require(Capabilities::EXTERNAL_FORCES, "push bodies in a rollout")?;
        }
        if !rollout.changes.is_empty() {
            self.batch.require(
                Capabilities::PARAMETER_CHANGES,
                "change parameters in a rollout",
            )?;
        }
        if rollout.hook.is_some() {
            self.batch.require(
                Capabilities::STEP_HOOKS,
                "call the host before physics steps",
            )?;
        }
        readings::require(&self.batch, rollout.record)?;
        for change in rollout.changes {
            finite("a parameter change", change.values)?;
        }
        let layout = self.batch.model.layout();
        let lengths = [layout.nq, layout.nv, layout.nu()];
        rollout::run(&mut self.batch, rollout, lengths, out)?;
        self.batch.refresh(&mut self.status)?;
        readings::check(
            &self.batch,
            &self.status,
            "rollout",
            rollout.sims,
            rollout.record,
            out,
        )
    }

    fn read(&mut self, sims: &[usize], record: &Recording, out: &mut [f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let width = record.width();
        check_len("output", out.len(), sims.len() * width)?;
        readings::require(&self.batch, record)?;
        let channels = readings::channels(record);
        let read = self.batch.engine().table.read;
        self.batch.call("read", read, |f, batch, error| {
            // SAFETY: lengths are checked; everything lives until the call returns.
            unsafe {
                f(
                    batch,
                    slices::sims(sims),
                    sims.len() as u64,
                    channels.as_ptr(),
                    channels.len() as u64,
                    width as u64,
                    out.as_mut_ptr(),
                    error,
                )
            }
        })?;
        readings::check(&self.batch, &self.status, "read", sims, record, out)
    }

    fn save(&mut self, sims: &[usize]) -> Result<Snapshot> {
        check_sims(sims, self.batch_size())?;
        self.batch
            .require(Capabilities::EXACT_SNAPSHOT, "save states")?;
        let save = self.batch.engine().table.save;
        let mut pointer = std::ptr::null_mut();
        self.batch.call("save", save, |f, batch, error| {
            // SAFETY: indices are checked; everything lives until the call returns.
            unsafe {
                f(
                    batch,
                    slices::sims(sims),
                    sims.len() as u64,
                    &mut pointer,
                    error,
                )
            }
        })?;
        let pointer = NonNull::new(pointer).ok_or_else(|| {
            broken(
                &self.batch.engine().path,
                "save",
                "says that all is well and gives NULL",
            )
        })?;
        let saved = SavedStates {
            model: self.batch.model.clone(),
            pointer,
        };
        Ok(Snapshot::new(saved, sims.len()))
    }

    fn load(&mut self, snapshot: &Snapshot, rows: &[usize], sims: &[usize]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let is_own = |s: &SavedStates| Arc::ptr_eq(&s.model, &self.batch.model);
        let saved = snapshot.restored(rows, sims, is_own)?;
        let restore = self.batch.engine().table.restore;
        self.batch.call("restore", restore, |f, batch, error| {
            // SAFETY: the snapshot is of this model and lives; indices are checked.
            unsafe {
                f(
                    batch,
                    saved.pointer.as_ptr(),
                    slices::sims(rows),
                    slices::sims(sims),
                    sims.len() as u64,
                    error,
                )
            }
        })?;
        self.batch.refresh(&mut self.status)
    }

    fn copy_state(&mut self, from: &[usize], to: &[usize]) -> Result<()> {
        check_copy(from, to, self.batch_size())?;
        let Some(copy) = self.batch.engine().table.copy_state else {
            let mut sources = from.to_vec();
            sources.sort_unstable();
            sources.dedup();
            let rows: Vec<usize> = from
                .iter()
                .map(|s| sources.binary_search(s).unwrap_or(0))
                .collect();
            let snapshot = self.save(&sources)?;
            return self.load(&snapshot, &rows, to);
        };
        self.batch
            .call("copy_state", Some(copy), |f, batch, error| {
                // SAFETY: indices are checked; everything lives until the call returns.
                unsafe {
                    f(
                        batch,
                        slices::sims(from),
                        slices::sims(to),
                        to.len() as u64,
                        error,
                    )
                }
            })?;
        self.batch.refresh(&mut self.status)
    }

    fn status(&self) -> &[Status] {
        &self.status
    }

    fn steps_taken(&self) -> u64 {
        self.batch.steps_taken()
    }
}
