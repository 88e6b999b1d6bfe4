//! An isolated study: a copy in a folder of its own, from which nothing leads to its label.
//!
//! A method gets this copy and no other path. Older sets keep labels in the folder of the studies.
//! A study is therefore copied file by file, without files that may mention its cause.

use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::rng::Streams;
use asid_core::{Episode, Error};
use asid_effects::RefinedModel;
use asid_mjcf::Plant;
use rand::Rng;
use sha2::{Digest, Sha256};

/// Extensions of files that describe a study to people and are no part of it.
const PROSE: [&str; 4] = ["md", "txt", "json", "html"];

/// Changes to a copy.
#[derive(Clone, Copy, Debug, Default)]
pub struct Treatment {
    /// Divisor of the model's time step.
    pub finer: u32,
    /// Seed of the noise that replaces the readings.
    pub noise: Option<u64>,
}

fn failed(path: &Path, error: &impl ToString) -> anyhow::Error {
    Error::File {
        path: path.to_owned(),
        message: error.to_string(),
    }
    .into()
}

/// Files of a study, sorted: those in its folder and below, without prose.
pub fn files(study: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    let entries = std::fs::read_dir(study).map_err(|e| failed(study, &e))?;
    for entry in entries {
        let path = entry.map_err(|e| failed(study, &e))?.path();
        let prose = path
            .extension()
            .is_some_and(|e| PROSE.iter().any(|p| e == *p));
        let hidden = path
            .file_name()
            .is_some_and(|n| n.to_string_lossy().starts_with('.'));
        if path.is_dir() && !hidden {
            found.extend(files(&path)?);
        } else if !prose && !hidden {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// Digest of a study's files, names and contents.
pub fn digest(study: &Path) -> Result<String> {
    let mut hash = Sha256::new();
    for file in files(study)? {
        let name = file.strip_prefix(study).unwrap_or(&file).to_string_lossy();
        let bytes = std::fs::read(&file).map_err(|e| failed(&file, &e))?;
        for part in [name.as_bytes(), &bytes] {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
    }
    Ok(hex(&hash.finalize()))
}

/// Bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// Copies a study to `to`, which must not exist.
pub fn copy(study: &Path, to: &Path, treatment: Treatment) -> Result<()> {
    for file in files(study)? {
        let place = to.join(file.strip_prefix(study).unwrap_or(&file));
        let parent = place.parent().unwrap_or(to);
        std::fs::create_dir_all(parent).map_err(|e| failed(parent, &e))?;
        std::fs::copy(&file, &place).map_err(|e| failed(&place, &e))?;
    }
    if treatment.finer > 1 || treatment.noise.is_some() {
        treat(to, treatment)?;
    }
    Ok(())
}

fn treat(study: &Path, treatment: Treatment) -> Result<()> {
    let file = study.join("study.toml");
    let text = std::fs::read_to_string(&file).map_err(|e| failed(&file, &e))?;
    let document: toml::Table =
        asid_documents::toml_text::read(&text).map_err(|e| failed(&file, &e))?;
    let model = document
        .get("model")
        .and_then(|m| m.as_str())
        .unwrap_or_default();
    let model = study.join(model);
    let scene = RefinedModel::open(&model)?.scene;
    let plant = Plant::of(&scene)?;
    if treatment.finer > 1 {
        if model.extension().is_some_and(|e| e == "toml") {
            let why = "a refined model keeps its time step: leave out --finer";
            return Err(failed(&model, &why));
        }
        let step = plant.layout.timestep / f64::from(treatment.finer);
        let finer = scene.with_timestep(step)?;
        std::fs::write(&model, finer.xml()).map_err(|e| failed(&model, &e))?;
    }
    if let Some(seed) = treatment.noise {
        let logs = files(study)?
            .into_iter()
            .filter(|f| f.extension().is_some_and(|e| e == "csv"));
        for (i, log) in logs.enumerate() {
            let mut episode = asid_logs::episode::read(&log, &plant.layout)?;
            let mut random = Streams::new(seed).indexed("noise for a log", i as u64);
            turn_to_noise(&mut episode, &mut random);
            episode.write_csv(&log)?;
        }
    }
    Ok(())
}

/// Replaces each column of readings by white noise of the same mean and deviation. A start given by
/// the log is removed.
fn turn_to_noise(episode: &mut Episode, random: &mut impl Rng) {
    let width = episode.width();
    for column in 0..width {
        let present = |x: &f64| x.is_finite();
        let values: Vec<f64> = episode
            .readings
            .iter()
            .skip(column)
            .step_by(width)
            .copied()
            .collect();
        let values: Vec<f64> = values.into_iter().filter(present).collect();
        let n = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / n;
        let deviation = (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
        let column = episode.readings.iter_mut().skip(column).step_by(width);
        for x in column.filter(|x| x.is_finite()) {
            // Box-Muller transform.
            let (u, v): (f64, f64) = (1.0 - random.random::<f64>(), random.random());
            let normal = (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos();
            *x = mean + deviation * normal;
        }
    }
    episode.initial = None;
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_copy_has_the_study_and_nothing_that_speaks_of_it() {
        let folder = tempfile::tempdir().unwrap();
        let (study, to) = (folder.path().join("a"), folder.path().join("b"));
        std::fs::create_dir_all(study.join("meshes")).unwrap();
        for name in [
            "study.toml",
            "labels.json",
            "README.md",
            "train_0.csv",
            ".seal",
            "meshes/arm.stl",
        ] {
            std::fs::write(study.join(name), name).unwrap();
        }
        let before = digest(&study).unwrap();
        copy(&study, &to, Treatment::default()).unwrap();
        let copied: Vec<String> = files(&to)
            .unwrap()
            .iter()
            .map(|f| f.strip_prefix(&to).unwrap().display().to_string())
            .collect();
        assert_eq!(copied, ["meshes/arm.stl", "study.toml", "train_0.csv"]);
        assert_eq!(before, digest(&to).unwrap());
        std::fs::write(to.join("train_0.csv"), "other").unwrap();
        assert_ne!(before, digest(&to).unwrap());
    }
}
