//! The study that the settings describe.

use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::Episode;
use asid_core::registry::{TaskEntry, find};
use asid_diagnosis::study::Study;
use asid_effects::refined_model::RefinedModel;

use super::super::super::machine::{is_study, missing, no_study, refuse_log};
use super::super::super::model::{self, Needs};
use super::super::super::session::backend;
use super::super::super::settings::{difficulty, wrong};
use super::Config;

impl Config {
    /// The study: as written, or of a task with the logs that the settings name or with `played`.
    pub fn study(&self, played: Option<Logs>) -> Result<Study> {
        match (&self.study, &self.task) {
            (Some(path), _) if !path.exists() => Err(missing(path).into()),
            (Some(path), _) if is_model(path)? => Err(no_study(path).into()),
            (Some(path), _) => {
                refuse_log(path, self.model.as_deref())?;
                Ok(Study::read_with(path, self.model.as_deref())?)
            }
            (None, Some(name)) => {
                let task = difficulty::at((find::<TaskEntry>(name)?.make)()?, &self.difficulty)?;
                let model = match &self.model {
                    None => model::of_task(&*task),
                    Some(path) => {
                        let backend = backend(&self.backend)?;
                        let scene = backend.load(task.scene())?;
                        let needs = Needs {
                            task: &*task,
                            layout: scene.layout(),
                            parameters: &task.parameters(),
                        };
                        needs.open(&*backend, path, "simulator", &[])?.0
                    }
                };
                let (train, test) = match played {
                    Some(logs) => logs,
                    None => (read(&self.train, &model)?, read(&self.test, &model)?),
                };
                Ok(Study::of_task(&*task, model, train, test)?)
            }
            (None, None) => Err(wrong("study", "is missing")),
        }
    }
}

/// Whether a path names the file of a model, MJCF or TOML, and no study.
fn is_model(path: &Path) -> Result<bool> {
    let ending = path.extension().is_some_and(|e| e == "xml" || e == "toml");
    Ok(ending && path.is_file() && !is_study(path)?)
}

/// Logs to fit and logs held out, with their names.
pub type Logs = (Vec<(String, Episode)>, Vec<(String, Episode)>);

/// Reads logs of a machine, with their names.
fn read(files: &[PathBuf], model: &RefinedModel) -> Result<Vec<(String, Episode)>> {
    let layout = asid_mjcf::Plant::of(&model.scene)?.layout;
    let one = |file: &PathBuf| -> Result<(String, Episode)> {
        let episode = asid_logs::episode::read(Path::new(file), &layout)?;
        Ok((file.display().to_string(), episode))
    };
    files.iter().map(one).collect()
}
