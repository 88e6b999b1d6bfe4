//! Finds backends, tasks, explorers, identifiers and solvers by name. Other crates add further
//! kinds, such as effects: types that implement [`Entry`].
//!
//! Linked-in parts register themselves: one [`register!`](crate::register) in the author's crate,
//! with no list to edit. Parts loaded at run time are [`add`]ed. Lists are sorted by name, so that
//! nothing depends on the order of linking.

use std::sync::{PoisonError, RwLock};

use crate::backend::{Backend, Capabilities};
use crate::error::{Error, Result};
use crate::explore::Explorer;
use crate::identify::Identifier;
use crate::solve::TaskSolver;
use crate::task::Task;

mod origin;
mod register;

pub use crate::settings::{Meanings, Settings, defaults, meanings, settings, unexplained};
pub use origin::{Origin, Package};

/// A backend.
pub struct BackendEntry {
    /// Name on the command line.
    pub name: &'static str,
    /// One-line description for `asid list`.
    pub about: &'static str,
    /// Constructor; its error says why the backend is missing on this machine.
    pub make: Maker<dyn Backend>,
    /// Its origin.
    pub origin: Origin,
}

/// A task.
pub struct TaskEntry {
    /// Name on the command line.
    pub name: &'static str,
    /// One-line description for `asid list`.
    pub about: &'static str,
    /// Constructor.
    pub make: Maker<dyn Task>,
    /// Its origin.
    pub origin: Origin,
}

/// Makes an object that implements `T`; a closure for parts loaded at run time.
pub type Maker<T> = &'static (dyn Fn() -> Result<Box<T>> + Sync);

/// An algorithm; `T` is the trait it implements.
pub struct AlgorithmEntry<T: ?Sized + 'static> {
    /// Name on the command line.
    pub name: &'static str,
    /// One-line description for `asid list`.
    pub about: &'static str,
    /// All its settings with their defaults.
    pub defaults: &'static (dyn Fn() -> Settings + Sync),
    /// Meanings of its settings, for `asid config`.
    pub meanings: &'static (dyn Fn() -> Meanings + Sync),
    /// Constructor; omitted settings take their defaults.
    pub make: &'static (dyn Fn(&Settings) -> Result<Box<T>> + Sync),
    /// Its origin.
    pub origin: Origin,
}

/// An explorer.
pub type ExplorerEntry = AlgorithmEntry<dyn Explorer>;
/// An identifier.
pub type IdentifierEntry = AlgorithmEntry<dyn Identifier>;
/// A solver.
pub type SolverEntry = AlgorithmEntry<dyn TaskSolver>;

/// Something with a name that can be registered.
pub trait Entry: inventory::Collect + Sync + Sized + 'static {
    /// The kind of entry, in error messages.
    const KIND: &'static str;
    /// Name on the command line.
    fn name(&self) -> &'static str;
    /// One-line description for `asid list`.
    fn about(&self) -> &'static str;
    /// Its origin.
    fn origin(&self) -> Origin;
    /// Entries that were added at run time.
    #[doc(hidden)]
    fn added() -> &'static RwLock<Vec<&'static Self>>;
}

/// Makes a type with the fields `name`, `about` and `origin` an [`Entry`].
#[doc(hidden)]
#[macro_export]
macro_rules! __entry {
    ($type:ty, $kind:literal) => {
        $crate::__inventory::collect!($type);

        impl $crate::registry::Entry for $type {
            const KIND: &'static str = $kind;
            fn name(&self) -> &'static str {
                self.name
            }
            fn about(&self) -> &'static str {
                self.about
            }
            fn origin(&self) -> $crate::registry::Origin {
                self.origin
            }
            fn added() -> &'static std::sync::RwLock<Vec<&'static Self>> {
                static ADDED: std::sync::RwLock<Vec<&'static $type>> =
                    std::sync::RwLock::new(Vec::new());
                &ADDED
            }
        }
    };
}

