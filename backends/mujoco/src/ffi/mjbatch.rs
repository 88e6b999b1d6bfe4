//! `mjbatch.h`, declared by hand: `mujoco-rs` has no batch calls.

use std::ffi::{c_char, c_int, c_void};

use mujoco_rs::mujoco_c::{mjData, mjModel, mjWarningStat};

/// `mjBatch` of `mjbatch.h`, opaque.
#[repr(C)]
pub struct RawBatch {
    _opaque: [u8; 0],
}

/// `mjBatchConfig`.
#[repr(C)]
pub struct BatchConfig {
    /// Threads of the batch.
    pub nthread: c_int,
    /// Whether the threads persist between calls.
    pub persistent: bool,
}

/// `mjfBatch`: the function that runs on each simulation.
pub type BatchFunction = unsafe extern "C" fn(*const mjModel, *mut mjData, c_int, *mut c_void);

unsafe extern "C" {
    pub fn mjb_makeBatch(
        m: *const mjModel,
        nsim: c_int,
        config: *const BatchConfig,
        error: *mut c_char,
        error_sz: c_int,
    ) -> *mut RawBatch;
    pub fn mjb_deleteBatch(b: *mut RawBatch);
    pub fn mjb_nstate(b: *const RawBatch) -> c_int;
    pub fn mjb_state(b: *mut RawBatch) -> *mut f64;
    pub fn mjb_stateComponent(b: *mut RawBatch, component: c_int, size: *mut c_int) -> *mut f64;
    pub fn mjb_warning(b: *mut RawBatch) -> *mut mjWarningStat;
    pub fn mjb_reset(
        b: *mut RawBatch,
        ids: *const c_int,
        nid: c_int,
        key: *const c_int,
        stage: c_int,
    ) -> c_int;
    pub fn mjb_status(b: *const RawBatch) -> *const c_int;
    pub fn mjb_error(b: *const RawBatch, sim: c_int) -> *const c_char;
    pub fn mjb_expand(
        b: *mut RawBatch,
        name: *const c_char,
        size: *mut c_int,
        elemsize: *mut c_int,
    ) -> *mut c_void;
    pub fn mjb_setConst(b: *mut RawBatch, ids: *const c_int, nid: c_int) -> c_int;
    pub fn mjb_apply(
        b: *mut RawBatch,
        ids: *const c_int,
        nid: c_int,
        func: BatchFunction,
        arg: *mut c_void,
        save: c_int,
    ) -> c_int;
}
