//! What a plugin provides, and its registration in this program.

use std::path::Path;

use super::across::Across;
use super::border::{Border, Loaded};
use super::declaration::Declaration;
use super::exported::Entries;
use asid_core::backend::Backend;
use asid_core::error::{Error, Result};
use asid_core::explore::Explorer;
use asid_core::identify::Identifier;
use asid_core::registry::{
    self, AlgorithmEntry, BackendEntry, Entry, Maker, Origin, Package, TaskEntry,
};
use asid_core::solve::TaskSolver;
use asid_core::task::Task;
use asid_effects::EffectEntry;

/// What a plugin registered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Registered {
    /// Its packages.
    pub packages: Vec<Package>,
    /// Kind, own name, and registered name of each entry.
    pub entries: Vec<(&'static str, &'static str, &'static str)>,
}

/// Checks a plugin and registers what it provides; `None` if that is nothing.
///
/// # Errors
/// [`Error::Plugin`] when it was not built like this program, provides nothing, or has an invalid
/// name; [`Error::Failed`] when it panics.
///
/// # Safety
/// `address` is that of the constant [`SYMBOL`](super::SYMBOL) of the library `path`, which is
/// never closed.
pub unsafe fn accept(
    address: *const Declaration,
    path: &'static Path,
) -> Result<Option<Registered>> {
    // SAFETY: as this function's.
    let Some(declaration) = unsafe { Declaration::read(address, path) }? else {
        return Ok(None);
    };
    let plugin: &'static Loaded = Box::leak(Box::new(Loaded {
        path,
        panics: declaration.panics(),
    }));
    (plugin.panics.silence)();
    let border = Border::Inward(plugin);
    let handed = border.try_run(|| Ok(declaration.entries()))?;
    let adder = Adder {
        border,
        origin: Origin::Loaded(path),
    };
    let named = |e: Error| Error::Plugin {
        path: path.to_owned(),
        message: e.to_string(),
    };
    handed.check_names().map_err(&named)?;
    let entries = adder.all(&handed).map_err(named)?;
    if entries.is_empty() {
        return Err(Error::Plugin {
            path: path.to_owned(),
            message: "registers nothing: `register!` is missing in its package".into(),
        });
    }
    Ok(Some(Registered {
        packages: handed.packages,
        entries,
    }))
}

/// Adds entries of a plugin to the registry of this program.
struct Adder {
    border: Border,
    origin: Origin,
}

/// Kind, own name, and registered name of an entry.
type Added = (&'static str, &'static str, &'static str);

impl Adder {
    fn all(&self, entries: &Entries) -> Result<Vec<Added>> {
        let mut added = Vec::new();
        for &e in &entries.backends {
            added.push(self.backend(e)?);
        }
        for &e in &entries.tasks {
            added.push(self.task(e)?);
        }
        for &e in &entries.explorers {
            added.push(self.algorithm(e, |inner, border| {
                Box::new(Across::new(inner, border)) as Box<dyn Explorer>
            })?);
        }
        for &e in &entries.identifiers {
            added.push(self.algorithm(e, |inner, border| {
                Box::new(Across::new(inner, border)) as Box<dyn Identifier>
            })?);
        }
        for &e in &entries.solvers {
            added.push(self.algorithm(e, |inner, border| {
                Box::new(Across::new(inner, border)) as Box<dyn TaskSolver>
            })?);
        }
        for &e in &entries.effects {
            added.push(self.effect(e)?);
        }
        Ok(added)
    }

    fn backend(&self, theirs: &'static BackendEntry) -> Result<Added> {
        let border = self.border;
        let name = registry::add(theirs.name, |name| BackendEntry {
            name,
            about: theirs.about,
            make: maker(move || {
                let inner = border.try_run(|| (theirs.make)())?;
                Ok(Box::new(Across::named(inner, border, name)) as Box<dyn Backend>)
            }),
            origin: self.origin,
        })?;
        Ok((BackendEntry::KIND, theirs.name, name))
    }

    fn task(&self, theirs: &'static TaskEntry) -> Result<Added> {
        let border = self.border;
        let name = registry::add(theirs.name, |name| TaskEntry {
            name,
            about: theirs.about,
            make: maker(move || {
                let inner = border.try_run(|| (theirs.make)())?;
                Ok(Box::new(Across::named(inner, border, name)) as Box<dyn Task>)
            }),
            origin: self.origin,
        })?;
        Ok((TaskEntry::KIND, theirs.name, name))
    }

    fn effect(&self, theirs: &'static EffectEntry) -> Result<Added> {
        let border = self.border;
        let name = registry::add(theirs.name, |name| EffectEntry {
            name,
            about: theirs.about,
            make: Box::leak(Box::new(move || {
                Box::new(Across::new(border.run(|| (theirs.make)()), border)) as Box<_>
            })),
            origin: self.origin,
        })?;
        Ok((EffectEntry::KIND, theirs.name, name))
    }

    fn algorithm<T: ?Sized>(
        &self,
        theirs: &'static AlgorithmEntry<T>,
        wrap: fn(Box<T>, Border) -> Box<T>,
    ) -> Result<Added>
    where
        AlgorithmEntry<T>: Entry,
    {
        let border = self.border;
        let name = registry::add(theirs.name, |name| AlgorithmEntry {
            name,
            about: theirs.about,
            defaults: Box::leak(Box::new(move || border.run(|| (theirs.defaults)()))),
            meanings: Box::leak(Box::new(move || border.run(|| (theirs.meanings)()))),
            make: Box::leak(Box::new(move |settings: &registry::Settings| {
                Ok(wrap(border.try_run(|| (theirs.make)(settings))?, border))
            })),
            origin: self.origin,
        })?;
        Ok((<AlgorithmEntry<T> as Entry>::KIND, theirs.name, name))
    }
}

fn maker<T: ?Sized>(make: impl Fn() -> Result<Box<T>> + Sync + 'static) -> Maker<T> {
    Box::leak(Box::new(make))
}
