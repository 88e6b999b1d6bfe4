//! Tasks, algorithms and effects in a shared library of Rust, loaded at run time.
//!
//! Such a library holds its own copy of this crate and of the standard library, and
//! hands over trait objects as they are. That is sound only where both sides were
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
//! sees are its own: [`registry::find`](crate::registry::find) finds there what the
//! plugin registers and nothing else.

#![allow(unsafe_code)]

mod across;
mod border;
mod declaration;
mod entries;
mod fingerprint;
mod panics;

pub use border::blames_a_plugin;
pub use declaration::{Declaration, Exported, SYMBOL};
pub use entries::{Registered, accept};
