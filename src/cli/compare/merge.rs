//! `asid compare --merge`: merges finished comparisons, or shares of one.

use std::path::Path;
use std::{fs, io};

use anyhow::Result;
use asid_comparison::merge::{Commits, Merged, Part, unite};
use asid_comparison::store::{Store, unique, write};
use asid_core::Error;

use super::Arguments;
use super::folder::{TRAINED, contents, sum_up};
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
    for from in &merged.stores {
        keep_trained(from, store).map_err(|e| {
            let place = store.policies();
            Error::Failed(format!("{}: cannot be written: {e}", place.display()))
        })?;
    }
    Ok(())
}

/// Copies the trainings that are not there yet. As a training itself, a copy gets its name when it
/// is whole.
fn keep_trained(from: &Store, to: &Store) -> io::Result<()> {
    for training in fs::read_dir(from.policies()).into_iter().flatten() {
        let training = training?;
        let (folder, name) = (training.path(), training.file_name());
        let (place, name) = (to.policies().join(&name), name.to_string_lossy());
        if !folder.join(TRAINED).is_file() || place.exists() || name.starts_with('.') {
            continue;
        }
        let partial = to.policies().join(format!(".{name}.{}", unique()));
        copy_folder(&folder, &partial)?;
        fs::rename(&partial, &place)?;
    }
    Ok(())
}

/// Copies a folder with those below it, such as the one of a training's curves.
fn copy_folder(from: &Path, to: &Path) -> io::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let (path, place) = (entry.path(), to.join(entry.file_name()));
        if path.is_dir() {
            copy_folder(&path, &place)?;
        } else {
            fs::copy(&path, &place)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: a merged comparison lacked what its shares had trained, and its times the seconds
    /// of the trainings. Cause: only runs and settings were copied.
    #[test]
    fn what_was_trained_is_merged_as_well() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b, all] = ["a", "b", "all"].map(|name| Store::new(&folder.path().join(name)));
        let train = |store: &Store, name: &str, files: &[(&str, &str)]| {
            let place = store.policies().join(name);
            fs::create_dir_all(&place).unwrap();
            for (file, text) in files {
                let file = place.join(file);
                fs::create_dir_all(file.parent().unwrap()).unwrap();
                fs::write(file, text).unwrap();
            }
        };
        train(&a, "one", &[("policy.safetensors", "1"), (TRAINED, "5.0")]);
        train(&b, "one", &[("policy.safetensors", "1"), (TRAINED, "6.0")]);
        let curves = ("network.tensorboard/events", "curves");
        let network = ("network.safetensors", "2");
        train(&b, "two", &[network, curves, (TRAINED, "7.0")]);
        // Trainings that were stopped.
        train(&b, "three", &[("policy.safetensors", "3")]);
        train(&b, ".four.1", &[(TRAINED, "8.0")]);
        for from in [&a, &b] {
            keep_trained(from, &all).unwrap();
        }
        let entries = fs::read_dir(all.policies()).unwrap();
        let mut names: Vec<String> = entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert_eq!(names, ["one", "two"]);
        let read = |file: &str| fs::read_to_string(all.policies().join(file)).unwrap();
        assert_eq!(read("one/seconds"), "5.0");
        assert_eq!(read("two/network.safetensors"), "2");
        assert_eq!(read("two/network.tensorboard/events"), "curves");
    }
}
