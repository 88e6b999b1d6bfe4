//! Plugins: shared libraries that are found, checked and loaded at run time.
//!
//! A plugin exports an engine (the C ABI, `asid_backend.h`), parts in Rust ([`export_plugin!`]), or
//! both. It is opened once, stays open until the process ends, and what it brings is found in
//! [`asid_core::registry`] like what is built in. [`load`] takes one file; [`search`] says where
//! files are looked for.
//!
//! # Parts in Rust
//!
//! Tasks, algorithms and effects are handed over as trait objects. Such a library holds its own copy
//! of ASID's crates and of the standard library, and
//! hands the objects over as they are. That is sound only where both sides were
//! built alike, so the library says what it was built by and from, and nothing of it
//! is called before that was compared: the fingerprint.
//!
//! Two copies of the standard library cannot catch each other's panics: one that
//! reached a `catch_unwind` of the other side would end the process. Every object
//! that crosses is therefore wrapped (module `across`): a call is made inside the
//! `catch_unwind` of the side that the object belongs to, and what was caught is
//! raised anew on the side that called. A panic of a plugin becomes an error that
//! names its file, or where a method returns no error a panic with that text.
//!
//! What this cannot guard against: a plugin that ends the process, overflows its
//! stack, or brings another global allocator than the system's.
//!
//! The registry, the pool of rayon's threads and the thread-local state that a plugin
//! sees are its own: [`registry::find`](asid_core::registry::find) finds there what the
//! plugin registers and nothing else.

mod across;
mod border;
mod declaration;
mod entries;
mod exported;
mod fingerprint;
mod load;
mod panics;
pub mod search;

#[doc(hidden)]
pub use asid_core::registry::Package;
#[doc(hidden)]
pub use exported::Exported;
pub use load::{Loaded, Part, load, loaded};

#[doc(hidden)]
pub use inventory as __inventory;
