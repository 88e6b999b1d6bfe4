//! Arrays across the ABI: a pointer and a count.

use asid_core::{Error, Result};

// `usize` is the header's `uint64_t`, so lists of simulations are passed without conversion.
const _: () = assert!(size_of::<usize>() == 8);

/// An array of the other side; an empty one may be null.
///
/// # Errors
/// When it is null and should have entries, or has more than memory could hold.
///
/// # Safety
/// `pointer` is null or points to `count` values that live and do not change for as long as the
/// slice is used.
pub unsafe fn read<'a, T>(pointer: *const T, count: u64, what: &str) -> Result<&'a [T]> {
    if count == 0 {
        return Ok(&[]);
    }
    let bytes = count.checked_mul(size_of::<T>() as u64);
    if pointer.is_null() || !pointer.is_aligned() {
        return Err(Error::Shape(format!("{what}: {count} entries at NULL")));
    }
    if bytes.is_none_or(|b| b > isize::MAX as u64) {
        return Err(Error::Shape(format!("{what}: {count} entries")));
    }
    // SAFETY: not null, aligned, of a possible size; the caller promises the rest.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count as usize) })
}

/// As [`read`], for an array that is written.
///
/// # Errors
/// As [`read`].
///
/// # Safety
/// As [`read`], and nobody else uses the values meanwhile.
pub unsafe fn write<'a, T>(pointer: *mut T, count: u64, what: &str) -> Result<&'a mut [T]> {
    // SAFETY: as the caller promises.
    let checked = unsafe { read(pointer.cast_const(), count, what)? };
    if checked.is_empty() {
        return Ok(&mut []);
    }
    // SAFETY: checked above; exclusive as the caller promises.
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer, count as usize) })
}

/// A list of simulations for the other side.
#[must_use]
pub fn sims(sims: &[usize]) -> *const u64 {
    sims.as_ptr().cast()
}
