//! A set of cases on disk: studies and their seal in one folder, labels in another.
//!
//! ```text
//! DIR/studies/seal.json            commitments; no label can be read from it
//! DIR/studies/case-0000/           study.toml, nominal.xml, train_*.csv, test_*.csv
//! DIR/sealed/labels.json           labels and salts; readable by the owner alone
//! DIR/sealed/set.json              half, seed, count
//! ```
//! A diagnosis is given `DIR/studies`.

use std::collections::BTreeMap;
use std::path::Path;

use rayon::prelude::*;
use serde::Serialize;

use crate::case;
use crate::error::{Error, Result};
use crate::label::Label;
use crate::machine::{Half, Machine};
use crate::plan::Plan;
use crate::seal::{LABELS, SEAL, Seal, commitment, digest};

/// Folder of the studies, and that of the labels.
pub const STUDIES: &str = "studies";
/// Folder of the labels.
pub const SEALED: &str = "sealed";

/// What set this is; for who may read the labels.
#[derive(Serialize)]
struct Set {
    schema: u32,
    half: Half,
    seed: u64,
    count: usize,
}

/// What was made.
#[derive(Debug, Serialize)]
pub struct Made {
    /// Cases that were written.
    pub cases: usize,
    /// Cases of which no draw was usable, with the reason; they are not in the set.
    pub exhausted: Vec<String>,
    /// Seconds that each case took.
    pub seconds: Vec<f64>,
}

impl Made {
    /// What was made, for people.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let mut sorted = self.seconds.clone();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| sorted.get((share * sorted.len() as f64) as usize).copied();
        let mut lines = vec![format!(
            "{} cases; seconds a case: median {:.2}, nine in ten below {:.2}, sum {:.0}",
            self.cases,
            at(0.5).unwrap_or(0.0),
            at(0.9).unwrap_or(0.0),
            sorted.iter().sum::<f64>(),
        )];
        lines.extend(self.exhausted.iter().map(|e| format!("left out: {e}")));
        lines
    }
}

/// Runs something with so many threads; 0 for as many as there are cores.
///
/// # Errors
/// Those of what is run.
pub fn with_threads<T: Send>(threads: usize, run: impl FnOnce() -> Result<T> + Send) -> Result<T> {
    match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(run),
        Err(_) => run(),
    }
}

fn failed(path: &Path, error: &impl ToString) -> Error {
    Error::File {
        path: path.to_owned(),
        message: error.to_string(),
    }
}

/// Writes a file whole or not at all.
fn write(path: &Path, text: &str) -> Result<()> {
    let part = path.with_extension("part");
    std::fs::write(&part, text).map_err(|e| failed(&part, &e))?;
    std::fs::rename(&part, path).map_err(|e| failed(path, &e))
}

fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value).map_err(|e| failed(path, &e))?;
    write(path, &(text + "\n"))
}

/// Makes a set of cases in a folder that is not there yet or is empty, of the machines of a half and of those
/// `outside` of the project. `done` is called after each case.
///
/// # Errors
/// Where the folder holds something, a file cannot be written or a model is wrong.
pub fn make(
    folder: &Path,
    half: Half,
    seed: u64,
    count: usize,
    outside: &[&'static Machine],
    done: &(dyn Fn() + Sync),
) -> Result<Made> {
    let studies = folder.join(STUDIES);
    let sealed = folder.join(SEALED);
    if std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some()) {
        return Err(failed(folder, &"is not empty; name a new folder"));
    }
    for path in [&studies, &sealed] {
        std::fs::create_dir_all(path).map_err(|e| failed(path, &e))?;
    }
    close(&sealed)?;
    let plan = Plan::draw(half, seed, count, outside)?;
    let digits = count.saturating_sub(1).to_string().len().max(3);
    let results: Vec<Result<(String, Label, String, f64)>> = (0..count)
        .into_par_iter()
        .map(|number| {
            let clock = std::time::Instant::now();
            let case = case::make(&plan, seed, number)?;
            let name = format!("case-{number:0digits$}");
            let path = studies.join(&name);
            std::fs::create_dir_all(&path).map_err(|e| failed(&path, &e))?;
            for (file, text) in &case.study {
                write(&path.join(file), text)?;
            }
            let seal = commitment(&name, &digest(&case.study), &case.label);
            done();
            Ok((name, case.label, seal, clock.elapsed().as_secs_f64()))
        })
        .collect();
    let (mut labels, mut seals) = (BTreeMap::new(), BTreeMap::new());
    let (mut exhausted, mut seconds) = (Vec::new(), Vec::new());
    for result in results {
        match result {
            Ok((name, label, seal, took)) => {
                labels.insert(name.clone(), label);
                seals.insert(name, seal);
                seconds.push(took);
            }
            Err(error @ Error::Exhausted { .. }) => exhausted.push(error.to_string()),
            Err(other) => return Err(other),
        }
    }
    write_json(&sealed.join(LABELS), &labels)?;
    let set = Set {
        schema: 1,
        half,
        seed,
        count,
    };
    write_json(&sealed.join("set.json"), &set)?;
    let seal = Seal {
        schema: 1,
        commitment: "SHA-256 of salt, case, digest of the study's files, label".into(),
        cases: seals,
    };
    write_json(&studies.join(SEAL), &seal)?;
    Ok(Made {
        cases: labels.len(),
        exhausted,
        seconds,
    })
}

/// Lets nobody but the owner read a folder.
#[cfg(unix)]
fn close(folder: &Path) -> Result<()> {
    use std::os::unix::fs::PermissionsExt;
    let owner = std::fs::Permissions::from_mode(0o700);
    std::fs::set_permissions(folder, owner).map_err(|e| failed(folder, &e))
}

/// Where there are no such permissions the folder is only apart.
#[cfg(not(unix))]
fn close(_folder: &Path) -> Result<()> {
    Ok(())
}
