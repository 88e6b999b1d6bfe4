//! The study file: its contents, its checks, and the study that it describes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use asid_core::parameter::Scale;
use asid_core::{Episode, Error, Layout, Parameter, Result, Target};
use asid_documents::toml_text;
use asid_effects::refined_model::RefinedModel;
use asid_logs::LogSettings;
use asid_logs::counted::check_units;
use asid_logs::episode::{ColumnMapping, check_mapped_columns};
use asid_mjcf::Plant;
use serde::Deserialize;

use super::{Study, files};

/// The contents of the file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    model: PathBuf,
    train: Vec<String>,
    #[serde(default)]
    test: Vec<String>,
    #[serde(default)]
    parameter: Vec<StudyParameter>,
    #[serde(default)]
    noise: BTreeMap<String, f64>,
    #[serde(default)]
    log: LogSettings,
    #[serde(default)]
    column: Vec<ColumnMapping>,
}

/// A parameter, as written in the file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
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

/// Converts a message to an error of the file.
type Fail<'a> = &'a dyn Fn(String) -> Error;

impl Document {
    /// Returns the parameters, each checked and with a unique name.
    fn parameters(&self, fail: Fail<'_>) -> Result<Vec<Parameter>> {
        let parameters = (self.parameter.iter())
            .map(|p| parameter(p).map_err(fail))
            .collect::<Result<Vec<_>>>()?;
        for (i, p) in parameters.iter().enumerate() {
            p.check().map_err(|e| fail(e.to_string()))?;
            if parameters[..i].iter().any(|q| q.name == p.name) {
                return Err(fail(format!("two parameters are named `{}`", p.name)));
            }
        }
        Ok(parameters)
    }

    /// Checks that every noise is positive and of a known sensor.
    fn check_noise(&self, layout: &Layout, fail: Fail<'_>) -> Result<()> {
        for (sensor, &noise) in &self.noise {
            layout
                .sensor(sensor)
                .map_err(|e| fail(format!("[noise] {e}")))?;
            if !(noise.is_finite() && noise > 0.0) {
                return Err(fail(format!(
                    "[noise] {sensor} = {noise}: a standard deviation is above 0"
                )));
            }
        }
        Ok(())
    }

    /// Checks that every column mapping fits the machine and has a unique name.
    fn check_columns(&self, plant: &Plant, fail: Fail<'_>) -> Result<()> {
        for (i, mapping) in self.column.iter().enumerate() {
            mapping.check(&plant.layout).map_err(|e| of_file(e, fail))?;
            let before = &self.column[..i];
            if before.iter().any(|m| m.name == mapping.name) {
                return Err(fail(format!("two [[column]] are named `{}`", mapping.name)));
            }
        }
        check_units(plant, &self.column).map_err(|e| of_file(e, fail))
    }
}

/// Converts an error of a setting to one of the file.
fn of_file(error: Error, fail: Fail<'_>) -> Error {
    match error {
        Error::Config { message, .. } => fail(message),
        other => other,
    }
}

impl Study {
    /// Reads a study file, or a folder with `study.toml`.
    ///
    /// # Errors
    /// When a file is missing or wrong; the message names file, row and column.
    pub fn read(path: &Path) -> Result<Self> {
        Self::read_with(path, None)
    }

