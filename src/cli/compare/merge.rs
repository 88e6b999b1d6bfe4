//! `asid compare --merge`: merges finished comparisons, or shares of one.

use anyhow::Result;
use asid_comparison::merge::{Commits, Merged, Part, unite};
use asid_comparison::store::{Store, write};
use asid_core::Error;

use super::Arguments;
use super::folder::{contents, sum_up};
use crate::cli::output::OutFolder;

/// Puts the cells of several folders into a new one and summarises them.
pub fn merge(arguments: &Arguments) -> Result<()> {
    let parts = arguments.merge.iter().map(|folder| Part::read(folder));
    let parts = parts.collect::<asid_core::Result<Vec<_>>>()?;
    let commits = match arguments.across_commits {
        true => Commits::OneARow,
        false => Commits::One,
    };
    let merged = unite(&parts, commits)?;
    if merged.cells.is_empty() {
        return Err(Error::Config {
            key: "--merge".into(),
            message: "there is no run in these folders".into(),
        }
        .into());
    }
    // If no folder is named, claim the next free one before the work.
    let out = OutFolder::claim(arguments.out.as_deref(), "compare")?;
    let store = Store::new(&out.path());
    keep(&store, &merged)?;
    let keys = merged.document.plan.cells();
    let there = contents(&store, &keys)?;
    sum_up(&store, &merged.document, &there)?.print(arguments.json)
}

/// Writes the parts of a comparison into its own folder.
fn keep(store: &Store, merged: &Merged) -> Result<()> {
    write(&store.config(), &merged.document.text()?)?;
    for cell in &merged.cells {
        let time = merged.times.iter().find(|t| t.key == cell.key);
        store.keep(cell, time.map(|t| t.wall_s))?;
        let settings = merged
            .stores
            .iter()
            .find_map(|s| s.settings(&cell.settings));
        if let Some(settings) = settings {
            store.keep_settings(&cell.settings, &settings.to_string())?;
        }
    }
    for failure in &merged.failures {
        store.fail(failure)?;
    }
    Ok(())
}
