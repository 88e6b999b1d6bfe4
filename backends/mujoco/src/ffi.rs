//! The only module that uses MuJoCo's C interface by pointers.
//!
//! `mujoco-rs` has no batch calls, so the `mjb_*` functions of `mjbatch.h` are declared here by
//! hand beside its types. [`Batch`] owns an `mjBatch`; a function given to [`Batch::apply`] sees
//! one simulation at a time as a [`Sim`]. Everything above this module is safe code.
//!
//! Two properties of the C side determine its design. A fatal error inside a batch call unwinds by
//! `longjmp` to the batch, over the frames of the running function. That function must own nothing
//! that needs dropping while it is inside a [`Sim`] method. A fatal error anywhere else ends the
//! process, so Rust checks all arguments first.

mod mjbatch;
mod quiet;
mod sim;

pub use quiet::{disable_autoreset, disable_contacts, silence_log};
pub use sim::{BadNumber, Sim, is_bad};

use std::any::Any;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::ptr::NonNull;
use std::sync::{Mutex, PoisonError};

use mjbatch::{
    BatchConfig, RawBatch, mjb_apply, mjb_deleteBatch, mjb_error, mjb_expand, mjb_makeBatch,
    mjb_nstate, mjb_reset, mjb_setConst, mjb_state, mjb_stateComponent, mjb_status, mjb_warning,
};
use mujoco_rs::mujoco_c::{mjData, mjModel};
use mujoco_rs::wrappers::mj_model::MjModel;

/// Entries of `mjData.warning` (`mjtWarning`).
const WARNINGS: usize = 7;
/// A model field with separate values in each simulation; see [`Batch::expand`].
#[derive(Clone, Copy, Debug)]
pub struct Expanded(usize);

/// An owned `mjBatch`: state rows, model fields and threads of many simulations.
pub struct Batch {
    raw: NonNull<RawBatch>,
    size: usize,
    nstate: usize,
    /// Storage of the expanded fields: first entry, and entries per simulation.
    fields: Vec<(NonNull<f64>, usize)>,
}

// SAFETY: an mjBatch is not bound to a thread: every call sets up the calling thread anew, and
// `&mut self` keeps calls apart.
unsafe impl Send for Batch {}

impl Batch {
    /// Makes a batch from a copy of `model`.
    ///
    /// # Errors
    /// MuJoCo's message when it refuses.
    pub fn new(model: &MjModel, size: usize, threads: usize) -> Result<Self, String> {
        let nsim = c_int::try_from(size).map_err(|_| "too many simulations".to_owned())?;
        let config = BatchConfig {
            nthread: c_int::try_from(threads).unwrap_or(c_int::MAX).max(1),
            persistent: false,
        };
        let mut error = [0 as c_char; 512];
        // SAFETY: the model outlives the call, which copies it; `config` and
        // `error` are valid for it, and `nsim` is checked to be in range.
        let raw = unsafe {
            mjb_makeBatch(
                model.ffi(),
                nsim,
                &raw const config,
                error.as_mut_ptr(),
                error.len() as c_int,
            )
        };
        let Some(raw) = NonNull::new(raw) else {
            // SAFETY: MuJoCo ends the text with NUL within the buffer.
            let text = unsafe { CStr::from_ptr(error.as_ptr()) };
            return Err(text.to_string_lossy().into_owned());
        };
        // SAFETY: `raw` is a live batch.
        let nstate = unsafe { mjb_nstate(raw.as_ptr()) } as usize;
        Ok(Self {
            raw,
            size,
            nstate,
            fields: Vec::new(),
        })
    }

    /// Length of a state row (`mjSTATE_INTEGRATION`).
    #[must_use]
    pub fn nstate(&self) -> usize {
        self.nstate
    }

    /// Range of a state component (one `mjtState` bit) in a state row.
    pub fn component(&mut self, bit: u32) -> Range<usize> {
        let mut len: c_int = 0;
        // SAFETY: a live batch; the address lies within its first state row.
        let start = unsafe {
            let base = mjb_state(self.raw.as_ptr());
            let at = mjb_stateComponent(self.raw.as_ptr(), bit as c_int, &raw mut len);
            if at.is_null() {
                0
            } else {
                at.offset_from(base) as usize
            }
        };
        start..start + len as usize
    }

