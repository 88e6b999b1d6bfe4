//! Resuming a comparison: which results of its folder are valid, and which are missing.

use std::collections::{HashMap, HashSet};

use anyhow::Result;
use asid_comparison::cell::{Cell, CellKey};
use asid_comparison::document::Document;
use asid_comparison::settings::first_difference;
use asid_comparison::store::Store;
use asid_core::Error;

use super::Arguments;
use super::arm::Arm;
use super::cell::{COMMIT, VERSION};
use super::work::{Arms, arm_name};
use crate::cli::{failure, session};

/// Missing cells of this share; existing ones must belong to this comparison.
///
/// # Errors
/// When an existing cell does not, or cannot be read.
pub fn pending(
    arguments: &Arguments,
    store: &Store,
    keys: &[CellKey],
    arms: &Arms,
) -> Result<Vec<CellKey>> {
    check_versions(store, keys)?;
    let mut pending = Vec::new();
    for (place, key) in keys.iter().enumerate() {
        match store.cell(key)? {
            Some(cell) => {
                if let Some(Ok(arm)) = arms.get(&arm_name(key)) {
                    check_settings(store, &cell, arm)?;
                }
            }
            None if arguments.shard.is_none_or(|s| s.holds(place)) => pending.push(key.clone()),
            None => {}
        }
    }
    Ok(pending)
}

/// Checks that the existing cells are of this program and of its engines, whether this build could
/// run them or not.
///
/// # Errors
/// When one is not, or cannot be read.
pub fn check_versions(store: &Store, keys: &[CellKey]) -> Result<()> {
    let mut engines: HashMap<&str, String> = HashMap::new();
    for key in keys {
        let Some(cell) = store.cell(key)? else {
            continue;
        };
        let made = &cell.versions;
        if (&*made.git, &*made.asid) != (COMMIT, VERSION) {
            let by = format!("by commit {} ({})", made.git, made.asid);
            return Err(other(store, &cell, &by));
        }
        if !engines.contains_key(&*key.backend) {
            let backend = session::backend(&key.backend)?;
            let engine = format!("{} {}", backend.name(), backend.version());
            engines.insert(&key.backend, engine);
        }
        if made.engine != engines[&*key.backend] {
            return Err(other(store, &cell, &format!("on {}", made.engine)));
        }
    }
    Ok(())
}

/// An existing cell that was made in another way.
fn other(store: &Store, cell: &Cell, how: &str) -> anyhow::Error {
    Error::File {
        path: store.place(&cell.key),
        message: format!("was made {how}; choose another --out"),
    }
    .into()
}

/// Tells of runs in the folder that the plan there has and this one has not: they stay, and are in
/// no table.
///
/// # Errors
/// When the plan there cannot be read.
pub fn left_aside(store: &Store, keys: &[CellKey]) -> Result<()> {
    if !store.is_begun() {
        return Ok(());
    }
    let mut plan = Document::read(&store.config())?.plan;
    plan.check()?;
    let wanted: HashSet<&CellKey> = keys.iter().collect();
    let there = plan.cells();
    let aside = there.iter().filter(|key| !wanted.contains(key));
    let aside = aside.filter(|key| store.place(key).is_file()).count();
    if aside > 0 {
        failure::warn(&format!(
            "{aside} runs in {} are of methods, conditions, seeds or worlds that this call does not \
             name: they stay there, and are in no table until a call names them again",
            store.root().display()
        ));
    }
    Ok(())
}

/// Checks that an existing cell is of the settings that a run would have now.
fn check_settings(store: &Store, cell: &Cell, arm: &Arm) -> Result<()> {
    let method = (
        &arm.method.explorer,
        &arm.method.identifier,
        &arm.method.solver,
    );
    let difference = if (&cell.explorer, &cell.identifier, &cell.solver) != method {
        format!("as {}+{}+{}", cell.explorer, cell.identifier, cell.solver)
    } else if cell.settings != arm.hash {
        let now = arm.canonical.parse::<toml::Table>().ok();
        match (store.settings(&cell.settings), now) {
            (Some(then), Some(now)) => {
                format!("with other settings: {}", first_difference(&then, &now))
            }
            _ => format!("with other settings, {}", cell.settings),
        }
    } else {
        return Ok(());
    };
    Err(other(store, cell, &difference))
}

/// Checks that the folder is new or holds a comparison that this one continues.
pub fn same_comparison(arguments: &Arguments, store: &Store, document: &Document) -> Result<()> {
    if !store.is_begun() {
        return Ok(());
    }
    let there = Document::read(&store.config())?;
    let refuse = |message: String| {
        Err(Error::File {
            path: store.root().to_owned(),
            message: format!("{message}; choose another --out"),
        }
        .into())
    };
    if there.settings != document.settings {
        let which = first_difference(&there.settings, &document.settings);
        return refuse(format!("was made with other settings: {which}"));
    }
    for (what, then, now) in [
        ("--quick", there.plan.quick, document.plan.quick),
        ("--train", there.plan.train, document.plan.train),
    ] {
        if then != now {
            let with = if then { "with" } else { "without" };
            return refuse(format!("was made {with} {what}"));
        }
    }
    if arguments.shard.is_some() && there != *document {
        return refuse("holds another comparison than this share is of".into());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: runs of another commit, of a method that this build is without, came into one table
    /// with runs of this one. Cause: what a build cannot run it did not check.
    #[test]
    fn a_run_of_another_commit_is_refused_whether_it_could_be_run_or_not() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path());
        let keep = |git: &str| -> CellKey {
            let cell = serde_json::json!({
                "schema": 1, "task": "t", "condition": "c", "method": "m", "world": "w",
                "backend": "b", "seed": 0, "explorer": "x", "identifier": "y", "solver": "z",
                "settings": "0", "versions": { "asid": VERSION, "engine": "b 1", "git": git },
                "parameters": [], "residual": null, "contact_fraction": null, "metric": "m",
                "value": 1.0, "success": true, "physics_steps": 0, "env_steps": 0,
            });
            let cell: Cell = serde_json::from_value(cell).unwrap();
            store.keep(&cell, None).unwrap();
            cell.key
        };
        let said = |git: &str| {
            let error = check_versions(&store, &[keep(git)]).unwrap_err();
            error.to_string()
        };
        let other = format!("{COMMIT}x");
        assert!(said(&other).contains(&format!("was made by commit {other}")));
        // Of this commit, on an engine that is not there.
        assert!(!said(COMMIT).contains("was made by"));
    }
}
