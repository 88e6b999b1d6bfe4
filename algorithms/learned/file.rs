//! Files of what was trained: safetensors, with the description of how it came about.
//!
//! The format is a JSON header and raw numbers, so that a file can be read by other programs and
//! runs nothing when it is loaded. The description is one JSON text under the key `asid` of the
//! header's metadata: one key, because metadata has no order and the same training is to give the
//! same bytes.

use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::io::Write as _;
use std::path::Path;

use asid_core::task::Coordinate;
use asid_core::{Error, Parameter, Problem, Result};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde::{Deserialize, Serialize};

/// Numbers of some shape, row-major, single precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    /// Lengths of the dimensions.
    pub shape: Vec<usize>,
    /// The numbers.
    pub values: Vec<f32>,
}

impl Tensor {
    /// Of one dimension.
    #[must_use]
    pub fn vector(values: Vec<f32>) -> Self {
        Self {
            shape: vec![values.len()],
            values,
        }
    }
}

/// Tensors by name.
pub type Tensors = BTreeMap<String, Tensor>;

/// Some entries of an observation that belong together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObservationEntry {
    /// What they are.
    pub name: String,
    /// How many.
    pub len: usize,
}

/// An entry of an action.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActionEntry {
    /// What it is.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// What -1 and 1 of the network stand for.
    pub range: [f64; 2],
}

impl ActionEntry {
    /// The entry of a coordinate.
    #[must_use]
    pub fn of(coordinate: &Coordinate) -> Self {
        Self {
            name: coordinate.name.clone(),
            unit: coordinate.unit.clone(),
            range: coordinate.range,
        }
    }

    /// Action in its unit for an output of the network.
    #[must_use]
    pub fn span(&self, output: f64) -> f64 {
        let [low, high] = self.range;
        low + (output + 1.0) / 2.0 * (high - low)
    }
}

/// How what a file holds came about, and what it is for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Description {
    /// Layout version.
    pub schema: u32,
    /// Name of the explorer or identifier.
    pub algorithm: String,
    /// The task.
    pub task: String,
    /// Explorer whose episodes were learned from; empty for an explorer.
    pub explorer: String,
    /// Engine of the training, with its version.
    pub engine: String,
    /// Version of the program.
    pub asid: String,
    /// Its commit.
    pub git: String,
    /// Seed of the training.
    pub seed: u64,
    /// All settings.
    pub settings: serde_json::Value,
    /// What the network takes, in order.
    pub observation: Vec<ObservationEntry>,
    /// What it gives.
    pub action: Vec<ActionEntry>,
    /// The unknowns, with the priors that were drawn from.
    pub parameters: Vec<Parameter>,
    /// Control steps of simulated episodes.
    pub training_steps: u64,
    /// Wall-clock time of the training, s.
    pub seconds: f64,
    /// Figures of the training by name, such as the last mean return.
    pub figures: BTreeMap<String, f64>,
}

/// Layout version of [`Description`].
const SCHEMA: u32 = 1;

/// Key of the description in the metadata.
const KEY: &str = "asid";

impl Description {
    /// Of a training on `problem` that has just ended: names, versions, actions and unknowns.
    #[must_use]
    pub fn new(algorithm: &str, problem: &Problem<'_>, settings: serde_json::Value) -> Self {
        Self {
            schema: SCHEMA,
            algorithm: algorithm.to_owned(),
            task: problem.task.name().to_owned(),
            engine: problem.model.engine(),
            asid: env!("CARGO_PKG_VERSION").to_owned(),
            git: crate::commit().to_owned(),
            seed: problem.streams.seed(),
            settings,
            action: problem
                .task
                .exploration()
                .action
                .iter()
                .map(ActionEntry::of)
                .collect(),
            parameters: problem.parameters.to_vec(),
            ..Self::default()
        }
    }
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Saved {
    /// How it came about.
    pub description: Description,
    /// The numbers.
    pub tensors: Tensors,
}

impl Saved {
    /// The file's bytes; the same numbers and description give the same bytes.
    ///
    /// # Errors
    /// [`Error::Shape`] where a tensor has not the numbers that its shape asks for.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let raw: Vec<(&String, &[usize], Vec<u8>)> = self
            .tensors
            .iter()
            .map(|(name, t)| {
                let bytes = t.values.iter().flat_map(|x| x.to_le_bytes()).collect();
                (name, &t.shape[..], bytes)
            })
            .collect();
        let mut views = Vec::with_capacity(raw.len());
        for (name, shape, bytes) in &raw {
            let view = TensorView::new(Dtype::F32, shape.to_vec(), bytes)
                .map_err(|e| Error::Shape(format!("tensor `{name}`: {e}")))?;
            views.push((name.as_str(), view));
        }
        let text = serde_json::to_string(&self.description)
            .map_err(|e| Error::Failed(format!("description: {e}")))?;
        let metadata = HashMap::from([(KEY.to_owned(), text)]);
        safetensors::serialize(views, Some(metadata))
            .map_err(|e| Error::Shape(format!("safetensors: {e}")))
    }

