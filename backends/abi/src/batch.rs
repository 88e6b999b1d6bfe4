//! An engine's batch: its handle, calls of the table on it, and the status of its simulations.

use std::ptr::NonNull;
use std::sync::Arc;

use asid_core::{BatchConfig, Capabilities, Error, Result, Status};

use crate::engine::Checked;
use crate::failure::{broken, decode};
use crate::handle::{ModelHandle, NamedTarget, about, function};
use crate::table::{self, Code};
use crate::text;

/// An engine's handle of a batch, which is destroyed with the value.
pub struct BatchHandle {
    /// The scene of the batch.
    pub model: Arc<ModelHandle>,
    pointer: NonNull<table::Batch>,
    /// The target of each column.
    pub columns: Vec<String>,
    /// The engine's message when it panicked.
    poison: Option<String>,
}

// SAFETY: the header says that a batch may be used from any thread, by one at a time.
unsafe impl Send for BatchHandle {}

impl Drop for BatchHandle {
    fn drop(&mut self) {
        // A batch that panicked may be in any state, so its memory is not freed.
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

impl BatchHandle {
    /// Makes a batch.
    ///
    /// # Errors
    /// [`Error::Config`] for no simulations, [`Error::Parameter`] for a target that is named twice;
    /// the engine's own errors.
    pub fn new(model: Arc<ModelHandle>, config: &BatchConfig) -> Result<Self> {
        if config.size == 0 {
            return Err(Error::Config {
                key: "size".into(),
                message: "a batch needs at least one simulation".into(),
            });
        }
        let mut rest = &config.targets[..];
        while let Some((target, others)) = rest.split_first() {
            if others.contains(target) {
                return Err(Error::Parameter {
                    parameter: target.to_string(),
                    message: "is named twice".into(),
                });
            }
            rest = others;
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
            // SAFETY: everything pointed to lives until the call returns.
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
        Ok(Self {
            columns,
            poison: None,
            pointer,
            model,
        })
    }

    /// The engine.
    pub fn engine(&self) -> &Checked {
        &self.model.engine
    }

    /// Calls a function of the table with this batch, unless the batch is poisoned.
    ///
    /// # Errors
    /// The engine's own, or that the batch panicked before.
    pub fn call<F>(
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

    /// Updates the statuses of all simulations, if some are or were diverged.
    ///
    /// # Errors
    /// When the engine lacks the functions for it.
    pub fn refresh(&self, all: &mut [Status]) -> Result<()> {
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
            all.iter_mut()
                .filter(|s| !s.is_running())
                .for_each(|s| *s = Status::Running);
            return Ok(());
        }
        let get = function(self.engine().table.status, "status", self.engine())?;
        for first in (0..all.len()).step_by(STATUS_CHUNK) {
            let mut chunk = [RUNNING; STATUS_CHUNK];
            let n = STATUS_CHUNK.min(all.len() - first);
            self.engine().action("status").run(|| {
                // SAFETY: `chunk` holds `n` structures; the batch as above.
                unsafe { get(pointer, first as u64, n as u64, chunk.as_mut_ptr()) }
            });
            for (status, said) in all[first..].iter_mut().zip(&chunk[..n]) {
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

    /// Physics steps of all simulations; 0 for a batch that panicked.
    pub fn steps_taken(&self) -> u64 {
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

    /// Checks that the engine claims the capabilities that a call needs.
    ///
    /// # Errors
    /// [`Error::Incapable`], naming what it cannot do and the file.
    pub fn require(&self, needed: Capabilities, what: &str) -> Result<()> {
        if self.engine_capabilities().contains(needed) {
            return Ok(());
        }
        Err(Error::Incapable {
            backend: self.engine_name(),
            what: format!("{what} (plugin {})", self.engine().path.display()),
        })
    }

    fn engine_capabilities(&self) -> Capabilities {
        Capabilities::from_bits_truncate(self.engine().table.capabilities)
    }

    fn engine_name(&self) -> String {
        // SAFETY: checked when the table was.
        unsafe { text::read(self.engine().table.name, "name") }.unwrap_or_default()
    }
}

/// Number of statuses requested at a time.
const STATUS_CHUNK: usize = 64;

const RUNNING: table::Status = table::Status {
    diverged: 0,
    padding: 0,
    time: 0.0,
    message: [0; 256],
};
