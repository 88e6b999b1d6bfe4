//! The seal binds labels to studies before anybody has seen a label.
//!
//! Beside the studies lies `seal.json`, which holds a commitment for each case. It is the SHA-256
//! of a salt, the case's name, its study's files and its label. The salt lies with the labels.
//! Without it a commitment reveals nothing about a label, not even to somebody who tries all
//! labels. With it anyone can verify that neither label nor study was changed afterwards.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::error::{Error, Result};
use crate::label::Label;

/// Name of the seal's file, beside the studies.
pub const SEAL: &str = "seal.json";
/// Name of the labels' file.
pub const LABELS: &str = "labels.json";

/// The seal of a set of cases.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seal {
    /// Version of the format: 1.
    pub schema: u32,
    /// How a commitment is computed.
    pub commitment: String,
    /// Commitments by case.
    pub cases: BTreeMap<String, String>,
}

/// Bytes as hexadecimal digits.
#[must_use]
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// Digest of a study: names and contents of its files, sorted by name.
#[must_use]
pub fn digest(files: &BTreeMap<String, String>) -> [u8; 32] {
    let mut hash = Sha256::new();
    for (name, text) in files {
        for part in [name.as_bytes(), text.as_bytes()] {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
    }
    hash.finalize().into()
}

/// The commitment of a case.
#[must_use]
pub fn commitment(case: &str, study: &[u8; 32], label: &Label) -> String {
    let bare = Label {
        salt: String::new(),
        ..label.clone()
    };
    // Numbers are written so that they are read back to the bit. Keys are sorted or in the order of
    // the type. The text is therefore the same on every machine.
    let text = serde_json::to_string(&bare).unwrap_or_default();
    let mut hash = Sha256::new();
    for part in [
        label.salt.as_bytes(),
        case.as_bytes(),
        study,
        text.as_bytes(),
    ] {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    }
    hex(&hash.finalize())
}

/// Checks the seal of a set; returns what is wrong, or nothing.
///
/// # Errors
/// If a file cannot be read.
pub fn verify(studies: &Path, labels: &Path) -> Result<Vec<String>> {
    let seal: Seal = read(&studies.join(SEAL))?;
    let labels: BTreeMap<String, Label> = read(labels)?;
    let mut wrong = Vec::new();
    for case in labels.keys().filter(|c| !seal.cases.contains_key(*c)) {
        wrong.push(format!("{case}: a label without a seal"));
    }
    for (case, sealed) in &seal.cases {
        let Some(label) = labels.get(case) else {
            wrong.push(format!("{case}: no label"));
            continue;
        };
        let study = digest(&files(&studies.join(case))?);
        if commitment(case, &study, label) != *sealed {
            wrong.push(format!("{case}: the study or its label was changed"));
        }
    }
    Ok(wrong)
}

fn failed(path: &Path, error: &impl ToString) -> Error {
    Error::File {
        path: path.to_owned(),
        message: error.to_string(),
    }
}

fn read<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T> {
    let text = std::fs::read_to_string(path).map_err(|e| failed(path, &e))?;
    serde_json::from_str(&text).map_err(|e| failed(path, &e))
}

/// Names and contents of a study's files.
///
/// # Errors
/// If a file cannot be read.
pub(crate) fn files(folder: &Path) -> Result<BTreeMap<String, String>> {
    let entries = std::fs::read_dir(folder).map_err(|e| failed(folder, &e))?;
    let paths: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    let mut found = BTreeMap::new();
    for path in paths {
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let text = std::fs::read_to_string(&path).map_err(|e| failed(&path, &e))?;
        found.insert(name, text);
    }
    Ok(found)
}
