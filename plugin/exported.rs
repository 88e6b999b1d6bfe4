//! What the packages of a shared library provide.

use asid_core::error::Result;
use asid_core::registry::{
    self, BackendEntry, Entry, ExplorerEntry, IdentifierEntry, Origin, Package, SolverEntry,
    TaskEntry,
};
use asid_effects::EffectEntry;

/// Entries of a plugin's own registry.
pub struct Entries {
    pub packages: Vec<Package>,
    pub backends: Vec<&'static BackendEntry>,
    pub tasks: Vec<&'static TaskEntry>,
    pub explorers: Vec<&'static ExplorerEntry>,
    pub identifiers: Vec<&'static IdentifierEntry>,
    pub solvers: Vec<&'static SolverEntry>,
    pub effects: Vec<&'static EffectEntry>,
}

impl Entries {
    /// What the exported packages register, in this code's copy of the crate.
    pub fn exported() -> Self {
        fn of<E: Entry>(packages: &[Package]) -> Vec<&'static E> {
            let ours = |e: &&E| matches!(e.origin(), Origin::Linked(p) if packages.contains(&p));
            registry::all::<E>().into_iter().filter(ours).collect()
        }
        let mut packages: Vec<Package> = inventory::iter::<Exported>().map(|e| e.0).collect();
        packages.sort_by_key(|p| p.name);
        let packages = &packages;
        Self {
            backends: of(packages),
            tasks: of(packages),
            explorers: of(packages),
            identifiers: of(packages),
            solvers: of(packages),
            effects: of(packages),
            packages: packages.clone(),
        }
    }

    /// Checks all names before the first one is used.
    pub fn check_names(&self) -> Result<()> {
        fn check<E: Entry>(entries: &[&'static E]) -> Result<()> {
            let mut names = entries.iter().map(|e| e.name());
            names.try_for_each(registry::check_name::<E>)
        }
        check(&self.backends)?;
        check(&self.tasks)?;
        check(&self.explorers)?;
        check(&self.identifiers)?;
        check(&self.solvers)?;
        check(&self.effects)
    }
}

/// A package that provides its parts when it is in a shared library.
#[doc(hidden)]
pub struct Exported(pub Package);

inventory::collect!(Exported);

/// Number of packages that provide parts.
pub extern "C" fn exported() -> usize {
    inventory::iter::<Exported>().count()
}
