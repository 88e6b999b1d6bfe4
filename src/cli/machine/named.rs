//! What an argument names: a task, or the path of a study, a model or a result.

use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::Error;
use asid_core::registry::{TaskEntry, find};
use asid_logs::LogFormat;

use crate::cli::shell;

/// Files of a folder that make it a study, and a result with a model.
const STUDY: &str = "study.toml";
const REFINED: &str = "refined.toml";

/// What a study is, for messages.
const WHAT_A_STUDY_IS: &str = "a study is a TOML file, or a folder with study.toml";

/// The path that an argument names; `None` for a registered task.
///
/// # Errors
/// When it is neither, with what is similar among the tasks and beside the path; and when it is a
/// log.
pub fn path_of(argument: &str) -> Result<Option<&Path>> {
    let unknown = match find::<TaskEntry>(argument) {
        Ok(_) => return Ok(None),
        Err(unknown) => unknown,
    };
    let path = Path::new(argument);
    // Treat what looks like a path as one, so that a missing file is reported as such.
    let looks = argument.contains(['/', '\\']) || path.extension().is_some();
    if path.exists() {
        refuse_log(path, None)?;
        return Ok(Some(path));
    }
    if looks {
        return Err(missing(path).into());
    }
    let message = format!("{}; as a task: {unknown}", nowhere(path));
    Err(Error::File {
        path: path.to_owned(),
        message,
    }
    .into())
}

/// The error for a study or model that is not there.
pub fn missing(path: &Path) -> Error {
    let task = path.to_str().filter(|name| find::<TaskEntry>(name).is_ok());
    let task = task.map_or_else(String::new, |name| {
        format!("; the task of that name is diagnosed by: asid diagnose --task {name}")
    });
    Error::File {
        path: path.to_owned(),
        message: nowhere(path) + &task,
    }
}

/// Says that nothing is at a path, and which study or model of a similar name is beside it.
fn nowhere(path: &Path) -> String {
    let near = near(path).map_or_else(String::new, |near| {
        format!("; did you mean `{}`?", near.display())
    });
    format!("no such file or folder ({WHAT_A_STUDY_IS}){near}")
}

/// The study or model of the most similar name in the same folder.
fn near(path: &Path) -> Option<PathBuf> {
    let folder = path.parent()?;
    let listed = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let is_one = |path: &Path| {
        let ending = path.extension().is_some_and(|e| e == "toml" || e == "xml");
        ending || [STUDY, REFINED].iter().any(|f| path.join(f).is_file())
    };
    let entries = std::fs::read_dir(listed)
        .ok()?
        .filter_map(|entry| entry.ok());
    let names: Vec<String> = entries
        .filter(|entry| is_one(&entry.path()))
        .filter_map(|entry| entry.file_name().into_string().ok())
        .collect();
    let name = path.file_name()?.to_str()?;
    // The ending of a file is often left out.
    let stem = |known: &&String| Path::new(known).file_stem().is_some_and(|s| s == name);
    let nearest = || Error::nearest(name, names.iter().map(|n| &**n));
    let found = names.iter().find(stem).cloned().or_else(nearest);
    found.map(|name| folder.join(name))
}

/// Refuses a log in place of a study, with the command that makes a study of it and a `model`.
pub fn refuse_log(path: &Path, model: Option<&Path>) -> Result<()> {
    if !LogFormat::is_named(path) {
        return Ok(());
    }
    let text = |path: &Path| shell::quoted(&path.display().to_string());
    let model = model.map_or_else(|| "FILE".into(), text);
    let message = format!(
        "is a log, not a study; make a study of logs and their model first: asid import {} --model {model} --out DIR",
        text(path)
    );
    Err(Error::File {
        path: path.to_owned(),
        message,
    }
    .into())
}

/// The file of the model that a path names: for the folder of a result, its refined model.
pub fn model_of(path: &Path) -> PathBuf {
    let refined = path.join(REFINED);
    if !path.join(STUDY).exists() && refined.is_file() {
        return refined;
    }
    path.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: "unknown task `stdy`" of a mistyped study. Cause: an argument without a slash or an
    /// ending was looked up among the tasks alone.
    #[test]
    fn a_mistyped_study_is_looked_for_beside_tasks_and_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["study", "answer", "other"] {
            std::fs::create_dir(folder.path().join(name)).unwrap();
        }
        for name in ["study/study.toml", "answer/refined.toml", "robot.xml"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let near = |name: &str| near(&folder.path().join(name));
        assert_eq!(near("stdy"), Some(folder.path().join("study")));
        assert_eq!(near("answr"), Some(folder.path().join("answer")));
        assert_eq!(near("robot"), Some(folder.path().join("robot.xml")));
        assert_eq!(near("othr"), None, "no study, and no model");
        let said = path_of("nothing-here").unwrap_err().to_string();
        for part in ["no such file or folder", "unknown task `nothing-here`"] {
            assert!(said.contains(part), "{said}");
        }
        let said = missing(&folder.path().join("stdy")).to_string();
        assert!(said.contains("did you mean"), "{said}");
    }

    /// Symptom: `asid diagnose log.csv` said "line 1: key with no value". Cause: any file was read
    /// as the TOML of a study.
    #[test]
    fn a_log_in_place_of_a_study_names_the_command_that_makes_one() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("my log.csv");
        std::fs::write(&log, "time,q\n0,1\n").unwrap();
        let said = refuse_log(&log, Some(Path::new("arm.xml"))).unwrap_err();
        let said = said.to_string();
        assert!(said.contains("asid import '"), "{said}");
        assert!(said.contains("my log.csv' --model arm.xml"), "{said}");
        assert!(refuse_log(Path::new("study.toml"), None).is_ok());
    }

    /// Symptom: `asid export FOLDER` of a result said that it has no study.toml. Cause: any folder
    /// was a study.
    #[test]
    fn the_folder_of_a_result_stands_for_its_refined_model() {
        let folder = tempfile::tempdir().unwrap();
        let refined = folder.path().join(REFINED);
        assert_eq!(model_of(folder.path()), folder.path());
        std::fs::write(&refined, "").unwrap();
        assert_eq!(model_of(folder.path()), refined);
        std::fs::write(folder.path().join(STUDY), "").unwrap();
        assert_eq!(model_of(folder.path()), folder.path());
    }
}
