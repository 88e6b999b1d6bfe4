//! The subject of a command on any machine: a study, or a model without logs.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Result;
use asid_core::{Backend, Episode, Error, Model};
use asid_diagnosis::study::{Study, named_as_written};
use asid_effects::RefinedModel;
use asid_effects::refined::as_compiled;
use asid_mjcf::Plant;
use asid_readings::first_row::Followers;
use asid_sysid::start::start_of;

use super::super::diagnose::default_backend;
use super::super::model::refine;
use super::super::session::backend;
use super::named::model_of;

/// A machine on an engine.
pub struct Subject {
    /// Name for folders and pages.
    pub name: String,
    /// File of the model, as given.
    pub file: PathBuf,
    /// The model with its values and effects.
    pub source: RefinedModel,
    /// Logs and unknowns, where a study is given.
    pub study: Option<Study>,
    /// The engine.
    pub backend: Box<dyn Backend>,
    /// The compiled model, with values and effects.
    pub model: Arc<dyn Model>,
    /// The machine, with the engine's layout.
    pub plant: Plant,
}

impl Subject {
    /// Opens a study (a folder, or a TOML file with `train`), a refined model (any other TOML file,
    /// or the folder of a result) or an MJCF file.
    pub fn open(path: &Path, engine: Option<&str>) -> Result<Self> {
        Self::open_with(path, engine, None)
    }

    /// As [`Subject::open`], with another `model` in place of the study's own.
    pub fn open_with(path: &Path, engine: Option<&str>, model: Option<&Path>) -> Result<Self> {
        let path = model_of(path);
        let path = &*path;
        let study = is_study(path)?.then(|| Study::read_with(path, model));
        let mut study = study.transpose()?;
        let (name, file, source) = match &study {
            Some(study) => (
                study.name.clone(),
                study.model.clone(),
                RefinedModel {
                    scene: study.scene.clone(),
                    parameters: study.fixed.clone(),
                    effects: study.effects.clone(),
                },
            ),
            None => {
                let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned());
                (
                    stem.unwrap_or_else(|| "model".into()),
                    path.to_owned(),
                    RefinedModel::open(path)?,
                )
            }
        };
        let backend = backend(&engine.map_or_else(default_backend, str::to_owned))?;
        let compiled = backend.load(&source.scene)?;
        let plant = Plant::of(&source.scene)?;
        let mut plant = as_compiled(&plant, &*compiled, source.scene.name())?;
        plant.layout = compiled.layout().clone();
        for (target, value) in &source.parameters {
            plant.set(target, [compiled.nominal(target)?, *value]);
        }
        let model = refine(&*backend, compiled, &source.scene, &source, &[])?;
        if let Some(study) = &mut study {
            open_first_rows(&*model, &plant, study)?;
        }
        Ok(Self {
            name,
            file,
            source,
            study,
            backend,
            model,
            plant,
        })
    }

    /// The study, for commands that need logs.
    pub fn needs_study(&self) -> Result<&Study> {
        self.study
            .as_ref()
            .ok_or_else(|| no_study(&self.file).into())
    }

    /// An error about an unknown of the study, with the name that the study gives it.
    pub fn as_written(&self, error: impl Into<anyhow::Error>) -> anyhow::Error {
        let parameters = self.study.as_ref().map_or(&[][..], |s| &s.parameters);
        match error.into().downcast::<Error>() {
            Ok(error) => named_as_written(parameters, error).into(),
            Err(other) => other,
        }
    }

    /// `name version` of the engine.
    pub fn engine(&self) -> String {
        format!("{} {}", self.backend.name(), self.backend.version())
    }
}

/// Removes from the first rows of a study's logs the readings that follow a command from before the
/// log.
fn open_first_rows(model: &dyn Model, plant: &Plant, study: &mut Study) -> Result<()> {
    let logs = study.train.iter().chain(&study.test);
    let logs: Vec<&Episode> = logs.map(|(_, episode)| episode).collect();
    let Some(first) = logs.first() else {
        return Ok(());
    };
    let (start, _) = start_of(plant, first);
    let followers = Followers::of(model, &start, &logs)?;
    let logs = study.train.iter_mut().chain(&mut study.test);
    logs.for_each(|(_, episode)| followers.open(episode));
    Ok(())
}

/// The error for the file of a model where a study is needed.
pub fn no_study(model: &Path) -> Error {
    let message = "is a model without logs: a study is needed, a TOML file with `model` and `train`, or a folder with study.toml; \
                   `asid import LOG… --model FILE --out DIR` makes one";
    Error::File {
        path: model.to_owned(),
        message: message.into(),
    }
}

/// Whether a path names a study rather than a model.
pub fn is_study(path: &Path) -> Result<bool> {
    if path.is_dir() {
        return Ok(true);
    }
    if path.extension().is_none_or(|e| e != "toml") {
        return Ok(false);
    }
    // The reader of studies reports what cannot be read or parsed.
    let Ok(text) = std::fs::read_to_string(path) else {
        return Ok(true);
    };
    let table: Result<toml::Table, _> = text.parse();
    Ok(table.map_or(true, |t| {
        // An unknown of a study has a range, a parameter of a refined model a value.
        let unknowns = t.get("parameter").and_then(toml::Value::as_array);
        let has_range = |p: &toml::Value| p.get("range").is_some();
        let of_study = ["train", "test", "noise", "log", "column"];
        !t.contains_key("model")
            || of_study.iter().any(|key| t.contains_key(*key))
            || unknowns.is_some_and(|all| all.iter().any(has_range))
    }))
}
