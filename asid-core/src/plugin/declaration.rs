//! What a plugin exports: one constant, which says what it is before anything is called.

use std::ffi::{CStr, c_char};
use std::path::Path;

use super::entries::Entries;
use super::fingerprint::{self, PROBES, Probe};
use super::panics::{self, Panics};
use crate::error::{Error, Result};

/// Name of the exported constant.
pub const SYMBOL: &str = "asid_rust_plugin";

/// How the constant begins.
const MAGIC: [u8; 8] = *b"ASIDRUST";

/// A plugin's statement of what it is; [`export_plugin!`](crate::export_plugin) makes it.
///
/// The first three fields have the same place in every version, and are all that is read
/// before the fingerprints were compared.
#[repr(C)]
pub struct Declaration {
    magic: [u8; 8],
    size: usize,
    fingerprint: *const c_char,
    probes: *const Probe,
    probe_count: usize,
    package: &'static str,
    version: &'static str,
    packages: &'static [&'static str],
    panics: Panics,
    entries: fn(&[&str]) -> Entries,
}

// SAFETY: the pointers are to constants of the library, which is never closed.
unsafe impl Sync for Declaration {}

impl Declaration {
    /// That of a package, handing over what it and other `packages` register.
    #[doc(hidden)]
    #[must_use]
    pub const fn new(
        package: &'static str,
        version: &'static str,
        packages: &'static [&'static str],
    ) -> Self {
        Self {
            magic: MAGIC,
            size: size_of::<Self>(),
            fingerprint: fingerprint::TEXT.as_ptr().cast(),
            probes: PROBES.as_ptr(),
            probe_count: PROBES.len(),
            package,
            version,
            packages,
            panics: panics::OWN,
            entries: Entries::of,
        }
    }

    /// Reads the constant of a library, after checking that it can be read.
    ///
    /// # Errors
    /// [`Error::Plugin`] saying what differs from this program, and what to do.
    ///
    /// # Safety
    /// `address` is that of the constant [`SYMBOL`] of a library that stays open: at least
    /// three words, of which the second tells how many bytes there are, and the third is null
    /// or points to a text ended by a zero.
    pub(super) unsafe fn read(address: *const Self, path: &Path) -> Result<&'static Self> {
        let refuse = |message: String| Error::Plugin {
            path: path.to_owned(),
            message,
        };
        if address.is_null() || !address.is_aligned() {
            return Err(refuse(format!("its `{SYMBOL}` is at no valid address")));
        }
        // SAFETY: three words are there; `addr_of!` makes no reference to the rest.
        let (magic, size, text) = unsafe {
            (
                (&raw const (*address).magic).read(),
                (&raw const (*address).size).read(),
                (&raw const (*address).fingerprint).read(),
            )
        };
        if magic != MAGIC {
            return Err(refuse(format!(
                "its `{SYMBOL}` is not made by `asid_core::export_plugin!`"
            )));
        }
        let needed = size_of::<Self>();
        if size < std::mem::offset_of!(Self, probes) || text.is_null() {
            return Err(refuse(format!(
                "its `{SYMBOL}` is cut off: {size} bytes where {needed} are needed; rebuild the plugin"
            )));
        }
        // SAFETY: it is a text ended by a zero.
        let theirs = unsafe { CStr::from_ptr(text) }.to_string_lossy();
        if let Some(difference) = fingerprint::difference(&theirs) {
            return Err(refuse(difference));
        }
        if size < needed {
            return Err(refuse(format!(
                "its `{SYMBOL}` is cut off: {size} bytes where {needed} are needed; rebuild the plugin"
            )));
        }
        // SAFETY: all of it is there, and the same compiler made it from the same sources.
        let (probes, count) = unsafe { ((*address).probes, (*address).probe_count) };
        // SAFETY: as above; these are the parts of a constant slice.
        let probes = unsafe { std::slice::from_raw_parts(probes, count) };
        if let Some(difference) = fingerprint::other_layout(probes) {
            return Err(refuse(difference));
        }
        // SAFETY: as above, and the library is never closed.
        Ok(unsafe { &*address })
    }

    /// Name and version of the plugin's package.
    pub(super) fn package(&self) -> (&'static str, &'static str) {
        (self.package, self.version)
    }

    /// Panics of the plugin's copy of the standard library.
    pub(super) fn panics(&self) -> Panics {
        self.panics
    }

    /// What it registers, its panics being caught by the caller.
    pub(super) fn entries(&self) -> Entries {
        (self.entries)(self.packages)
    }
}

/// Makes a shared library of the crate a plugin, which `asid --plugin FILE` loads.
///
/// It is written once, in a crate of the type `cdylib`, and hands over what the crate's
/// own package registers; further packages that are linked in are named:
/// `export_plugin!("my-tasks", "my-effects")`.
///
/// A program can have the exported constant once: where a program links two such crates,
/// put the line behind a feature of each.
#[macro_export]
macro_rules! export_plugin {
    ($($package:literal),* $(,)?) => {
        #[cfg(panic = "abort")]
        compile_error!("a plugin needs `panic = \"unwind\"` in its profile: its panics are caught");

        /// What `asid --plugin` looks for.
        #[allow(unsafe_code, non_upper_case_globals, missing_docs)]
        #[unsafe(no_mangle)]
        pub static asid_rust_plugin: $crate::plugin::Declaration = $crate::plugin::Declaration::new(
            env!("CARGO_PKG_NAME"),
            env!("CARGO_PKG_VERSION"),
            &[env!("CARGO_PKG_NAME"), $($package),*],
        );
    };
}
