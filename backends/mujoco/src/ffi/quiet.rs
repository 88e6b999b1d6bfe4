//! Turns off MuJoCo's default actions: it writes to the console, restarts simulations, and searches
//! for impossible contacts.

use std::ffi::c_int;
use std::sync::Once;

use mujoco_rs::mujoco_c::{mjLogMessage, mjtDisableBit, mju_setLogHandler};
use mujoco_rs::wrappers::mj_model::MjModel;

/// Routes MuJoCo's messages away from the console and from `MUJOCO_LOG.TXT` in the working
/// directory.
///
/// Warnings are dropped, since the counters of each simulation record them. A fatal error outside a
/// batch aborts with its text, as the C library cannot return from one.
pub fn silence_log() {
    static ONCE: Once = Once::new();
    unsafe extern "C" fn handler(message: *const mjLogMessage) {
        // SAFETY: MuJoCo passes a message that lives for this call.
        let Some(message) = (unsafe { message.as_ref() }) else {
            return;
        };
        assert!(
            message.level() != mujoco_rs::mujoco_c::mjtLogLevel::mjLOG_ERROR,
            "MuJoCo stopped: {}",
            message.subject()
        );
    }
    ONCE.call_once(|| {
        // SAFETY: the handler is a plain function that lives as long as the program.
        unsafe { mju_setLogHandler(Some(handler)) };
    });
}

/// Turns off the silent restart of a simulation whose state is bad.
pub fn disable_autoreset(model: &mut MjModel) {
    // SAFETY: a flag of the options; no size or index table is touched.
    let raw = unsafe { model.ffi_mut() };
    raw.opt.disableflags |= mjtDisableBit::mjDSBL_AUTORESET as c_int;
}

/// Turns off contact detection of a model that can make no contact.
pub fn disable_contacts(model: &mut MjModel) {
    // SAFETY: as in `disable_autoreset`.
    let raw = unsafe { model.ffi_mut() };
    raw.opt.disableflags |= mjtDisableBit::mjDSBL_CONTACT as c_int;
}