    /// State row of a simulation.
    pub fn state(&mut self, sim: usize) -> &mut [f64] {
        let width = self.nstate;
        &mut self.states()[sim * width..(sim + 1) * width]
    }

    /// Copies a state row.
    pub fn copy_state(&mut self, from: usize, to: usize) {
        let width = self.nstate;
        self.states()
            .copy_within(from * width..(from + 1) * width, to * width);
    }

    fn states(&mut self) -> &mut [f64] {
        // SAFETY: `size x nstate` doubles that the batch owns, and `&mut self` excludes other
        // access.
        unsafe { sim::slice_mut(mjb_state(self.raw.as_ptr()), self.size * self.nstate) }
    }

    /// Clears the warnings of a simulation.
    pub fn clear_warnings(&mut self, sim: usize) {
        assert!(sim < self.size, "simulation {sim} of {}", self.size);
        // SAFETY: `size x WARNINGS` plain counters; `sim` is in range.
        let counters = unsafe {
            let row = mjb_warning(self.raw.as_ptr()).add(sim * WARNINGS);
            std::slice::from_raw_parts_mut(row, WARNINGS)
        };
        for counter in counters {
            counter.number = 0;
            counter.lastinfo = 0;
        }
    }

    /// Resets simulations to keyframe 0 where `keyframe` is set, else to the model's defaults.
    ///
    /// `ids` are strictly increasing and in range.
    pub fn reset(&mut self, ids: &[c_int], keyframe: bool) {
        self.check(ids);
        let keys = vec![0; if keyframe { ids.len() } else { 0 }];
        let key = if keyframe {
            keys.as_ptr()
        } else {
            std::ptr::null()
        };
        // SAFETY: `ids` are checked; one key per simulation, or none; stage 0 computes nothing. The
        // caller requests keyframe 0 only where there is one.
        unsafe { mjb_reset(self.raw.as_ptr(), ids.as_ptr(), ids.len() as c_int, key, 0) };
    }

    /// Gives a model field of doubles separate values in each simulation, initialised from the
    /// model's.
    ///
    /// # Errors
    /// When there is no such field.
    pub fn expand(&mut self, field: &CStr) -> Result<Expanded, String> {
        let (mut len, mut element): (c_int, c_int) = (0, 0);
        // SAFETY: a live batch and a NUL-terminated name.
        let storage = unsafe {
            mjb_expand(
                self.raw.as_ptr(),
                field.as_ptr(),
                &raw mut len,
                &raw mut element,
            )
        };
        let storage = NonNull::new(storage.cast::<f64>())
            .filter(|_| element as usize == size_of::<f64>())
            .ok_or_else(|| format!("the engine has no field {}", field.to_string_lossy()))?;
        self.fields.push((storage, len as usize));
        Ok(Expanded(self.fields.len() - 1))
    }

    /// Values of an expanded field in a simulation.
    pub fn field(&mut self, field: Expanded, sim: usize) -> &mut [f64] {
        assert!(sim < self.size, "simulation {sim} of {}", self.size);
        let (storage, len) = self.fields[field.0];
        // SAFETY: the storage is `size x len` doubles that the batch owns until it is deleted;
        // `sim` is in range and `&mut self` excludes other access.
        unsafe { std::slice::from_raw_parts_mut(storage.as_ptr().add(sim * len), len) }
    }

    /// Recomputes the constants that depend on changed model fields.
    ///
    /// # Errors
    /// MuJoCo's message of the first simulation it refuses, whose constants stay unchanged.
    pub fn set_const(&mut self, ids: &[c_int]) -> Result<(), String> {
        if ids.is_empty() {
            return Ok(());
        }
        self.check(ids);
        // SAFETY: `ids` are checked.
        let failed = unsafe { mjb_setConst(self.raw.as_ptr(), ids.as_ptr(), ids.len() as c_int) };
        match ids.iter().find_map(|&i| self.failure(i as usize)) {
            Some(message) if failed > 0 => Err(message),
            _ => Ok(()),
        }
    }

