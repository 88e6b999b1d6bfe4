//! Functions of the table that work on a batch.

use asid_core::{Error, Result, Status};

use super::guard;
use super::handles::{BATCHES, Held, SNAPSHOTS};
use crate::slices;
use crate::table::{self, Code};
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
pub(super) unsafe fn indices<'a>(list: *const u64, count: u64) -> Result<&'a [usize]> {
    // SAFETY: as the caller promises; the two types have one size (see `slices`).
    unsafe { slices::read(list.cast::<usize>(), count, "the simulations") }
}

/// Total of numbers in `count` rows of `width` numbers.
pub(super) fn numbers(count: u64, width: usize) -> Result<u64> {
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

/// `status`. Simulations that do not exist, and those of a batch that panicked, are reported as
/// diverged.
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
        let end = first.saturating_add(out.len());
        let asked = |all: &[Status]| all[first.min(all.len())..end.min(all.len())].to_vec();
        let known = Held::new(batch)
            .and_then(|held| held.run(|s| Ok(asked(s.status()))))
            .unwrap_or_default();
        for (i, place) in out.iter_mut().enumerate() {
            write_status(known.get(i).unwrap_or(&lost), place);
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
