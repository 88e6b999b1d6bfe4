//! Functions of the table that record: rollouts and readings.

use std::ffi::c_void;

use asid_core::layout::{Channel, Layout, Recording};
use asid_core::simulator::{ExternalForce, ParameterChange, StepHook, StepView};
use asid_core::{Control, Error, Result, Rollout};

use super::batch::{indices, numbers};
use super::guard;
use super::handles::Held;
use crate::slices;
use crate::table::{self, Code, channel_kind};

/// A recording from channels of the other side, whose width must match the stated one.
///
/// # Safety
/// As [`slices::read`].
unsafe fn recording(
    layout: &Layout,
    list: *const table::Channel,
    count: u64,
    width: u64,
) -> Result<Recording> {
    // SAFETY: as the caller promises.
    let channels = unsafe { slices::read(list, count, "the channels")? }
        .iter()
        .map(|c| {
            let number = |n: u64| usize::try_from(n).unwrap_or(usize::MAX);
            let (a, b) = (number(c.a), number(c.b));
            Ok(match c.kind {
                channel_kind::SENSOR => Channel::Sensor { index: a },
                channel_kind::QPOS => Channel::Position { start: a, len: b },
                channel_kind::QVEL => Channel::Velocity { start: a, len: b },
                channel_kind::CONTACT => Channel::ContactForce { bodies: [a, b] },
                other => return Err(Error::Shape(format!("a channel is of kind {other}"))),
            })
        })
        .collect::<Result<Vec<_>>>()?;
    let recording = Recording::of(layout, &channels)?;
    if recording.width() as u64 != width {
        return Err(Error::Shape(format!(
            "a row of the channels has {} entries, not {width}",
            recording.width()
        )));
    }
    Ok(recording)
}

/// The host's hook, as called by this side.
struct ForeignHook {
    call: table::StepHook,
    context: *mut c_void,
}

// SAFETY: the header lets the hook be called from several threads at once.
unsafe impl Sync for ForeignHook {}

impl StepHook for ForeignHook {
    fn before_step(&self, row: usize, step: usize, view: &mut StepView<'_>) {
        let mut theirs = table::StepView {
            time: view.time,
            qpos: view.qpos.as_ptr(),
            qvel: view.qvel.as_ptr(),
            ctrl: view.ctrl.as_mut_ptr(),
            force: view.force.as_mut_ptr(),
        };
        // SAFETY: the arrays have the scene's lengths, as the header requires, and live until the
        // call returns.
        unsafe { (self.call)(self.context, row as u64, step as u64, &mut theirs) }
    }
}

/// `rollout`.
pub unsafe extern "C" fn rollout(
    batch: *mut table::Batch,
    rollout: *const table::Rollout,
    out: *mut f64,
    error: *mut table::Error,
) -> Code {
    let body = || {
        let held = Held::new(batch)?;
        let layout = &held.entry().layout;
        // SAFETY: the host passes a rollout as the header describes it, whose
        // arrays have the lengths that follow from its counts.
        unsafe {
            let r = &*rollout;
            let sims = indices(r.sims, r.count)?;
            let frames = usize::try_from(r.frames).unwrap_or(usize::MAX);
            let rows = numbers(r.count, frames)?;
            let nu = layout.nu();
            let control = match r.shared_control {
                0 => {
                    Control::PerSimulation(slices::read(r.control, numbers(rows, nu)?, "control")?)
                }
                _ => Control::Shared(slices::read(r.control, numbers(r.frames, nu)?, "control")?),
            };
            let forces = slices::read(r.forces, r.force_count, "the forces")?
                .iter()
                .map(|f| {
                    Ok(ExternalForce {
                        body: usize::try_from(f.body).unwrap_or(usize::MAX),
                        wrench: slices::read(f.wrench, numbers(rows, 6)?, "a wrench")?,
                    })
                })
                .collect::<Result<Vec<_>>>()?;
            let changes = slices::read(r.changes, r.change_count, "the changes")?
                .iter()
                .map(|c| {
                    Ok(ParameterChange {
                        frame: usize::try_from(c.frame).unwrap_or(usize::MAX),
                        column: usize::try_from(c.column).unwrap_or(usize::MAX),
                        values: slices::read(c.values, r.count, "a change's values")?,
                    })
                })
                .collect::<Result<Vec<_>>>()?;
            let record = recording(layout, r.channels, r.channel_count, r.width)?;
            let hook = r.hook.map(|call| ForeignHook {
                call,
                context: r.hook_context,
            });
            let ours = Rollout {
                sims,
                frames,
                substeps: usize::try_from(r.substeps).unwrap_or(usize::MAX),
                control,
                forces: &forces,
                changes: &changes,
                hook: hook.as_ref().map(|h| h as &dyn StepHook),
                record: &record,
            };
            let out = slices::write(out, numbers(rows, record.width())?, "output")?;
            held.run(|s| s.rollout(&ours, out))
        }
    };
    // SAFETY: the host's error structure.
    unsafe { guard(error, body) }
}

/// `read`.
#[allow(clippy::too_many_arguments, reason = "the header has them")]
pub unsafe extern "C" fn read(
    batch: *mut table::Batch,
    sims: *const u64,
    count: u64,
    channels: *const table::Channel,
    channel_count: u64,
    width: u64,
    out: *mut f64,
    error: *mut table::Error,
) -> Code {
    let body = || {
        let held = Held::new(batch)?;
        // SAFETY: the host passes arrays of these lengths.
        let (sims, record, out) = unsafe {
            let record = recording(&held.entry().layout, channels, channel_count, width)?;
            let n = numbers(count, record.width())?;
            (
                indices(sims, count)?,
                record,
                slices::write(out, n, "output")?,
            )
        };
        held.run(|s| s.read(sims, &record, out))
    };
    // SAFETY: the host's error structure.
    unsafe { guard(error, body) }
}
