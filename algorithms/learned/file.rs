//! Files of trained networks: safetensors with a description of the training.
//!
//! The format is a JSON header and raw numbers. Other programs can read it, and loading it executes
//! no code. The description is one JSON text under the key `asid` of the header's metadata. It is a
//! single key because metadata has no order, and equal trainings must give equal bytes.

mod description;

use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::io::Write as _;
use std::path::Path;

use asid_core::{Error, Result};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};

use description::SCHEMA;
pub use description::{ActionEntry, Description, ObservationEntry};

/// A tensor: numbers of some shape, row-major, single precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    /// Lengths of the dimensions.
    pub shape: Vec<usize>,
    /// The numbers.
    pub values: Vec<f32>,
}

impl Tensor {
    /// A tensor of one dimension.
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

/// Key of the description in the metadata.
const KEY: &str = "asid";

/// Content of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Saved {
    /// Description of the training.
    pub description: Description,
    /// The trained numbers.
    pub tensors: Tensors,
}

impl Saved {
    /// The file's bytes; the same numbers and description give the same bytes.
    ///
    /// # Errors
    /// [`Error::Shape`] where a tensor has a different number of values than its shape requires.
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

    /// Parses a file's bytes; an error says what is wrong with them.
    ///
    /// # Errors
    /// Where they are no safetensors file of this program.
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

    /// Writes the file atomically.
    ///
    /// # Errors
    /// [`Error::File`] where it cannot be written.
    pub fn save(&self, path: &Path) -> Result<()> {
        write_atomically(path, &self.to_bytes()?)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::File`] where it cannot be read or is no file of this program.
    pub fn load(path: &Path) -> Result<Self> {
        let wrong = |message: String| Error::File {
            path: path.to_owned(),
            message,
        };
        let bytes = fs::read(path).map_err(|e| wrong(e.to_string()))?;
        Self::from_bytes(&bytes).map_err(wrong)
    }
}

/// Writes a file atomically: to a temporary file beside it, which is then renamed.
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
        // No temporary file is left.
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
