//! Finds backends, tasks, explorers, identifiers and solvers by name.
//!
//! What is linked in registers itself through [`inventory`]: one
//! `inventory::submit!` in the author's crate, no list to edit. Lists come out
//! sorted by name, so that nothing depends on the order of linking.

use crate::backend::Backend;
use crate::effect::Effect;
use crate::error::{Error, Result};
use crate::explore::Explorer;
use crate::identify::Identifier;
use crate::solve::TaskSolver;
use crate::task::Task;

/// A backend that is linked in.
pub struct BackendEntry {
    /// Name on the command line.
    pub name: &'static str,
    /// One line for `asid list`.
    pub about: &'static str,
    /// Makes it; an error says why it is missing on this machine.
    pub make: fn() -> Result<Box<dyn Backend>>,
}

/// A task that is linked in.
pub struct TaskEntry {
    /// Name on the command line.
    pub name: &'static str,
    /// One line for `asid list`.
    pub about: &'static str,
    /// Makes it.
    pub make: fn() -> Result<Box<dyn Task>>,
}

/// An effect that is linked in.
pub struct EffectEntry {
    /// Name on the command line.
    pub name: &'static str,
    /// One line for `asid list`.
    pub about: &'static str,
    /// Makes it.
    pub make: fn() -> Box<dyn Effect>,
}

/// Settings of an algorithm, as in a configuration file.
pub type Settings = toml::Table;

/// An algorithm that is linked in; `T` is the trait it implements.
pub struct AlgorithmEntry<T: ?Sized + 'static> {
    /// Name on the command line.
    pub name: &'static str,
    /// One line for `asid list`.
    pub about: &'static str,
    /// All its settings with their defaults.
    pub defaults: fn() -> Settings,
    /// Makes it; settings that are left out take their defaults.
    pub make: fn(&Settings) -> Result<Box<T>>,
}

/// An explorer that is linked in.
pub type ExplorerEntry = AlgorithmEntry<dyn Explorer>;
/// An identifier that is linked in.
pub type IdentifierEntry = AlgorithmEntry<dyn Identifier>;
/// A solver that is linked in.
pub type SolverEntry = AlgorithmEntry<dyn TaskSolver>;

inventory::collect!(BackendEntry);
inventory::collect!(TaskEntry);
inventory::collect!(EffectEntry);
inventory::collect!(ExplorerEntry);
inventory::collect!(IdentifierEntry);
inventory::collect!(SolverEntry);

/// Something with a name that registers itself.
pub trait Entry: inventory::Collect + 'static {
    /// What kind of thing it is, in error messages.
    const KIND: &'static str;
    /// Name on the command line.
    fn name(&self) -> &'static str;
    /// One line for `asid list`.
    fn about(&self) -> &'static str;
}

macro_rules! entry {
    ($type:ty, $kind:literal) => {
        impl Entry for $type {
            const KIND: &'static str = $kind;
            fn name(&self) -> &'static str {
                self.name
            }
            fn about(&self) -> &'static str {
                self.about
            }
        }
    };
}

entry!(BackendEntry, "backend");
entry!(TaskEntry, "task");
entry!(EffectEntry, "effect");
entry!(ExplorerEntry, "explorer");
entry!(IdentifierEntry, "identifier");
entry!(SolverEntry, "solver");

/// Everything registered under a type of entry, sorted by name.
#[must_use]
pub fn all<E: Entry>() -> Vec<&'static E> {
    let mut entries: Vec<&E> = inventory::iter::<E>().collect();
    entries.sort_by_key(|e| e.name());
    entries
}

/// The entry of this name.
///
/// # Errors
/// When there is none; the message lists near names.
pub fn find<E: Entry>(name: &str) -> Result<&'static E> {
    let entries = all::<E>();
    entries
        .iter()
        .copied()
        .find(|e| e.name() == name)
        .ok_or_else(|| Error::unknown(E::KIND, name, entries.iter().map(|e| e.name())))
}

/// Reads an algorithm's settings; unknown keys, wrong types and numbers that are
/// not finite are errors.
///
/// # Errors
/// [`Error::Config`] naming `section` and the key.
pub fn settings<S: serde::de::DeserializeOwned>(section: &str, table: &Settings) -> Result<S> {
    check_finite(section, table)?;
    S::deserialize(toml::Value::Table(table.clone())).map_err(|e| Error::Config {
        key: section.to_owned(),
        message: crate::scene::one_line(e.message()),
    })
}

fn check_finite(section: &str, table: &Settings) -> Result<()> {
    for (key, value) in table {
        let key = format!("{section}.{key}");
        match value {
            toml::Value::Table(inner) => check_finite(&key, inner)?,
            toml::Value::Float(x) if !x.is_finite() => {
                return Err(Error::Config {
                    key,
                    message: format!("{value} is not a finite number"),
                });
            }
            _ => {}
        }
    }
    Ok(())
}

/// The default settings of an algorithm as a table.
#[must_use]
pub fn defaults<S: Default + serde::Serialize>() -> Settings {
    toml::Table::try_from(S::default()).unwrap_or_default()
}
