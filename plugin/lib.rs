//! Plugins: shared libraries that are found, checked and loaded at run time.
//!
//! A plugin exports an engine (the C ABI, `asid_backend.h`), parts in Rust ([`export_plugin!`]), or
//! both. It is opened once and stays open until the process ends. Its parts are found in
//! [`asid_core::registry`] like built-in ones. [`load`] takes one file; [`search`] says where files
//! are searched.
//!
//! # Parts in Rust
//!
//! Tasks, algorithms and effects are passed as trait objects. Such a library holds its own copy of
//! ASID's crates and of the standard library, and passes the objects as they are. This is sound
//! only if both sides were built alike. The library therefore states its compiler and sources, the
//! fingerprint, and nothing of it is called before that is compared.
//!
//! Two copies of the standard library cannot catch each other's panics: a panic that reached a
//! `catch_unwind` of the other side would end the process. Every object that crosses is therefore
//! wrapped (module `across`). A call is made inside the `catch_unwind` of the side that owns the
//! object, and a caught panic is raised again on the calling side. A panic of a plugin becomes an
//! error that names its file, or a panic with that text if the method returns no error.
//!
//! What this cannot prevent: a plugin that ends the process, overflows its stack, or uses another
//! global allocator than the system's.
//!
//! A plugin sees its own registry, pool of rayon threads and thread-local state:
//! [`registry::find`](asid_core::registry::find) finds there only what the plugin registers.

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
