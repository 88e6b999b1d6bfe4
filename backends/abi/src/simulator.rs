//! An engine's batch as a [`Simulator`].
//!
//! Everything that a caller could get wrong is checked here, before the engine
//! is called: lengths, indices, numbers that are not finite, snapshots of other
//! scenes. An engine behind the table may rely on it. What the engine gets wrong
//! is caught as far as it can be seen from outside: a reading that is not a
//! number although the simulation is said to run, and a call that reports a
//! panic, after which the batch is not called again.

use std::ptr::NonNull;
use std::sync::Arc;

use asid_core::layout::{Channel, JointKind, Layout, Recording};
use asid_core::simulator::check_sims;
use asid_core::{
    BatchConfig, Capabilities, Control, Error, Result, Rollout, Simulator, Snapshot, Status,
};

use crate::adapter::{ModelHandle, NamedTarget, about, function};
use crate::engine::Checked;
use crate::failure::{broken, decode};
use crate::hook::{self, HostHook};
use crate::slices;
use crate::table::{self, Code, channel_kind};
use crate::text;

/// A batch of an engine of a plugin.
pub struct LoadedSimulator {
    model: Arc<ModelHandle>,
    pointer: NonNull<table::Batch>,
    /// What each column sets.
    columns: Vec<String>,
    status: Vec<Status>,
    /// First entry of `qpos` of each quaternion.
    quaternions: Vec<usize>,
    /// What the engine said when it panicked.
    poison: Option<String>,
}

// SAFETY: the header says that a batch may be used from any thread, by one at a time.
unsafe impl Send for LoadedSimulator {}

impl Drop for LoadedSimulator {
    fn drop(&mut self) {
        // A batch that panicked may be in any state; its memory is left alone.
        if self.poison.is_none()
            && let Some(destroy) = self.model.engine.table.destroy_batch
        {
            self.model.engine.action("destroy_batch").run(|| {
                // SAFETY: made by `make_batch`, destroyed here only.
                unsafe { destroy(self.pointer.as_ptr()) }
            });
        }
    }
}

/// A snapshot of the engine with the model that it is of.
struct SavedStates {
    model: Arc<ModelHandle>,
    pointer: NonNull<table::Snapshot>,
}

// SAFETY: a snapshot is only read once it is made, as the header says, by any thread.
unsafe impl Send for SavedStates {}
// SAFETY: as above, and by several at once.
unsafe impl Sync for SavedStates {}

impl Drop for SavedStates {
    fn drop(&mut self) {
        if let Some(destroy) = self.model.engine.table.destroy_snapshot {
            self.model.engine.action("destroy_snapshot").run(|| {
                // SAFETY: made by `save`, destroyed here only, used by nobody.
                unsafe { destroy(self.pointer.as_ptr()) }
            });
        }
    }
}

impl LoadedSimulator {
    /// Makes a batch.
    ///
    /// # Errors
    /// [`Error::Config`] for no simulations; the engine's own errors.
    pub fn new(model: Arc<ModelHandle>, config: &BatchConfig) -> Result<Self> {
        if config.size == 0 {
            return Err(Error::Config {
                key: "size".into(),
                message: "a batch needs at least one simulation".into(),
            });
        }
        let engine = &model.engine;
        let columns: Vec<String> = config.targets.iter().map(ToString::to_string).collect();
        let named: Vec<NamedTarget> = config
            .targets
            .iter()
            .map(|t| NamedTarget::new(t, &model))
            .collect();
        let targets: Vec<table::Target> = named.iter().map(NamedTarget::table).collect();
        let settings = table::BatchConfig {
            size: size_of::<table::BatchConfig>() as u64,
            batch_size: config.size as u64,
            threads: config.threads as u64,
            target_count: targets.len() as u64,
            targets: targets.as_ptr(),
        };
        let make = function(engine.table.make_batch, "make_batch", engine)?;
        let mut pointer = std::ptr::null_mut();
        let mut error = table::Error::empty();
        let code = engine.action("make_batch").run(|| {
            // SAFETY: all that is pointed to lives until the call returns.
            unsafe { make(model.pointer(), &settings, &mut pointer, &mut error) }
        });
        let asked = match code {
            table::PARAMETER => columns.join(", "),
            _ => String::new(),
        };
        let about = about(code, engine, &asked);
        decode(code, &error, "make_batch", &about, &engine.path)?;
        let pointer = NonNull::new(pointer).ok_or_else(|| {
            broken(
                &engine.path,
                "make_batch",
                "says that all is well and gives NULL",
            )
        })?;
        let quaternions = model
            .layout()
            .joints
            .iter()
            .filter_map(|j| match j.kind {
                JointKind::Free => Some(j.qpos + 3),
                JointKind::Ball => Some(j.qpos),
                JointKind::Hinge | JointKind::Slide => None,
            })
            .collect();
        Ok(Self {
            columns,
            status: vec![Status::Running; config.size],
            quaternions,
            poison: None,
            pointer,
            model,
        })
    }

