//! Loads plugins and registers their parts.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::declaration::{Declaration, SYMBOL};
use crate::entries::accept;
use asid_abi::library::{self, Library};
use asid_core::registry::{self, BackendEntry, Entry as _, Origin, Package};
use asid_core::{Error, Result};

/// A loaded plugin.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Loaded {
    /// Its file, with links resolved.
    pub file: &'static Path,
    /// Its Cargo packages, if it has parts in Rust.
    pub packages: Vec<Package>,
    /// Its parts.
    pub parts: Vec<Part>,
}

/// One part of a plugin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// The kind of part, such as `task`.
    pub kind: &'static str,
    /// Its own name.
    pub own_name: &'static str,
    /// Its registered name, which differs from its own name if that was taken.
    pub name: &'static str,
}

/// Loaded plugins, in order.
static LOADED: Mutex<Vec<Loaded>> = Mutex::new(Vec::new());

/// Loaded plugins, in the order of loading.
#[must_use]
pub fn loaded() -> Vec<Loaded> {
    LOADED
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .clone()
}

/// Loads a plugin and registers its parts; a plugin that is already loaded stays unchanged.
///
/// # Errors
/// [`Error::Plugin`] naming the file, what is wrong with it, and what to do.
pub fn load(path: &Path) -> Result<Loaded> {
    let mut all = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
    let file = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    if let Some(found) = all.iter().find(|l| l.file == file) {
        return Ok(found.clone());
    }
    let new = register(path, file)?;
    all.push(new.clone());
    Ok(new)
}

fn register(path: &Path, file: PathBuf) -> Result<Loaded> {
    let library = library::open(path)?;
    let file: &'static Path = Box::leak(file.into_boxed_path());
    let engine = asid_abi::engine(library, path)?;
    let parts = match declaration(library) {
        // SAFETY: the address is that of the library's constant of this name, and the
        // library is never closed.
        Some(address) => unsafe { accept(address, file) }?,
        None => None,
    };
    if engine.is_none() && parts.is_none() {
        return Err(Error::Plugin {
            path: path.to_owned(),
            message: format!(
                "is a library but no plugin: it exports neither an engine (`{}`) nor parts in Rust (`asid_plugin::export_plugin!()`)",
                asid_abi::table::ENTRY
            ),
        });
    }
    let mut loaded = Loaded {
        file,
        packages: Vec::new(),
        parts: Vec::new(),
    };
    if let Some(registered) = parts {
        loaded.packages = registered.packages;
        let entries = registered.entries.into_iter();
        loaded
            .parts
            .extend(entries.map(|(kind, own_name, name)| Part {
                kind,
                own_name,
                name,
            }));
    }
    if let Some(engine) = engine {
        let own_name: &'static str = engine.name().to_owned().leak();
        let about: &'static str = engine.about().to_owned().leak();
        let name = registry::add(own_name, |name| BackendEntry {
            name,
            about,
            make: Box::leak(Box::new(move || Ok(engine.backend(name)))),
            origin: Origin::Loaded(file),
        })
        .map_err(|e| Error::Plugin {
            path: path.to_owned(),
            message: e.to_string(),
        })?;
        loaded.parts.push(Part {
            kind: BackendEntry::KIND,
            own_name,
            name,
        });
    }
    Ok(loaded)
}

/// Address of the constant of parts in Rust, if a library has it.
fn declaration(library: &'static Library) -> Option<*const Declaration> {
    // SAFETY: the symbol is only used as an address, whatever it refers to.
    let symbol = unsafe { library.get::<*const Declaration>(SYMBOL) }.ok()?;
    // SAFETY: the library is never closed, so the address stays valid.
    let address = unsafe { symbol.try_as_raw_ptr() }?;
    Some(address.cast_const().cast())
}
