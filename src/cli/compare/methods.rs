//! The methods of a comparison, and whether this build has their parts.

use anyhow::Result;
use asid_comparison::method::{BY_DEFAULT, Method};
use asid_comparison::plan::Plan;
use asid_core::Error;
use asid_core::registry::{Entry, ExplorerEntry, IdentifierEntry, SolverEntry, find};

use crate::cli::list;

/// The methods; the parts of an unnamed method must exist.
pub fn methods(given: &[String], base: Option<&Plan>) -> Result<Vec<Method>> {
    let methods = match (given, base) {
        ([], Some(base)) => base.methods.clone(),
        ([], None) => BY_DEFAULT
            .iter()
            .map(|m| Method::named(m))
            .collect::<asid_core::Result<_>>()?,
        (given, _) => given
            .iter()
            .map(|m| Method::parse(m))
            .collect::<asid_core::Result<_>>()?,
    };
    for method in methods.iter().filter(|m| Method::named(&m.name).is_err()) {
        // A part that other builds have is noted in the table; an unknown part is a mistake.
        if let Some((_, error @ Error::UnknownName { .. })) = lacking(method) {
            return Err(error.into());
        }
    }
    Ok(methods)
}

/// Why a method cannot be run in this build.
pub fn missing_part(method: &Method) -> Option<Error> {
    let (part, error) = lacking(method)?;
    Some(match error {
        Error::UnknownName { .. } => Error::Missing {
            what: part,
            message: "this build is without it".into(),
        },
        other => other,
    })
}

/// The first part of a method that is not registered, with the reason.
fn lacking(method: &Method) -> Option<(String, Error)> {
    fn of<E: Entry>(name: &str) -> Option<(String, Error)> {
        let unknown = find::<E>(name).err()?;
        let error = list::missing(E::KIND, name).unwrap_or(unknown);
        Some((format!("{} `{name}`", E::KIND), error))
    }
    let explorer = || {
        method
            .explores()
            .then(|| of::<ExplorerEntry>(&method.explorer))
    };
    let identifier = || {
        method
            .identifies()
            .then(|| of::<IdentifierEntry>(&method.identifier))
    };
    explorer()
        .flatten()
        .or_else(|| identifier().flatten())
        .or_else(|| of::<SolverEntry>(&method.solver))
}
