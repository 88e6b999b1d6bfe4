//! A set of cases on disk: studies and their seal in one folder, labels in another.
//!
//! ```text
//! DIR/studies/seal.json            commitments; no label can be read from it
//! DIR/studies/case-0000/           study.toml, nominal.xml, train_*.csv, test_*.csv
//! DIR/sealed/labels.json           labels and salts; readable by the owner alone
//! DIR/sealed/set.json              half, seed, count
//! DIR/sealed/case-0000.json        label of a case that is made, until the set is complete
//! ```
//! A diagnosis is given `DIR/studies`. An interrupted set can be continued: a case that has a label
//! in `DIR/sealed` is not made again.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::case;
use crate::error::{Error, Result};
use crate::label::Label;
use crate::machine::{Half, Machine};
use crate::plan::{Plan, Wanted};
use crate::seal::{LABELS, SEAL, Seal, commitment, digest, files};

/// Folder of the studies.
pub const STUDIES: &str = "studies";
/// Folder of the labels.
pub const SEALED: &str = "sealed";

/// Name of the file that describes the set.
const SET: &str = "set.json";

/// Description of the set, kept with the labels.
#[derive(PartialEq, Serialize, Deserialize)]
struct Set {
    schema: u32,
    half: Half,
    seed: u64,
    count: usize,
    /// Machines that other authors modelled.
    outside: Vec<String>,
    /// Which cases of the wheels the set takes.
    #[serde(default, skip_serializing_if = "Wanted::is_all")]
    wanted: Wanted,
}

/// Describes the set to be made.
#[derive(Clone, Debug)]
pub struct Order {
    /// Half of the machines.
    pub half: Half,
    /// Seed of all random draws.
    pub seed: u64,
    /// Number of cases.
    pub count: usize,
    /// Which cases of the wheels the set takes.
    pub wanted: Wanted,
}

/// A finished case.
struct Sealed {
    label: Label,
    seal: String,
    seconds: f64,
}

/// The result of making a set.
#[derive(Debug, Serialize)]
pub struct Made {
    /// Cases that were written.
    pub cases: usize,
    /// Cases that could not be made, with the reason; they are not in the set.
    ///
    /// Either no draw was usable, or MuJoCo refuses the world.
    pub left_out: Vec<String>,
    /// Seconds that each case took; 0 if it was left by an earlier run.
    pub seconds: Vec<f64>,
}

impl Made {
    /// Summary lines for the user.
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
        lines.extend(self.left_out.iter().map(|e| format!("left out: {e}")));
        lines
    }
}

/// Runs a closure with a number of threads; 0 stands for the number of cores.
///
/// # Errors
/// Returns those of the closure.
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

/// Writes a file completely or not at all.
fn write(path: &Path, text: &str) -> Result<()> {
    let part = path.with_extension("part");
    std::fs::write(&part, text).map_err(|e| failed(&part, &e))?;
    std::fs::rename(&part, path).map_err(|e| failed(path, &e))
}

fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value).map_err(|e| failed(path, &e))?;
    write(path, &(text + "\n"))
}

