//! The other direction: turns a Rust [`Backend`] into a table, and so into a plugin.
//!
//! [`export_backend!`](crate::export_backend) in a `cdylib` crate is all that a plugin needs. The
//! handles of the table are numbers, not addresses. A handle that was destroyed or never created is
//! not found, and the call says so. A panic ends at the table as an error and invalidates the
//! handle.

mod batch;
mod handles;
mod model;
mod rollout;

use std::ffi::{c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};

use asid_core::{Backend, Result};

use crate::failure::encode;
use crate::table::{self, ABI_MAJOR, ABI_MINOR, Code};
use crate::text;

/// Gives a table its engine; [`export_backend!`](crate::export_backend) implements it.
pub trait Export {
    /// The engine, made once.
    ///
    /// # Errors
    /// Why it cannot work on this machine.
    fn backend() -> Result<&'static dyn Backend>;
}

/// Makes an engine the plugin of this library.
///
/// Takes the type of the plugin's own marker and an expression of type
/// `asid_core::Result<impl Backend>`, and a line for `asid list`:
///
/// ```ignore
/// asid_abi::export_backend!("My engine, double precision", MyBackend::new());
/// ```
#[macro_export]
macro_rules! export_backend {
    ($about:literal, $make:expr) => {
        struct Exported;

        impl $crate::export::Export for Exported {
            fn backend() -> $crate::core::Result<&'static dyn $crate::core::Backend> {
                static BACKEND: ::std::sync::OnceLock<
                    ::std::result::Result<
                        ::std::boxed::Box<dyn $crate::core::Backend>,
                        ::std::string::String,
                    >,
                > = ::std::sync::OnceLock::new();
                BACKEND
                    .get_or_init(|| {
                        let made: $crate::core::Result<_> = $make;
                        made.map(|b| ::std::boxed::Box::new(b) as _)
                            .map_err(|e| e.to_string())
                    })
                    .as_deref()
                    .map_err(|e| $crate::core::Error::Failed(e.clone()))
            }
        }

        /// The table of this engine: see `asid_backend.h`.
        // SAFETY: the name is defined by the ABI and reserved for it.
        #[unsafe(no_mangle)]
        pub extern "C" fn asid_backend_entry() -> *const $crate::table::Backend {
            static TABLE: ::std::sync::OnceLock<$crate::table::Backend> =
                ::std::sync::OnceLock::new();
            $crate::export::keep_panics_quiet();
            TABLE.get_or_init(|| $crate::export::table::<Exported>($about))
        }
    };
}

/// The table of an engine. It is made once per library, and what it points to is leaked.
///
/// An engine that cannot be made has a table too: its name is that of the package, and loading a
/// scene reports the reason.
#[must_use]
pub fn table<E: Export>(about: &str) -> table::Backend {
    let (name, version, capabilities) = match E::backend() {
        Ok(b) => {
            let capabilities = b.capabilities() & table::capabilities();
            (b.name().to_owned(), b.version(), capabilities.bits())
        }
        Err(_) => ("unavailable".to_owned(), String::new(), 0),
    };
    let leak = |text: &str| text::owned(text).into_raw().cast_const();
    table::Backend {
        abi_major: ABI_MAJOR,
        abi_minor: ABI_MINOR,
        size: size_of::<table::Backend>() as u64,
        name: leak(&name),
        version: leak(&version),
        about: leak(about),
        capabilities,
        get_extension: Some(no_extension),
        load: Some(model::load::<E>),
        destroy_model: Some(model::destroy),
        layout: Some(model::layout),
        nominal: Some(model::nominal),
        make_batch: Some(model::make_batch),
        destroy_batch: Some(batch::destroy),
        set_parameters: Some(batch::set_parameters),
        reset: Some(batch::reset),
        set_state: Some(batch::set_state),
        rollout: Some(rollout::rollout),
        read: Some(rollout::read),
        save: Some(batch::save),
        restore: Some(batch::restore),
        destroy_snapshot: Some(batch::destroy_snapshot),
        copy_state: Some(batch::copy_state),
        status: Some(batch::status),
        diverged_count: Some(batch::diverged_count),
        steps_taken: Some(batch::steps_taken),
    }
}

unsafe extern "C" fn no_extension(_name: *const c_char) -> *const c_void {
    std::ptr::null()
}

/// Keeps panics of this library off the console, since they reach the host as errors.
/// `RUST_BACKTRACE` restores the messages.
pub fn keep_panics_quiet() {
    if std::env::var_os("RUST_BACKTRACE").is_none() {
        std::panic::set_hook(Box::new(|_| {}));
    }
}

/// Runs the body of a table's function. An error becomes its code and message, a panic
/// [`table::PANIC`].
///
/// # Safety
/// `error` is null or points to a structure that nobody else uses.
unsafe fn guard(error: *mut table::Error, body: impl FnOnce() -> Result<()>) -> Code {
    let mut unread = table::Error::empty();
    // SAFETY: as the caller promises.
    let into = unsafe { error.as_mut() }.unwrap_or(&mut unread);
    match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(())) => table::OK,
        Ok(Err(e)) => encode(&e, into),
        Err(panic) => {
            let said = panic
                .downcast_ref::<String>()
                .map(String::as_str)
                .or_else(|| panic.downcast_ref::<&str>().copied())
                .unwrap_or("without a message");
            text::into_buffer(said, &mut into.message);
            table::PANIC
        }
    }
}