    fn engine(&self) -> &Checked {
        &self.model.engine
    }

    /// Calls a function of the table with this batch, unless the batch is poisoned.
    fn call<F>(
        &mut self,
        name: &str,
        f: Option<F>,
        run: impl FnOnce(F, *mut table::Batch, *mut table::Error) -> Code,
    ) -> Result<()> {
        let path = &self.model.engine.path;
        if let Some(said) = &self.poison {
            return Err(broken(
                path,
                name,
                &format!("not called, for the engine panicked before: {said}"),
            ));
        }
        let f = function(f, name, &self.model.engine)?;
        let mut error = table::Error::empty();
        let code = self
            .model
            .engine
            .action(name)
            .run(|| run(f, self.pointer.as_ptr(), &mut error));
        if code == table::PANIC {
            self.poison = Some(text::from_buffer(&error.message));
        }
        let subject = match code {
            table::INCAPABLE => self.engine_name(),
            table::PARAMETER => self.columns.join(", "),
            _ => String::new(),
        };
        decode(code, &error, name, &subject, path)
    }

    /// Asks for the statuses of all simulations where some have diverged, or had.
    fn refresh(&mut self) -> Result<()> {
        let pointer = self.pointer.as_ptr();
        let count = function(
            self.engine().table.diverged_count,
            "diverged_count",
            self.engine(),
        )?;
        let diverged = self.engine().action("diverged_count").run(|| {
            // SAFETY: the batch lives and is used by this thread only.
            unsafe { count(pointer) }
        });
        if diverged == 0 {
            self.status
                .iter_mut()
                .filter(|s| !s.is_running())
                .for_each(|s| *s = Status::Running);
            return Ok(());
        }
        let get = function(self.engine().table.status, "status", self.engine())?;
        for first in (0..self.status.len()).step_by(STATUS_CHUNK) {
            let mut chunk = [RUNNING; STATUS_CHUNK];
            let n = STATUS_CHUNK.min(self.status.len() - first);
            self.engine().action("status").run(|| {
                // SAFETY: `chunk` holds `n` structures; the batch as above.
                unsafe { get(pointer, first as u64, n as u64, chunk.as_mut_ptr()) }
            });
            for (status, said) in self.status[first..].iter_mut().zip(&chunk[..n]) {
                *status = if said.diverged == 0 {
                    Status::Running
                } else {
                    Status::Diverged {
                        time: said.time,
                        message: text::from_buffer(&said.message),
                    }
                };
            }
        }
        Ok(())
    }

    /// Sees to it that readings of running simulations are numbers.
    fn check_readings(
        &self,
        call: &str,
        sims: &[usize],
        record: &Recording,
        out: &[f64],
    ) -> Result<()> {
        let width = record.width();
        if width == 0 || sims.is_empty() {
            return Ok(());
        }
        let length = out.len() / sims.len();
        for (&sim, rows) in sims.iter().zip(out.chunks_exact(length.max(1))) {
            if !self.status[sim].is_running() {
                continue;
            }
            if let Some(at) = rows.iter().position(|x| !x.is_finite()) {
                let entry = at % width;
                let names = self.model.layout();
                let channel = (0..record.channels().len())
                    .find(|&i| record.range(i).contains(&entry))
                    .map(|i| describe(record.channels()[i], names))
                    .unwrap_or_default();
                return Err(broken(
                    &self.engine().path,
                    call,
                    &format!(
                        "reads {} for {channel} of simulation {sim} in frame {}, which it says is running",
                        rows[at],
                        at / width
                    ),
                ));
            }
        }
        Ok(())
    }

    fn require(&self, needed: Capabilities, what: &str) -> Result<()> {
        if self.engine_capabilities().contains(needed) {
            return Ok(());
        }
        Err(Error::Incapable {
            backend: self.engine_name(),
            what: format!("{what} (plugin {})", self.engine().path.display()),
        })
    }

