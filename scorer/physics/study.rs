//! A study for the scorer's replays: the model, the owner's parameters and the logs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use asid_core::parameter::Scale;
use asid_core::{Episode, Error, Parameter, Result, Target};
use asid_documents::toml_text;
use asid_effects::RefinedModel;
use asid_mjcf::Plant;
use serde::Deserialize;

/// Name of a study's file.
const STUDY: &str = "study.toml";

/// The keys of `study.toml` that matter here.
#[derive(Debug, Deserialize)]
struct Document {
    model: PathBuf,
    train: Vec<String>,
    #[serde(default)]
    test: Vec<String>,
    #[serde(default)]
    parameter: Vec<StudyParameter>,
    #[serde(default)]
    noise: BTreeMap<String, f64>,
    /// Column mappings of other stacks; such logs are not read here.
    #[serde(default)]
    column: Vec<toml::Value>,
}

#[derive(Debug, Deserialize)]
struct StudyParameter {
    name: String,
    #[serde(default)]
    target: Option<Target>,
    #[serde(default)]
    targets: Vec<Target>,
    range: [f64; 2],
    #[serde(default)]
    scale: Scale,
    #[serde(default)]
    unit: String,
}

/// A study.
pub struct Study {
    /// Its model, with everything that a refined model sets and adds.
    pub model: RefinedModel,
    /// The machine.
    pub plant: Plant,
    /// Parameters that the owner fits.
    pub parameters: Vec<Parameter>,
    /// Training logs.
    pub train: Vec<Episode>,
    /// Held-out logs.
    pub test: Vec<Episode>,
    /// Standard deviation of each sensor's noise, if it is given.
    pub noise: BTreeMap<String, f64>,
}

impl Study {
    /// The model of the study in a folder.
    ///
    /// # Errors
    /// If a file is missing or wrong.
    pub fn model_of(folder: &Path) -> Result<RefinedModel> {
        RefinedModel::open(&folder.join(document(folder)?.model))
    }

    /// Reads the study in a folder.
    ///
    /// # Errors
    /// If a file is missing or wrong, or if its logs need a mapping of names.
    pub fn read(folder: &Path) -> Result<Self> {
        let document = document(folder)?;
        let fail = |message: String| Error::File {
            path: folder.join(STUDY),
            message,
        };
        if !document.column.is_empty() {
            return Err(fail(
                "maps columns, which the scorer's replays do not".into(),
            ));
        }
        let model = RefinedModel::open(&folder.join(&document.model))?;
        let plant = Plant::of(&model.scene)?;
        let read = |patterns: &[String]| -> Result<Vec<Episode>> {
            let mut files: Vec<PathBuf> = Vec::new();
            for pattern in patterns {
                files.extend(matching(folder, pattern)?);
            }
            let logs = files
                .iter()
                .map(|f| asid_logs::episode::read(f, &plant.layout));
            logs.collect()
        };
        let (mut train, mut test) = (read(&document.train)?, read(&document.test)?);
        if test.is_empty() && train.len() > 1 {
            let held = (train.len() / 3).max(1);
            test = train.split_off(train.len() - held);
        }
        if train.is_empty() || test.is_empty() {
            return Err(fail("has no logs to fit to, or none held out".into()));
        }
        let parameter = |p: StudyParameter| Parameter {
            name: p.name,
            targets: p.targets.into_iter().chain(p.target).collect(),
            range: p.range,
            scale: p.scale,
            unit: p.unit,
        };
        Ok(Self {
            parameters: document.parameter.into_iter().map(parameter).collect(),
            noise: document.noise,
            model,
            plant,
            train,
            test,
        })
    }
}

fn document(folder: &Path) -> Result<Document> {
    let file = folder.join(STUDY);
    let fail = |message: String| Error::File {
        path: file.clone(),
        message,
    };
    let text = std::fs::read_to_string(&file).map_err(|e| fail(e.to_string()))?;
    toml_text::read(&text).map_err(|e| fail(toml_text::located(&text, &e)))
}

/// Files of a folder that match a pattern, sorted. The last part of the pattern may have one `*`.
fn matching(folder: &Path, pattern: &str) -> Result<Vec<PathBuf>> {
    let path = folder.join(pattern);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let Some((before, after)) = name.split_once('*') else {
        return Ok(vec![path]);
    };
    let parent = path.parent().unwrap_or(folder);
    let entries = std::fs::read_dir(parent).map_err(|e| Error::File {
        path: parent.to_owned(),
        message: e.to_string(),
    })?;
    let fits = |p: &PathBuf| {
        let name = p.file_name().unwrap_or_default().to_string_lossy();
        name.len() >= before.len() + after.len()
            && name.starts_with(before)
            && name.ends_with(after)
    };
    let mut found: Vec<PathBuf> = entries
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(fits)
        .collect();
    found.sort();
    Ok(found)
}
