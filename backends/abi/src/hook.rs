//! The host's step hook as a C function.
//!
//! A panic in a hook must not unwind through the engine. It is stored, the hook does nothing more,
//! and the panic continues after the rollout has returned.

use std::any::Any;
use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use asid_core::simulator::{StepHook, StepView};

use crate::table;

/// A hook and the lengths of the arrays that it sees.
pub struct HostHook<'a> {
    hook: &'a dyn StepHook,
    lengths: [usize; 3],
    stopped: AtomicBool,
    panic: Mutex<Option<Box<dyn Any + Send>>>,
}

impl<'a> HostHook<'a> {
    /// Wraps a hook for a scene with `nq` positions, `nv` velocities, `nu` commands.
    pub fn new(hook: &'a dyn StepHook, [nq, nv, nu]: [usize; 3]) -> Self {
        Self {
            hook,
            lengths: [nq, nv, nu],
            stopped: AtomicBool::new(false),
            panic: Mutex::new(None),
        }
    }

    /// The context to pass together with [`call`].
    pub fn context(&self) -> *mut c_void {
        std::ptr::from_ref(self).cast_mut().cast()
    }

    /// Resumes the panic of a hook, if there was one.
    pub fn finish(self) {
        let panic = self.panic.into_inner().unwrap_or_else(|e| e.into_inner());
        if let Some(panic) = panic {
            resume_unwind(panic);
        }
    }
}

/// The `asid_step_hook` of every rollout with a hook.
pub unsafe extern "C" fn call(
    context: *mut c_void,
    row: u64,
    step: u64,
    view: *mut table::StepView,
) {
    // SAFETY: the context is the one that was passed with this function, and
    // outlives the rollout; it is only read.
    let host = unsafe { &*context.cast::<HostHook<'_>>() };
    if host.stopped.load(Ordering::Relaxed) {
        return;
    }
    let [nq, nv, nu] = host.lengths;
    // SAFETY: the engine gives arrays of these lengths for the duration of the call; an empty one
    // may be null.
    let mut seen = unsafe {
        let view = &*view;
        let slice = |p: *const f64, n: usize| match n {
            0 => &[][..],
            n => std::slice::from_raw_parts(p, n),
        };
        let slice_mut = |p: *mut f64, n: usize| match n {
            0 => &mut [][..],
            n => std::slice::from_raw_parts_mut(p, n),
        };
        StepView {
            time: view.time,
            qpos: slice(view.qpos, nq),
            qvel: slice(view.qvel, nv),
            ctrl: slice_mut(view.ctrl, nu),
            force: slice_mut(view.force, nv),
            parameters: &mut [],
        }
    };
    let done = catch_unwind(AssertUnwindSafe(|| {
        host.hook
            .before_step(row as usize, step as usize, &mut seen);
    }));
    if let Err(panic) = done {
        host.stopped.store(true, Ordering::Relaxed);
        if let Ok(mut kept) = host.panic.lock() {
            kept.get_or_insert(panic);
        }
    }
}
