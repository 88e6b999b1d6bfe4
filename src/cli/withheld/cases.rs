//! The cases of a folder, and which of them an engine can simulate.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::{Backend, Error};
use asid_scorer::physics::Study;

use crate::cli::failure;

/// A case: its name, and its study.
pub type Case = (String, PathBuf);

/// Folders with a study, sorted; a non-empty `only` selects among them.
pub fn cases(folder: &Path, only: &[String]) -> Result<Vec<Case>> {
    let fail = |message: String| Error::File {
        path: folder.to_owned(),
        message,
    };
    let entries = std::fs::read_dir(folder).map_err(|e| fail(e.to_string()))?;
    let name = |path: &Path| {
        path.file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    let mut found: Vec<Case> = entries
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(|p| p.join("study.toml").is_file())
        .map(|p| (name(&p), p))
        .filter(|(name, _)| only.is_empty() || only.contains(name))
        .collect();
    found.sort();
    if let Some(missing) = only
        .iter()
        .find(|o| found.iter().all(|(name, _)| name != *o))
    {
        return Err(fail(format!("has no case `{missing}`")).into());
    }
    if found.is_empty() {
        return Err(fail("holds no folder with a study.toml".into()).into());
    }
    Ok(found)
}

/// Cases whose scene an engine cannot simulate, with its reason. The method reports other faults of
/// a study.
pub fn refused(cases: &[Case], backend: &dyn Backend) -> BTreeMap<String, String> {
    let refusal = |(name, study): &Case| {
        let model = Study::model_of(study).ok()?;
        match backend.load(&model.scene) {
            Err(error @ Error::Scene { .. }) => {
                failure::note(&format!("{name}: left out: {error}"));
                Some((name.clone(), error.to_string()))
            }
            _ => None,
        }
    };
    cases.iter().filter_map(refusal).collect()
}