/// Makes a set of cases from the machines of a half and the machines `outside`. Calls `done` after
/// each case.
///
/// The folder must be new, be empty or hold a part of the same set.
///
/// # Errors
/// If the folder holds something else, or if a file cannot be written.
pub fn make(
    folder: &Path,
    order: &Order,
    outside: &[&'static Machine],
    done: &(dyn Fn() + Sync),
) -> Result<Made> {
    let Order {
        half,
        seed,
        count,
        wanted,
    } = order.clone();
    let plan = Plan::draw_wanted(half, (seed, count), outside, &wanted)?;
    let set = Set {
        schema: 1,
        half,
        seed,
        count,
        outside: outside.iter().map(|m| m.name.to_owned()).collect(),
        wanted,
    };
    let [studies, sealed] = open(folder, &set)?;
    let digits = count.saturating_sub(1).to_string().len().max(3);
    let results: Vec<Result<(String, Sealed)>> = (0..count)
        .into_par_iter()
        .map(|number| {
            let name = format!("case-{number:0digits$}");
            let study = studies.join(&name);
            let label = sealed.join(&name).with_extension("json");
            let made = match kept(&name, &study, &label)? {
                Some(kept) => kept,
                None => case(&plan, (seed, number), &name, (&study, &label))?,
            };
            done();
            Ok((name, made))
        })
        .collect();
    let (mut labels, mut seals) = (BTreeMap::new(), BTreeMap::new());
    let (mut left_out, mut seconds) = (Vec::new(), Vec::new());
    for (number, result) in results.into_iter().enumerate() {
        match result {
            Ok((name, made)) if !order.wanted.takes_label(&made.label) => {
                let study = studies.join(&name);
                std::fs::remove_dir_all(&study).map_err(|e| failed(&study, &e))?;
                let label = sealed.join(&name).with_extension("json");
                std::fs::remove_file(&label).map_err(|e| failed(&label, &e))?;
                left_out.push(format!("case {number}: no wanted cause could be sized"));
            }
            Ok((name, made)) => {
                labels.insert(name.clone(), made.label);
                seals.insert(name, made.seal);
                seconds.push(made.seconds);
            }
            Err(error @ Error::File { .. }) => return Err(error),
            Err(error @ Error::Exhausted { .. }) => left_out.push(error.to_string()),
            Err(other) => left_out.push(format!("case {number}: {other}")),
        }
    }
    let seal = Seal {
        schema: 1,
        commitment: "SHA-256 of salt, case, digest of the study's files, label".into(),
        cases: seals,
    };
    write_json(&studies.join(SEAL), &seal)?;
    write_json(&sealed.join(LABELS), &labels)?;
    for name in labels.keys() {
        let part = sealed.join(name).with_extension("json");
        std::fs::remove_file(&part).map_err(|e| failed(&part, &e))?;
    }
    Ok(Made {
        cases: labels.len(),
        left_out,
        seconds,
    })
}

/// The folders of a set's studies and labels; creates them if they are missing.
fn open(folder: &Path, set: &Set) -> Result<[PathBuf; 2]> {
    let studies = folder.join(STUDIES);
    let sealed = folder.join(SEALED);
    let own = sealed.join(SET);
    let begun = std::fs::read_to_string(&own).ok();
    let begun = begun.and_then(|text| serde_json::from_str::<Set>(&text).ok());
    let is_part = begun.is_some_and(|b| b == *set) && !sealed.join(LABELS).exists();
    if !is_part && std::fs::read_dir(folder).is_ok_and(|mut e| e.next().is_some()) {
        let message = "holds another set, or a whole one; name a new folder";
        return Err(failed(folder, &message));
    }
    for path in [&studies, &sealed] {
        std::fs::create_dir_all(path).map_err(|e| failed(path, &e))?;
    }
    close(&sealed)?;
    write_json(&own, set)?;
    Ok([studies, sealed])
}

/// A case that an earlier run made, if there is one.
fn kept(name: &str, study: &Path, label: &Path) -> Result<Option<Sealed>> {
    let Ok(text) = std::fs::read_to_string(label) else {
        return Ok(None);
    };
    let label: Label = serde_json::from_str(&text).map_err(|e| failed(label, &e))?;
    Ok(Some(Sealed {
        seal: commitment(name, &digest(&files(study)?), &label),
        label,
        seconds: 0.0,
    }))
}

/// Makes a case; writes its study, then its label.
fn case(
    plan: &Plan,
    (seed, number): (u64, usize),
    name: &str,
    (study, label): (&Path, &Path),
) -> Result<Sealed> {
    let clock = std::time::Instant::now();
    let case = case::make(plan, seed, number)?;
    if study.exists() {
        // Remove what an interrupted run left.
        std::fs::remove_dir_all(study).map_err(|e| failed(study, &e))?;
    }
    std::fs::create_dir_all(study).map_err(|e| failed(study, &e))?;
    for (file, text) in &case.study {
        write(&study.join(file), text)?;
    }
    write_json(label, &case.label)?;
    Ok(Sealed {
        seal: commitment(name, &digest(&case.study), &case.label),
        label: case.label,
        seconds: clock.elapsed().as_secs_f64(),
    })
}

/// Makes a folder readable by its owner alone.
#[cfg(unix)]
fn close(folder: &Path) -> Result<()> {
    use std::os::unix::fs::PermissionsExt;
    let owner = std::fs::Permissions::from_mode(0o700);
    std::fs::set_permissions(folder, owner).map_err(|e| failed(folder, &e))
}

/// On systems without such permissions the folder is only separate.
#[cfg(not(unix))]
fn close(_folder: &Path) -> Result<()> {
    Ok(())
}