    /// Reads a file's bytes; the message says what is wrong with them.
    ///
    /// # Errors
    /// Where they are no safetensors of this program.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let wrong = |e: &dyn std::fmt::Display| format!("is no safetensors file: {e}");
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(|e| wrong(&e))?;
        let text = header
            .metadata()
            .as_ref()
            .and_then(|m| m.get(KEY))
            .ok_or("does not say how it came about (no `asid` in its metadata)")?;
        let description: Description =
            serde_json::from_str(text).map_err(|e| format!("its description: {e}"))?;
        if description.schema != SCHEMA {
            let schema = description.schema;
            return Err(format!("has schema {schema}; this program reads {SCHEMA}"));
        }
        let file = SafeTensors::deserialize(bytes).map_err(|e| wrong(&e))?;
        let mut tensors = Tensors::new();
        for (name, view) in file.tensors() {
            if view.dtype() != Dtype::F32 {
                return Err(format!("tensor `{name}` is not of single precision"));
            }
            let words = view.data().chunks_exact(4);
            let values: Vec<f32> = words
                .map(|w| f32::from_le_bytes([w[0], w[1], w[2], w[3]]))
                .collect();
            if values.iter().any(|x| !x.is_finite()) {
                return Err(format!("a number of tensor `{name}` is not finite"));
            }
            let shape = view.shape().to_vec();
            tensors.insert(name, Tensor { shape, values });
        }
        Ok(Self {
            description,
            tensors,
        })
    }

    /// Writes the file: whole, or not at all.
    ///
    /// # Errors
    /// [`Error::File`] where it cannot be written.
    pub fn save(&self, path: &Path) -> Result<()> {
        write_atomically(path, &self.to_bytes()?)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::File`] where it cannot be read or is none of this program.
    pub fn load(path: &Path) -> Result<Self> {
        let wrong = |message: String| Error::File {
            path: path.to_owned(),
            message,
        };
        let bytes = fs::read(path).map_err(|e| wrong(e.to_string()))?;
        Self::from_bytes(&bytes).map_err(wrong)
    }

    /// What keeps it from being used for `algorithm` on `problem` with these observations.
    #[must_use]
    pub fn misfit(
        &self,
        algorithm: &str,
        problem: &Problem<'_>,
        observation: &[ObservationEntry],
    ) -> Option<String> {
        let d = &self.description;
        if d.algorithm != algorithm {
            return Some(format!(
                "was trained by `{}`, not `{algorithm}`",
                d.algorithm
            ));
        }
        let task = problem.task.name();
        if d.task != task {
            return Some(format!(
                "was trained for the task `{}`, not `{task}`",
                d.task
            ));
        }
        let names =
            |all: &[Parameter]| -> Vec<String> { all.iter().map(|p| p.name.clone()).collect() };
        let (theirs, ours) = (names(&d.parameters), names(problem.parameters));
        if theirs != ours {
            return Some(format!(
                "was trained for the unknowns {}, not {}",
                theirs.join(", "),
                ours.join(", ")
            ));
        }
        if d.observation != observation {
            let len = |all: &[ObservationEntry]| all.iter().map(|e| e.len).sum::<usize>();
            return Some(format!(
                "takes other observations ({} entries) than this task gives ({})",
                len(&d.observation),
                len(observation)
            ));
        }
        let actions = &problem.task.exploration().action;
        let same = d.action.len() == actions.len()
            && d.action.iter().zip(actions).all(|(a, c)| a.name == c.name);
        if !same {
            return Some(format!("gives other actions than `{task}` takes"));
        }
        None
    }
}

/// Writes a file beside its place and gives it its name when it is whole.
///
/// # Errors
/// [`Error::File`] where that fails.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let wrong = |e: std::io::Error| Error::File {
        path: path.to_owned(),
        message: format!("cannot be written: {e}"),
    };
    if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
        fs::create_dir_all(folder).map_err(wrong)?;
    }
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(name);
    let written = fs::File::create(&part)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()))
        .and_then(|()| fs::rename(&part, path));
    if written.is_err() {
        let _ = fs::remove_file(&part);
    }
    written.map_err(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn saved() -> Saved {
        let tensor = Tensor {
            shape: vec![2, 3],
            values: vec![1.0, -2.5, 3.0e-8, 0.0, 5.0, 6.0],
        };
        Saved {
            description: Description {
                schema: SCHEMA,
                algorithm: "maxmi".into(),
                task: "rod-balancing".into(),
                settings: serde_json::json!({"rounds": 3}),
                seconds: 1.5,
                ..Description::default()
            },
            tensors: Tensors::from([
                ("a.weight".to_owned(), tensor),
                ("a.bias".to_owned(), Tensor::vector(vec![0.25])),
            ]),
        }
    }

    #[test]
    fn a_file_gives_back_what_was_saved_and_is_the_same_to_the_byte() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new folder").join("p.safetensors");
        saved().save(&path).unwrap();
        assert_eq!(Saved::load(&path).unwrap(), saved());
        let bytes = fs::read(&path).unwrap();
        for _ in 0..4 {
            assert_eq!(saved().to_bytes().unwrap(), bytes);
        }
        // Nothing is left beside it.
        let names = fs::read_dir(path.parent().unwrap()).unwrap().count();
        assert_eq!(names, 1);
    }

    #[test]
    fn what_is_no_file_of_this_program_says_so() {
        let message = |bytes: &[u8]| Saved::from_bytes(bytes).unwrap_err();
        assert!(message(b"hello").contains("no safetensors"));
        let bytes = saved().to_bytes().unwrap();
        assert!(message(&bytes[..bytes.len() - 1]).contains("no safetensors"));
        let raw = 1.0_f32.to_le_bytes();
        let view = TensorView::new(Dtype::F32, vec![1], &raw).unwrap();
        let foreign = safetensors::serialize([("x", view)], None).unwrap();
        assert!(message(&foreign).contains("no `asid`"));
        let mut later = saved();
        later.description.schema = 2;
        assert!(message(&later.to_bytes().unwrap()).contains("schema 2"));
        let mut broken = saved();
        broken
            .tensors
            .insert("x".into(), Tensor::vector(vec![f32::NAN]));
        assert!(message(&broken.to_bytes().unwrap()).contains("not finite"));
    }
}