    /// The error that a simulation raised in its last call, in one line; `None` without an error.
    #[must_use]
    pub fn failure(&self, sim: usize) -> Option<String> {
        assert!(sim < self.size, "simulation {sim} of {}", self.size);
        // SAFETY: `size` status values; the message is a NUL-terminated text that
        // lives until the next call on the batch, and is copied here.
        unsafe {
            let status = *mjb_status(self.raw.as_ptr()).add(sim);
            (status != 0).then(|| {
                let text = CStr::from_ptr(mjb_error(self.raw.as_ptr(), sim as c_int));
                asid_documents::guard::one_line(&text.to_string_lossy())
            })
        }
    }

    /// Runs `function` on each simulation with its job (`jobs[i]` belongs to `ids[i]`), on all
    /// threads.
    ///
    /// `save` keeps the resulting state. Returns how many simulations raised an error in MuJoCo;
    /// these keep their previous state.
    ///
    /// `function` must own nothing that needs dropping while it calls a method of [`Sim`]. A panic
    /// in it is raised again here.
    pub fn apply<J, F>(&mut self, ids: &[c_int], jobs: &mut [J], function: &F, save: bool) -> usize
    where
        J: Send,
        F: Fn(&mut J, &mut Sim<'_>) + Sync,
    {
        assert_eq!(ids.len(), jobs.len(), "one job a simulation");
        if ids.is_empty() {
            return 0;
        }
        self.check(ids);
        let call = Call {
            function,
            ids,
            jobs: jobs.as_mut_ptr(),
            panic: Mutex::new(None),
        };
        // SAFETY: `ids` are checked; `call` outlives the call, which joins all threads before it
        // returns; `F` is `Sync` and `J` is `Send`, so threads may share the function and take one
        // job each.
        let failed = unsafe {
            mjb_apply(
                self.raw.as_ptr(),
                ids.as_ptr(),
                ids.len() as c_int,
                run::<J, F>,
                (&raw const call).cast_mut().cast(),
                c_int::from(save),
            )
        };
        if let Some(payload) = call
            .panic
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
        {
            resume_unwind(payload);
        }
        failed as usize
    }

    /// Checks ids first, because MuJoCo ends the process over bad ones.
    fn check(&self, ids: &[c_int]) {
        assert!(
            ids.windows(2).all(|w| w[0] < w[1])
                && ids.first().is_none_or(|&i| i >= 0)
                && ids.last().is_none_or(|&i| (i as usize) < self.size),
            "simulations must be strictly increasing and below {}",
            self.size
        );
    }
}

impl Drop for Batch {
    fn drop(&mut self) {
        // SAFETY: made by mjb_makeBatch and deleted only here.
        unsafe { mjb_deleteBatch(self.raw.as_ptr()) };
    }
}

/// Argument of [`run`]: the function, its jobs, and the place for a panic.
struct Call<'a, J, F> {
    function: &'a F,
    ids: &'a [c_int],
    jobs: *mut J,
    panic: Mutex<Option<Box<dyn Any + Send>>>,
}

/// The C function behind [`Batch::apply`].
unsafe extern "C" fn run<J, F>(m: *const mjModel, d: *mut mjData, sim: c_int, arg: *mut c_void)
where
    F: Fn(&mut J, &mut Sim<'_>) + Sync,
{
    // SAFETY: `arg` is the `Call` of [`Batch::apply`], which outlives this call.
    let call = unsafe { &*arg.cast_const().cast::<Call<'_, J, F>>() };
    let Ok(row) = call.ids.binary_search(&sim) else {
        return;
    };
    // SAFETY: there are as many jobs as ids, and each simulation runs once per call, so nobody else
    // has this job.
    let job = unsafe { &mut *call.jobs.add(row) };
    // SAFETY: MuJoCo passes a model and data that belong together, for this call.
    let mut view = unsafe { Sim::new(m, d) };
    let outcome = catch_unwind(AssertUnwindSafe(|| (call.function)(job, &mut view)));
    if let Err(payload) = outcome {
        *call.panic.lock().unwrap_or_else(PoisonError::into_inner) = Some(payload);
    }
}
