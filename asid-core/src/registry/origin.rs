//! The origin of an entry.

use std::path::Path;

/// A Cargo package.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Package {
    /// Its name.
    pub name: &'static str,
    /// Its version.
    pub version: &'static str,
}

/// The origin of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// Linked into this program, from this package.
    Linked(Package),
    /// Loaded at run time from this file.
    Loaded(&'static Path),
}

impl std::fmt::Display for Origin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Linked(package) => write!(f, "linked in: {} {}", package.name, package.version),
            Self::Loaded(file) => write!(f, "{}", file.display()),
        }
    }
}