    /// Sees to it that an engine is asked for contact forces only where it has them.
    fn require_readings(&self, record: &Recording) -> Result<()> {
        let is_contact = |c: &Channel| matches!(c, Channel::ContactForce { .. });
        match record.channels().iter().any(is_contact) {
            true => self.require(Capabilities::CONTACT_FORCES, "record contact forces"),
            false => Ok(()),
        }
    }

    fn engine_capabilities(&self) -> Capabilities {
        Capabilities::from_bits_truncate(self.engine().table.capabilities)
    }

    fn engine_name(&self) -> String {
        // SAFETY: checked when the table was.
        unsafe { text::read(self.engine().table.name, "name") }.unwrap_or_default()
    }
}

/// Statuses asked for at a time.
const STATUS_CHUNK: usize = 64;

const RUNNING: table::Status = table::Status {
    diverged: 0,
    padding: 0,
    time: 0.0,
    message: [0; 256],
};

/// Name of a channel for messages.
fn describe(channel: Channel, layout: &Layout) -> String {
    match channel {
        Channel::Sensor { index } => format!("sensor `{}`", layout.sensors[index].name),
        Channel::Position { start, .. } => format!("position {start}"),
        Channel::Velocity { start, .. } => format!("velocity {start}"),
        Channel::ContactForce { bodies: [a, b] } => {
            format!("contact.{}/{}", layout.bodies[a], layout.bodies[b])
        }
    }
}

/// Channels as the header has them.
fn channels(record: &Recording) -> Vec<table::Channel> {
    let channel = |kind, a: usize, b: usize| table::Channel {
        kind,
        padding: 0,
        a: a as u64,
        b: b as u64,
    };
    record
        .channels()
        .iter()
        .map(|c| match *c {
            Channel::Sensor { index } => channel(channel_kind::SENSOR, index, 0),
            Channel::Position { start, len } => channel(channel_kind::QPOS, start, len),
            Channel::Velocity { start, len } => channel(channel_kind::QVEL, start, len),
            Channel::ContactForce { bodies: [a, b] } => channel(channel_kind::CONTACT, a, b),
        })
        .collect()
}