__entry!(BackendEntry, "backend");
__entry!(TaskEntry, "task");
__entry!(ExplorerEntry, "explorer");
__entry!(IdentifierEntry, "identifier");
__entry!(SolverEntry, "solver");

/// All entries of a type, sorted by name.
#[must_use]
pub fn all<E: Entry>() -> Vec<&'static E> {
    let mut entries: Vec<&E> = inventory::iter::<E>().collect();
    let added = E::added().read().unwrap_or_else(PoisonError::into_inner);
    entries.extend(added.iter().copied());
    entries.sort_by_key(|e| e.name());
    entries
}

/// The default engine: the first built-in one with single precision, else the first.
///
/// Single precision has the cheapest steps, and a search takes very many.
#[must_use]
pub fn default_backend() -> Option<&'static BackendEntry> {
    let engines = all::<BackendEntry>();
    let is_quick = |entry: &&&BackendEntry| {
        matches!(entry.origin, Origin::Linked(_))
            && (entry.make)()
                .is_ok_and(|e| !e.capabilities().contains(Capabilities::DOUBLE_PRECISION))
    };
    engines.iter().find(is_quick).or(engines.first()).copied()
}

/// Adds an entry for the rest of the process, and returns the name that it got.
///
/// The name is `own`, or if that is taken `OWN@plugin`, `OWN@plugin2`, …, so that linked-in and
/// loaded parts can be used side by side. `build` gets the name.
///
/// # Errors
/// [`Error::Config`] when `own` does not consist of letters, digits, `-`, `_` and `.`.
pub fn add<E: Entry>(own: &str, build: impl FnOnce(&'static str) -> E) -> Result<&'static str> {
    check_name::<E>(own)?;
    let mut added = E::added().write().unwrap_or_else(PoisonError::into_inner);
    let taken = |name: &str| {
        inventory::iter::<E>().any(|e| e.name() == name) || added.iter().any(|e| e.name() == name)
    };
    let name: &'static str = Box::leak(free_name(own, taken).into_boxed_str());
    added.push(Box::leak(Box::new(build(name))));
    Ok(name)
}

/// Checks that a name can be added.
///
/// # Errors
/// As those of [`add`].
pub fn check_name<E: Entry>(own: &str) -> Result<()> {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    if !own.is_empty() && own.chars().all(plain) {
        return Ok(());
    }
    Err(Error::Config {
        key: format!("{} name", E::KIND),
        message: format!("`{own}` is not made of letters, digits, `-`, `_` and `.`"),
    })
}

/// `name`, or its first variant that is not taken.
fn free_name(name: &str, taken: impl Fn(&str) -> bool) -> String {
    let variants =
        std::iter::once(format!("{name}@plugin")).chain((2..).map(|n| format!("{name}@plugin{n}")));
    std::iter::once(name.to_owned())
        .chain(variants)
        .find(|n| !taken(n))
        .unwrap_or_default()
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

#[cfg(test)]
mod tests {
    use super::*;

    fn add_engine(name: &str) -> Result<&'static str> {
        add(name, |name| BackendEntry {
            name,
            about: "",
            make: &|| Err(Error::Failed("not made".into())),
            origin: Origin::Loaded(std::path::Path::new("libengine.so")),
        })
    }

    #[test]
    fn a_name_that_is_taken_gets_a_suffix_and_the_list_stays_sorted() {
        let names: Vec<_> = (0..3).map(|_| add_engine("test-engine").unwrap()).collect();
        assert_eq!(
            names,
            ["test-engine", "test-engine@plugin", "test-engine@plugin2"]
        );
        add_engine("a-test-engine").unwrap();
        let all: Vec<_> = all::<BackendEntry>().iter().map(|e| e.name).collect();
        assert!(all.is_sorted(), "{all:?}");
        assert!(find::<BackendEntry>("test-engine@plugin2").is_ok());
    }

    #[test]
    fn a_name_that_no_command_line_could_hold_is_refused() {
        for name in ["", "my engine", "a@b", "a:b", "a\nb"] {
            assert!(add_engine(name).is_err(), "{name:?}");
        }
    }
}
