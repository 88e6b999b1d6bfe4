//! Resuming a comparison: which results of its folder are valid, and which are missing.

use std::collections::HashMap;

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
use crate::cli::session;

/// Missing cells of this share; existing ones must belong to this comparison.
pub fn pending(
    arguments: &Arguments,
    store: &Store,
    keys: &[CellKey],
    arms: &Arms,
) -> Result<Vec<CellKey>> {
    let mut engines: HashMap<&str, String> = HashMap::new();
    let mut pending = Vec::new();
    for (place, key) in keys.iter().enumerate() {
        match store.cell(key)? {
            Some(cell) => {
                if !engines.contains_key(&*key.backend) {
                    let backend = session::backend(&key.backend)?;
                    let engine = format!("{} {}", backend.name(), backend.version());
                    engines.insert(&key.backend, engine);
                }
                if let Some(Ok(arm)) = arms.get(&arm_name(key)) {
                    check_cell(store, &cell, arm, &engines[&*key.backend])?;
                }
            }
            None if arguments.shard.is_none_or(|s| s.holds(place)) => pending.push(key.clone()),
            None => {}
        }
    }
    Ok(pending)
}

/// Checks that an existing cell is what a run would produce now.
fn check_cell(store: &Store, cell: &Cell, arm: &Arm, engine: &str) -> Result<()> {
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
    } else if (&*cell.versions.git, &*cell.versions.asid) != (COMMIT, VERSION) {
        format!("by commit {} ({})", cell.versions.git, cell.versions.asid)
    } else if cell.versions.engine != engine {
        format!("on {}", cell.versions.engine)
    } else {
        return Ok(());
    };
    Err(Error::File {
        path: store.place(&cell.key),
        message: format!("was made {difference}; choose another --out"),
    }
    .into())
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
