//! Functions of the table that work on a batch.

use std::ffi::c_void;

use asid_core::layout::{Channel, Layout, Recording};
use asid_core::simulator::{ExternalForce, ParameterChange, StepHook, StepView};
use asid_core::{Control, Error, Result, Rollout, Status};

use super::guard;
use super::handles::{BATCHES, Held, SNAPSHOTS};
use crate::slices;
use crate::table::{self, Code, channel_kind};
use crate::text;

/// `destroy_batch`.
pub unsafe extern "C" fn destroy(batch: *mut table::Batch) {
    let body = || {
        drop(BATCHES.remove(batch));
        Ok(())
    };
    // SAFETY: no error is written.
    unsafe { guard(std::ptr::null_mut(), body) };
}

/// Indices of simulations or rows.
///
/// # Safety
/// As [`slices::read`].
unsafe fn indices<'a>(list: *const u64, count: u64) -> Result<&'a [usize]> {
    // SAFETY: as the caller promises; the two types have one size (see `slices`).
    unsafe { slices::read(list.cast::<usize>(), count, "the simulations") }
}

/// `count` rows of `width` numbers: how many there are.
fn numbers(count: u64, width: usize) -> Result<u64> {
    count
        .checked_mul(width as u64)
        .ok_or_else(|| Error::Shape(format!("{count} rows of {width} values")))
}

/// `set_parameters`.
pub unsafe extern "C" fn set_parameters(
    batch: *mut table::Batch,
    sims: *const u64,
    count: u64,
    values: *const f64,
    error: *mut table::Error,
) -> Code {
    let body = || {
        let held = Held::new(batch)?;
        let n = numbers(count, held.entry().columns)?;
        // SAFETY: the host passes `count` indices and that many rows.
        let (sims, values) = unsafe {
            (
                indices(sims, count)?,
                slices::read(values, n, "parameters")?,
            )
        };
        held.run(|s| s.set_parameters(sims, values))
    };
    // SAFETY: the host's error structure.
    unsafe { guard(error, body) }
}

/// `reset`.
pub unsafe extern "C" fn reset(
    batch: *mut table::Batch,
    sims: *const u64,
    count: u64,
    error: *mut table::Error,
) -> Code {
    let body = || {
        // SAFETY: the host passes `count` indices.
        let sims = unsafe { indices(sims, count)? };
        Held::new(batch)?.run(|s| s.reset(sims))
    };
    // SAFETY: the host's error structure.
    unsafe { guard(error, body) }
}

/// `set_state`.
pub unsafe extern "C" fn set_state(
    batch: *mut table::Batch,
    sims: *const u64,
    count: u64,
    qpos: *const f64,
    qvel: *const f64,
    error: *mut table::Error,
) -> Code {
    let body = || {
        let held = Held::new(batch)?;
        let layout = &held.entry().layout;
        let (nq, nv) = (numbers(count, layout.nq)?, numbers(count, layout.nv)?);
        // SAFETY: the host passes `count` indices and that many rows.
        let (sims, qpos, qvel) = unsafe {
            (
                indices(sims, count)?,
                slices::read(qpos, nq, "qpos")?,
                slices::read(qvel, nv, "qvel")?,
            )
        };
        held.run(|s| s.set_state(sims, qpos, qvel))
    };
    // SAFETY: the host's error structure.
    unsafe { guard(error, body) }
}

/// A recording from channels of the other side, which must be as wide as it says.
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

/// The host's hook as this side calls it.
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
        // SAFETY: the arrays have the scene's lengths, as the header asks, and
        // live until the call returns.
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

/// `save`.
pub unsafe extern "C" fn save(
    batch: *mut table::Batch,
    sims: *const u64,
    count: u64,
    snapshot: *mut *mut table::Snapshot,
    error: *mut table::Error,
) -> Code {
    let body = || {
        // SAFETY: the host passes `count` indices and a place for the handle.
        let (sims, place) = unsafe { (indices(sims, count)?, &mut *snapshot) };
        let saved = Held::new(batch)?.run(|s| s.save(sims))?;
        *place = SNAPSHOTS.insert(saved);
        Ok(())
    };
    // SAFETY: the host's error structure.
    unsafe { guard(error, body) }
}

/// `restore`.
pub unsafe extern "C" fn restore(
    batch: *mut table::Batch,
    snapshot: *const table::Snapshot,
    rows: *const u64,
    sims: *const u64,
    count: u64,
    error: *mut table::Error,
) -> Code {
    let body = || {
        let saved = SNAPSHOTS.get(snapshot)?;
        // SAFETY: the host passes `count` indices of each.
        let (rows, sims) = unsafe { (indices(rows, count)?, indices(sims, count)?) };
        Held::new(batch)?.run(|s| s.load(&saved, rows, sims))
    };
    // SAFETY: the host's error structure.
    unsafe { guard(error, body) }
}

/// `destroy_snapshot`.
pub unsafe extern "C" fn destroy_snapshot(snapshot: *mut table::Snapshot) {
    let body = || {
        drop(SNAPSHOTS.remove(snapshot));
        Ok(())
    };
    // SAFETY: no error is written.
    unsafe { guard(std::ptr::null_mut(), body) };
}

/// `copy_state`.
pub unsafe extern "C" fn copy_state(
    batch: *mut table::Batch,
    from: *const u64,
    to: *const u64,
    count: u64,
    error: *mut table::Error,
) -> Code {
    let body = || {
        // SAFETY: the host passes `count` indices of each.
        let (from, to) = unsafe { (indices(from, count)?, indices(to, count)?) };
        Held::new(batch)?.run(|s| s.copy_state(from, to))
    };
    // SAFETY: the host's error structure.
    unsafe { guard(error, body) }
}

/// `status`. Simulations that do not exist, and those of a batch that has
/// panicked, are said to have diverged.
pub unsafe extern "C" fn status(
    batch: *const table::Batch,
    first: u64,
    count: u64,
    out: *mut table::Status,
) {
    let body = || {
        // SAFETY: the host passes room for `count` structures.
        let out = unsafe { slices::write(out, count, "the statuses")? };
        let lost = Status::Diverged {
            time: f64::NAN,
            message: "the batch is gone".into(),
        };
        let first = usize::try_from(first).unwrap_or(usize::MAX);
        let known = Held::new(batch)
            .and_then(|held| held.run(|s| Ok(s.status().to_vec())))
            .unwrap_or_default();
        for (i, place) in out.iter_mut().enumerate() {
            write_status(
                first
                    .checked_add(i)
                    .and_then(|n| known.get(n))
                    .unwrap_or(&lost),
                place,
            );
        }
        Ok(())
    };
    // SAFETY: no error is written.
    unsafe { guard(std::ptr::null_mut(), body) };
}

fn write_status(status: &Status, place: &mut table::Status) {
    let (diverged, time, message) = match status {
        Status::Running => (0, 0.0, ""),
        Status::Diverged { time, message } => (1, *time, message.as_str()),
    };
    place.diverged = diverged;
    place.padding = 0;
    place.time = time;
    text::into_buffer(message, &mut place.message);
}

/// `diverged_count`.
pub unsafe extern "C" fn diverged_count(batch: *const table::Batch) -> u64 {
    let count =
        |held: Held| held.run(|s| Ok(s.status().iter().filter(|s| !s.is_running()).count() as u64));
    Held::new(batch).and_then(count).unwrap_or(1)
}

/// `steps_taken`.
pub unsafe extern "C" fn steps_taken(batch: *const table::Batch) -> u64 {
    Held::new(batch)
        .and_then(|held| held.run(|s| Ok(s.steps_taken())))
        .unwrap_or(0)
}
