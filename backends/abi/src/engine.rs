//! A checked table: the engine of a plugin, before any scene is loaded.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use asid_core::{Capabilities, Error, Result};

use crate::crash::Action;
use crate::library::Library;
use crate::table::{self, ABI_MAJOR, ABI_MINOR, ENTRY};
use crate::text;

/// Bytes of the table's head, which holds the versions and the size.
const HEAD: usize = 16;

/// Longest name of an engine.
const LONGEST_NAME: usize = 64;

/// The engine of a plugin.
#[derive(Clone)]
pub struct Engine {
    inner: Arc<Checked>,
}

/// A checked table and its origin.
pub struct Checked {
    /// The host's own copy; functions that the plugin does not know are absent.
    pub table: table::Backend,
    /// File of the plugin, for messages.
    pub path: PathBuf,
    name: String,
    version: String,
    about: String,
    capabilities: Capabilities,
    /// Crash notes for calls of a function, by its name.
    actions: Vec<(&'static str, Action)>,
}

impl Checked {
    /// The crash note for calls of a function of the table.
    #[must_use]
    pub fn action(&self, name: &str) -> Action {
        let known = self.actions.iter().find(|(n, _)| *n == name);
        known.map_or_else(|| Action::new(&self.path, name), |(_, action)| *action)
    }
}

/// Functions that are called frequently.
const OFTEN: [&str; 12] = [
    "rollout",
    "read",
    "diverged_count",
    "status",
    "steps_taken",
    "set_parameters",
    "reset",
    "set_state",
    "save",
    "restore",
    "copy_state",
    "destroy_snapshot",
];

impl std::fmt::Debug for Engine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Checked { name, path, .. } = &*self.inner;
        write!(f, "Engine({name} of {})", path.display())
    }
}

/// Loads the engine of a library; `None` where the library exports none.
///
/// # Errors
/// [`Error::Plugin`] when this host cannot use the table.
pub fn engine(library: &'static Library, path: &Path) -> Result<Option<Engine>> {
    // SAFETY: the type is what the header says of this symbol.
    let Ok(entry) = (unsafe { library.get::<table::EntryFn>(ENTRY) }) else {
        return Ok(None);
    };
    let table = Action::new(path, ENTRY).run(|| {
        // SAFETY: the header lets the host call it once, before anything else.
        unsafe { entry() }
    });
    // SAFETY: the header promises a table that stays valid, or null.
    unsafe { Engine::from_table(table, path) }.map(Some)
}

impl Engine {
    /// Checks a table; messages name `path`.
    ///
    /// # Errors
    /// [`Error::Plugin`] for a table of another major version, one that is truncated, lacks a
    /// function, or has an empty name.
    ///
    /// # Safety
    /// `table` is null, or points to a table that stays valid and does what the header says. For
    /// another major version, the two version numbers suffice.
    pub unsafe fn from_table(table: *const table::Backend, path: &Path) -> Result<Self> {
        let refuse = |message: String| Error::Plugin {
            path: path.to_path_buf(),
            message,
        };
        if table.is_null() {
            return Err(refuse(
                "its engine cannot work on this machine (the table is NULL)".into(),
            ));
        }
        // SAFETY: the versions come first in every version of the table.
        let (major, minor) = unsafe { ((*table).abi_major, (*table).abi_minor) };
        if major != ABI_MAJOR {
            return Err(refuse(format!(
                "it was built for version {major}.{minor} of the engine ABI, this program reads {ABI_MAJOR}.{ABI_MINOR}; build it with the header of this program"
            )));
        }
        // SAFETY: a table of this major version has its size there.
        let size = unsafe { (*table).size };
        let size = usize::try_from(size).unwrap_or(usize::MAX);
        // Minor version 0 already had all fields.
        let needed = size_of::<table::Backend>();
        if size < needed {
            return Err(refuse(format!(
                "its table is cut short: {size} bytes where version {ABI_MAJOR}.{ABI_MINOR} has {needed}; set `size` to sizeof(asid_backend)"
            )));
        }
        debug_assert!(size >= HEAD);
        // SAFETY: the table has at least as many bytes as this structure.
        let table = unsafe { *table };
        if let Some(missing) = missing_function(&table) {
            return Err(refuse(format!("its table has no `{missing}` (NULL)")));
        }
        let unknown = table.capabilities & !table::capabilities().bits();
        #[allow(
            clippy::absurd_extreme_comparisons,
            reason = "not of the first minor version only"
        )]
        let known_version = minor <= ABI_MINOR;
        if known_version && unknown != 0 {
            return Err(refuse(format!(
                "its table claims capability bit {}, which version {ABI_MAJOR}.{ABI_MINOR} does not have",
                unknown.trailing_zeros()
            )));
        }
        let text = |pointer, what: &str| {
            // SAFETY: null or a zero-terminated string, as the header says.
            unsafe { text::read(pointer, what) }.map_err(|e| refuse(e.to_string()))
        };
        let name = text(table.name, "the engine's name")?;
        if !is_name(&name) {
            return Err(refuse(format!(
                "`{name}` is no name for the command line: use a-z, 0-9 and -"
            )));
        }
        Ok(Self {
            inner: Arc::new(Checked {
                name,
                version: text(table.version, "the engine's version")?,
                about: text(table.about, "the engine's description")?,
                // Bits of a later minor version mean nothing here.
                capabilities: Capabilities::from_bits_truncate(table.capabilities)
                    & table::capabilities(),
                actions: OFTEN.map(|name| (name, Action::new(path, name))).into(),
                path: path.to_path_buf(),
                table,
            }),
        })
    }

    /// Name that the engine gives itself.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.inner.name
    }

    /// Version of the engine.
    #[must_use]
    pub fn version(&self) -> &str {
        &self.inner.version
    }

    /// One-line description for `asid list`.
    #[must_use]
    pub fn about(&self) -> &str {
        &self.inner.about
    }

    /// Capabilities that it claims.
    #[must_use]
    pub fn capabilities(&self) -> Capabilities {
        self.inner.capabilities
    }

    /// File that it came from.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.inner.path
    }

    /// The checked table.
    pub(crate) fn checked(&self) -> &Arc<Checked> {
        &self.inner
    }
}

fn is_name(name: &str) -> bool {
    let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    !name.is_empty() && name.len() <= LONGEST_NAME && name.chars().all(allowed)
}

/// The first missing function that an engine with these capabilities must have.
fn missing_function(t: &table::Backend) -> Option<&'static str> {
    let snapshots = t.capabilities & Capabilities::EXACT_SNAPSHOT.bits() != 0;
    [
        ("load", t.load.is_some()),
        ("destroy_model", t.destroy_model.is_some()),
        ("nominal", t.nominal.is_some()),
        ("make_batch", t.make_batch.is_some()),
        ("destroy_batch", t.destroy_batch.is_some()),
        ("set_parameters", t.set_parameters.is_some()),
        ("reset", t.reset.is_some()),
        ("set_state", t.set_state.is_some()),
        ("rollout", t.rollout.is_some()),
        ("read", t.read.is_some()),
        ("save", !snapshots || t.save.is_some()),
        ("restore", !snapshots || t.restore.is_some()),
        (
            "destroy_snapshot",
            !snapshots || t.destroy_snapshot.is_some(),
        ),
        ("status", t.status.is_some()),
        ("diverged_count", t.diverged_count.is_some()),
        ("steps_taken", t.steps_taken.is_some()),
    ]
    .into_iter()
    .find_map(|(name, there)| (!there).then_some(name))
}