fn expect(what: &str, have: usize, want: usize) -> Result<()> {
    if have == want {
        return Ok(());
    }
    Err(Error::Shape(format!(
        "{what} has {have} values where {want} are needed"
    )))
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
        self.model.layout()
    }

    fn batch_size(&self) -> usize {
        self.status.len()
    }

    fn set_parameters(&mut self, sims: &[usize], values: &[f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        expect("parameters", values.len(), sims.len() * self.columns.len())?;
        finite("parameters", values)?;
        let set = self.engine().table.set_parameters;
        self.call("set_parameters", set, |f, batch, error| {
            // SAFETY: lengths are checked; all lives until the call returns.
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
        let reset = self.engine().table.reset;
        self.call("reset", reset, |f, batch, error| {
            // SAFETY: indices are checked; all lives until the call returns.
            unsafe { f(batch, slices::sims(sims), sims.len() as u64, error) }
        })?;
        self.refresh()
    }

    fn set_state(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let (nq, nv) = (self.layout().nq, self.layout().nv);
        expect("qpos", qpos.len(), sims.len() * nq)?;
        expect("qvel", qvel.len(), sims.len() * nv)?;
        finite("qpos", qpos)?;
        finite("qvel", qvel)?;
        for row in qpos.chunks_exact(nq.max(1)) {
            let length = |at: usize| row[at..at + 4].iter().map(|x| x * x).sum::<f64>().sqrt();
            if self.quaternions.iter().any(|&at| length(at) < 1e-9) {
                return Err(Error::Shape("a quaternion of the state is zero".into()));
            }
        }
        let set = self.engine().table.set_state;
        self.call("set_state", set, |f, batch, error| {
            // SAFETY: lengths are checked; all lives until the call returns.
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
        rollout.check(self.layout(), self.batch_size(), self.columns.len(), out)?;
        if rollout.substeps == 0 {
            return Err(Error::Shape(
                "a frame needs at least one physics step".into(),
            ));
        }
        if !rollout.forces.is_empty() {
            self.require(Capabilities::EXTERNAL_FORCES, "push bodies in a rollout")?;
        }
        if !rollout.changes.is_empty() {
            self.require(
                Capabilities::PARAMETER_CHANGES,
                "change parameters in a rollout",
            )?;
        }
        if rollout.hook.is_some() {
            self.require(
                Capabilities::STEP_HOOKS,
                "call the host before physics steps",
            )?;
        }
        self.require_readings(rollout.record)?;
        for change in rollout.changes {
            finite("a parameter change", change.values)?;
        }
        let forces: Vec<table::Force> = rollout
            .forces
            .iter()
            .map(|f| table::Force {
                body: f.body as u64,
                wrench: f.wrench.as_ptr(),
            })
            .collect();
        let changes: Vec<table::Change> = rollout
            .changes
            .iter()
            .map(|c| table::Change {
                frame: c.frame as u64,
                column: c.column as u64,
                values: c.values.as_ptr(),
            })
            .collect();
        let channels = channels(rollout.record);
        let layout = self.layout();
        let lengths = [layout.nq, layout.nv, layout.nu()];
        let host = rollout.hook.map(|h| HostHook::new(h, lengths));
        let (control, shared) = match rollout.control {
            Control::Shared(c) => (c, 1),
            Control::PerSimulation(c) => (c, 0),
        };
        let theirs = table::Rollout {
            size: size_of::<table::Rollout>() as u64,
            count: rollout.sims.len() as u64,
            sims: slices::sims(rollout.sims),
            frames: rollout.frames as u64,
            substeps: rollout.substeps as u64,
            control: control.as_ptr(),
            shared_control: shared,
            padding: 0,
            force_count: forces.len() as u64,
            forces: forces.as_ptr(),
            change_count: changes.len() as u64,
            changes: changes.as_ptr(),
            hook: host.as_ref().map(|_| hook::call as table::StepHook),
            hook_context: host
                .as_ref()
                .map_or(std::ptr::null_mut(), HostHook::context),
            channel_count: channels.len() as u64,
            channels: channels.as_ptr(),
            width: rollout.record.width() as u64,
        };
        let run = self.engine().table.rollout;
        let done = self.call("rollout", run, |f, batch, error| {
            // SAFETY: lengths are checked; all lives until the call returns.
            unsafe { f(batch, &theirs, out.as_mut_ptr(), error) }
        });
        if let Some(host) = host {
            host.finish();
        }
        done?;
        self.refresh()?;
        self.check_readings("rollout", rollout.sims, rollout.record, out)
    }

    fn read(&mut self, sims: &[usize], record: &Recording, out: &mut [f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let width = record.width();
        expect("output", out.len(), sims.len() * width)?;
        self.require_readings(record)?;
        let channels = channels(record);
        let read = self.engine().table.read;
        self.call("read", read, |f, batch, error| {
            // SAFETY: lengths are checked; all lives until the call returns.
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
        self.check_readings("read", sims, record, out)
    }

    fn save(&mut self, sims: &[usize]) -> Result<Snapshot> {
        check_sims(sims, self.batch_size())?;
        self.require(Capabilities::EXACT_SNAPSHOT, "save states")?;
        let save = self.engine().table.save;
        let mut pointer = std::ptr::null_mut();
        self.call("save", save, |f, batch, error| {
            // SAFETY: indices are checked; all lives until the call returns.
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
                &self.engine().path,
                "save",
                "says that all is well and gives NULL",
            )
        })?;
        let saved = SavedStates {
            model: self.model.clone(),
            pointer,
        };
        Ok(Snapshot::new(saved, sims.len()))
    }

    fn load(&mut self, snapshot: &Snapshot, rows: &[usize], sims: &[usize]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        expect("rows", rows.len(), sims.len())?;
        let saved = snapshot
            .data::<SavedStates>()
            .filter(|s| Arc::ptr_eq(&s.model, &self.model))
            .ok_or_else(|| Error::Shape("the snapshot is of another scene".into()))?;
        if let Some(row) = rows.iter().find(|&&r| r >= snapshot.rows()) {
            return Err(Error::Shape(format!(
                "row {row} of a snapshot with {} rows",
                snapshot.rows()
            )));
        }
        let restore = self.engine().table.restore;
        self.call("restore", restore, |f, batch, error| {
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
        self.refresh()
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
        let Some(copy) = self.engine().table.copy_state else {
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
        self.call("copy_state", Some(copy), |f, batch, error| {
            // SAFETY: indices are checked; all lives until the call returns.
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
        self.refresh()
    }

    fn status(&self) -> &[Status] {
        &self.status
    }

    fn steps_taken(&self) -> u64 {
        match self.engine().table.steps_taken {
            Some(count) if self.poison.is_none() => {
                self.engine().action("steps_taken").run(|| {
                    // SAFETY: the batch lives and is used by this thread only.
                    unsafe { count(self.pointer.as_ptr()) }
                })
            }
            _ => 0,
        }
    }
}
