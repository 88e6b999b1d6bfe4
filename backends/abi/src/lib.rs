//! The C ABI of engines: shared libraries that are loaded at run time.
//!
//! An engine plugin exports one function, which returns a table of functions. Its author sees only
//! the header `include/asid_backend.h`; [`table`] is the same in Rust. There are two directions:
//!
//! - **in**: [`library::open`] opens a library, [`engine`](engine()) checks its table, and
//!   [`Engine::backend`] turns it into a backend like the built-in ones. The adapter checks
//!   everything that a caller could get wrong before it calls the engine. It keeps models alive as
//!   long as their batches and snapshots, and words the engine's errors.
//! - **out**: [`export_backend!`] turns a Rust engine into such a library; panics and invalid
//!   handles end at the table.
//!
//! All `unsafe` code of the project that is not an engine's own is in this crate.

mod adapter;
mod batch;
mod crash;
mod engine;
pub mod export;
mod failure;
mod handle;
mod hook;
mod layout;
pub mod library;
mod readings;
mod rollout;
mod simulator;
mod slices;
mod snapshot;
pub mod table;
mod text;
pub mod world;

pub use asid_core as core;
pub use engine::{Engine, engine};

use std::path::Path;

use asid_core::{Error, Result};

/// Opens a library and loads its engine.
///
/// # Errors
/// [`Error::Plugin`] when the file is not a library, exports no engine, or exports one that this
/// host cannot use.
pub fn open_engine(path: &Path) -> Result<Engine> {
    engine(library::open(path)?, path)?.ok_or_else(|| Error::Plugin {
        path: path.to_path_buf(),
        message: format!("exports no engine (no symbol `{}`)", table::ENTRY),
    })
}
