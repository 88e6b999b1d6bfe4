//! What a plugin exports: one constant, which describes it before anything of it is used.

use std::ffi::{CStr, c_char};
use std::mem::offset_of;
use std::path::Path;

use super::exported::{Entries, exported};
use super::fingerprint::{self, PROBES, Probe};
use super::panics::{self, Panics};
use asid_core::error::{Error, Result};

/// Name of the exported constant.
pub const SYMBOL: &str = "asid_rust_plugin";

/// First bytes of the constant.
const MAGIC: [u8; 8] = *b"ASIDRUST";

/// The compiler and sources of a shared library in Rust, and what it provides.
///
/// The first four fields have the same offsets in every version. Only these are read before the
/// fingerprints are compared.
#[repr(C)]
pub struct Declaration {
    magic: [u8; 8],
    size: usize,
    fingerprint: *const c_char,
    exported: extern "C" fn() -> usize,
    probes: *const Probe,
    probe_count: usize,
    panics: Panics,
    entries: fn() -> Entries,
}

// SAFETY: the pointers are to constants of the library, which is never closed.
unsafe impl Sync for Declaration {}

/// The constant. Every shared library that contains this crate has it exactly once, however many
/// packages with parts are linked into it.
#[unsafe(no_mangle)]
#[allow(non_upper_case_globals)]
pub static asid_rust_plugin: Declaration = Declaration {
    magic: MAGIC,
    size: size_of::<Declaration>(),
    fingerprint: fingerprint::TEXT.as_ptr().cast(),
    exported,
    probes: PROBES.as_ptr(),
    probe_count: PROBES.len(),
    panics: panics::OWN,
    entries: Entries::exported,
};

impl Declaration {
    /// Reads the constant of a library, after checking that it can be read.
    ///
    /// `None` if no package in the library provides anything, as in an engine that is written in
    /// Rust.
    ///
    /// # Errors
    /// [`Error::Plugin`] saying what differs from this program, and what to do.
    ///
    /// # Safety
    /// `address` is that of the constant [`SYMBOL`] of a library that stays open. It has at least
    /// four words: the second is its number of bytes, the third is null or points to a
    /// zero-terminated text, and the fourth is a function.
    pub(super) unsafe fn read(address: *const Self, path: &Path) -> Result<Option<&'static Self>> {
        let refuse = |message: String| Error::Plugin {
            path: path.to_owned(),
            message,
        };
        if address.is_null() || !address.is_aligned() {
            return Err(refuse(format!("its `{SYMBOL}` is at no valid address")));
        }
        // SAFETY: these words exist; `addr_of!` makes no reference to the rest.
        let (magic, size, text) = unsafe {
            (
                (&raw const (*address).magic).read(),
                (&raw const (*address).size).read(),
                (&raw const (*address).fingerprint).read(),
            )
        };
        if magic != MAGIC {
            return Err(refuse(format!("its `{SYMBOL}` is not that of asid")));
        }
        let needed = size_of::<Self>();
        if size < offset_of!(Self, probes) || text.is_null() {
            return Err(refuse(format!(
                "its `{SYMBOL}` is cut off: {size} bytes where {needed} are needed; rebuild the plugin"
            )));
        }
        // SAFETY: it exists, and is a function of the C ABI in every version.
        let exported = unsafe { (&raw const (*address).exported).read() };
        if exported() == 0 {
            return Ok(None);
        }
        // SAFETY: it is a zero-terminated text.
        let theirs = unsafe { CStr::from_ptr(text) }.to_string_lossy();
        if let Some(difference) = fingerprint::difference(&theirs) {
            return Err(refuse(difference));
        }
        if size < needed {
            return Err(refuse(format!(
                "its `{SYMBOL}` is cut off: {size} bytes where {needed} are needed; rebuild the plugin"
            )));
        }
        // SAFETY: all of it exists, and the same compiler made it from the same sources.
        let (probes, count) = unsafe { ((*address).probes, (*address).probe_count) };
        // SAFETY: as above; these are the parts of a constant slice.
        let probes = unsafe { std::slice::from_raw_parts(probes, count) };
        if let Some(difference) = fingerprint::other_layout(probes) {
            return Err(refuse(difference));
        }
        // SAFETY: as above, and the library is never closed.
        Ok(Some(unsafe { &*address }))
    }

    /// Panics of the plugin's copy of the standard library.
    pub(super) fn panics(&self) -> Panics {
        self.panics
    }

    /// What it registers; the caller catches its panics.
    pub(super) fn entries(&self) -> Entries {
        (self.entries)()
    }
}

/// Provides what the package registers, if it is in a shared library that `asid --plugin FILE`
/// loads.
///
/// It is written once in a crate. The library is of type `cdylib`, made from the crate itself or
/// from another that links it. In a program it does nothing.
#[macro_export]
macro_rules! export_plugin {
    () => {
        #[cfg(panic = "abort")]
        compile_error!("a plugin needs `panic = \"unwind\"` in its profile: its panics are caught");

        $crate::__inventory::submit! {
            $crate::Exported($crate::Package {
                name: env!("CARGO_PKG_NAME"),
                version: env!("CARGO_PKG_VERSION"),
            })
        }
    };
}