    /// Reads a study with another `model` in place of its own, if one is given.
    ///
    /// # Errors
    /// As [`Study::read`].
    pub fn read_with(path: &Path, model: Option<&Path>) -> Result<Self> {
        let file = if path.is_dir() {
            path.join("study.toml")
        } else {
            path.to_owned()
        };
        let fail = |message: String| Error::File {
            path: file.clone(),
            message,
        };
        let text = std::fs::read_to_string(&file).map_err(|e| {
            fail(match e.kind() {
                std::io::ErrorKind::NotFound => {
                    "no such file: a study is a TOML file, or a folder with study.toml".into()
                }
                _ => e.to_string(),
            })
        })?;
        let document: Document =
            toml_text::read(&text).map_err(|e| fail(toml_text::located(&text, &e)))?;
        let folder = file.parent().map(Path::to_path_buf).unwrap_or_default();
        let own = || folder.join(&document.model);
        let model = model.map_or_else(own, Path::to_path_buf);
        let source = RefinedModel::open(&model)?;
        let plant = Plant::of(&source.scene)?;
        let mut parameters = document.parameters(&fail)?;
        for p in &mut parameters {
            let known = |t: &Target| named(&plant, t);
            p.targets
                .iter()
                .try_for_each(known)
                .map_err(|e| fail(format!("parameter `{}`: {e}", p.name)))?;
            p.targets.iter_mut().for_each(|t| by_geom(&plant, t));
        }
        set_once(&parameters).map_err(&fail)?;
        document.check_noise(&plant.layout, &fail)?;
        document.check_columns(&plant, &fail)?;
        let mut notes = Vec::new();
        let mut logs = files::Logs::new(&folder, &plant, &document.column, &document.log);
        let mut read = |patterns: &[String], key: &str| -> Result<Vec<(String, Episode)>> {
            let read = logs.read(patterns, key);
            let read = read.map_err(|e| of_file(e, &fail))?;
            let each = read.into_iter().map(|(name, episode, noted)| {
                notes.push((name.clone(), noted));
                (name, episode)
            });
            Ok(each.collect())
        };
        let train = read(&document.train, "train")?;
        let test = read(&document.test, "test")?;
        let noted = notes.iter().map(|(_, noted)| noted);
        check_mapped_columns(noted).map_err(|e| of_file(e, &fail))?;
        if let Some((name, _)) = test.iter().find(|(n, _)| train.iter().any(|(m, _)| m == n)) {
            return Err(fail(format!(
                "{name} is among `train` and among `test`: what is held out must not be fitted"
            )));
        }
        let name = if path.is_dir() {
            path.file_name()
        } else {
            path.file_stem()
        };
        Self {
            name: name.map_or_else(|| "study".into(), |n| n.to_string_lossy().into_owned()),
            model,
            scene: source.scene,
            fixed: source.parameters,
            effects: source.effects,
            parameters,
            train,
            test,
            noise: document.noise,
            columns: document.column,
            notes,
            wired: false,
        }
        .with_test()
    }
}

/// Checks that the machine has the geom, body, joint or actuator that a target names; the engine
/// checks other elements.
fn named(plant: &Plant, target: &Target) -> Result<()> {
    let layout = &plant.layout;
    let (kind, names): (_, Vec<&str>) = match &*target.element {
        "geom" => ("geom", layout.geoms.iter().map(String::as_str).collect()),
        "body" => ("body", layout.bodies.iter().map(String::as_str).collect()),
        "joint" => ("joint", layout.joints.iter().map(|j| &*j.name).collect()),
        "actuator" => {
            let actuators = layout.actuators.iter();
            ("actuator", actuators.map(|a| &*a.name).collect())
        }
        _ => return Ok(()),
    };
    if names.contains(&&*target.name) {
        return Ok(());
    }
    Err(Error::unknown(kind, &target.name, names))
}

/// Refuses two parameters that set one value, under one name or under two.
fn set_once(parameters: &[Parameter]) -> Result<(), String> {
    for (i, p) in parameters.iter().enumerate() {
        let same = |q: &&Parameter| p.targets.iter().any(|t| q.targets.contains(t));
        if let Some(q) = parameters[..i].iter().find(same) {
            return Err(format!(
                "parameters `{}` and `{}` set the same value of the model: leave one of them out",
                q.name, p.name
            ));
        }
    }
    Ok(())
}

/// Names a study's parameter in an error about one of its targets.
///
/// The target may have a name that the study does not mention, as a geom's for the mass of its
/// body.
#[must_use]
pub fn named_as_written(parameters: &[Parameter], error: Error) -> Error {
    match error {
        Error::Parameter { parameter, message } => {
            let is_it = |p: &&Parameter| p.targets.iter().any(|t| t.to_string() == parameter);
            let written = parameters.iter().find(is_it);
            Error::Parameter {
                parameter: written.map_or(parameter, |p| p.name.clone()),
                message,
            }
        }
        other => other,
    }
}

/// Replaces the mass of a body by the mass of its geom, if a single geom has it.
///
/// Effects on masses use geoms, and a model has one name for each value that is set.
fn by_geom(plant: &Plant, target: &mut Target) {
    if (&*target.element, &*target.attribute) != ("body", "mass") {
        return;
    }
    let geoms: Vec<usize> = plant.geoms_with_mass(&target.name).collect();
    if let [geom] = geoms[..] {
        target.element = "geom".into();
        target.name.clone_from(&plant.layout.geoms[geom]);
    }
}

/// Returns the parameter that an entry describes.
fn parameter(written: &StudyParameter) -> Result<Parameter, String> {
    let mut targets = written.targets.clone();
    targets.extend(written.target.clone());
    if targets.is_empty() {
        return Err(format!("parameter `{}` has no `target`", written.name));
    }
    Ok(Parameter {
        name: written.name.clone(),
        targets,
        range: written.range,
        scale: written.scale,
        unit: written.unit.clone(),
    })
}
