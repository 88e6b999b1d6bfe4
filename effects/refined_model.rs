//! The file of a refined model: an MJCF document, values of some parameters, effects.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::EffectSpec;
use asid_core::{Error, Result, Scene, Target};
use asid_documents::toml_text;
use serde::{Deserialize, Serialize};

/// The file, as written.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    model: PathBuf,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    parameter: Vec<ParameterValue>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    effect: Vec<EffectValues>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterValue {
    target: Target,
    value: f64,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct EffectValues {
    effect: String,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    site: String,
    #[serde(default)]
    parameters: BTreeMap<String, f64>,
}

/// A model file that was read: an MJCF document, or a refined model of one.
#[derive(Clone, Debug)]
pub struct RefinedModel {
    /// The document.
    pub scene: Scene,
    /// Values that it sets.
    pub parameters: Vec<(Target, f64)>,
    /// Effects that it has.
    pub effects: Vec<EffectSpec>,
}

/// Longest chain of refined models of refined models: a longer one is a circle.
const MAX_DEPTH: usize = 8;

impl RefinedModel {
    /// Opens an MJCF file, or a TOML file of a refined model of one.
    ///
    /// # Errors
    /// When a file is missing or wrong.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_at(path, 0)
    }

    fn open_at(path: &Path, depth: usize) -> Result<Self> {
        if path.extension().is_none_or(|e| e != "toml") {
            return Ok(Self {
                scene: Scene::from_file(path)?,
                parameters: Vec::new(),
                effects: Vec::new(),
            });
        }
        let fail = |message: String| Error::File {
            path: path.to_owned(),
            message,
        };
        if depth >= MAX_DEPTH {
            return Err(fail(
                "refined models refer to each other in a circle".into(),
            ));
        }
        let text = std::fs::read_to_string(path).map_err(|e| {
            fail(match e.kind() {
                std::io::ErrorKind::NotFound => "no such file".into(),
                _ => e.to_string(),
            })
        })?;
        let document: Document = toml_text::read(&text).map_err(|e| {
            let fault = toml_text::located(&text, &e);
            fail(format!("is no refined model: {fault}"))
        })?;
        let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
        let mut base = Self::open_at(&folder.join(&document.model), depth + 1)?;
        for p in document.parameter {
            if !p.value.is_finite() {
                return Err(fail(format!(
                    "target {}: {} is no number",
                    p.target, p.value
                )));
            }
            base.parameters.retain(|(t, _)| *t != p.target);
            base.parameters.push((p.target, p.value));
        }
        base.effects
            .extend(document.effect.into_iter().map(|e| EffectSpec {
                name: e.effect,
                site: e.site,
                values: e.parameters.into_iter().collect(),
            }));
        Ok(base)
    }

    /// The text of a file that refines `model`, a path as the file is to name it.
    ///
    /// # Errors
    /// [`Error::Failed`] where a value cannot be written.
    pub fn text(model: &Path, values: &[(Target, f64)], effects: &[EffectSpec]) -> Result<String> {
        let document = Document {
            model: model.to_owned(),
            parameter: values
                .iter()
                .map(|(target, value)| ParameterValue {
                    target: target.clone(),
                    value: *value,
                })
                .collect(),
            effect: effects
                .iter()
                .map(|e| EffectValues {
                    effect: e.name.clone(),
                    site: e.site.clone(),
                    parameters: e.values.iter().cloned().collect(),
                })
                .collect(),
        };
        toml::to_string(&document)
            .map_err(|e| Error::Failed(format!("a refined model cannot be written: {e}")))
    }
}
