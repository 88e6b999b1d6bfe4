//! Compares the motions of `asid explore` with the field's baselines, on models that others wrote.
//!
//! ```sh
//! python3 sysid/examples/motions/fetch.py MODELS
//! cargo run --release --features mujoco --example motions -- MODELS OUT [SEEDS [NAME…]]
//! ```
//!
//! Each `NAME.toml` beside this file is a `--config` of `asid explore` for the model
//! `MODELS/NAME.xml`. Motions are designed for each as by `asid explore`, by the default method and
//! by the baselines; random methods draw a new motion for each seed. For each seed (default 20) a
//! true machine is drawn from the ranges of the unknowns. It plays the motion, is read with noise,
//! and is identified by the code of `asid identify`; limits are checked after every physics step.
//! Errors are in standard deviations of the prior, and a machine's figure is the root mean square
//! over its unknowns. Motions and worlds are files in OUT, and a later call continues from the
//! files that exist. The tables go to standard output.

// Printing a table on standard output is the purpose of this program.
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod machine;
mod motion;
mod table;
mod world;

use std::error::Error;
use std::path::{Path, PathBuf};

use asid::sysid::method::Method;

use crate::machine::Machine;
use crate::table::Row;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Default number of seeds.
const SEEDS: u64 = 20;

/// Threads of every design and fit.
///
/// Those of a small computer, on which a design should take at most two minutes.
const THREADS: usize = 2;

fn main() -> Outcome<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [models, out, rest @ ..] = &arguments[..] else {
        return Err("usage: motions MODELS OUT [SEEDS [NAME…]]".into());
    };
    let seeds: u64 = rest.first().map_or(Ok(SEEDS), |s| s.parse())?;
    let names = rest.get(1..).unwrap_or_default();
    let mut rows = Vec::new();
    for case in cases()? {
        let name = case.file_stem().unwrap_or_default().to_string_lossy();
        if !names.is_empty() && !names.iter().any(|n| *n == name) {
            continue;
        }
        let model = Path::new(models).join(format!("{name}.xml"));
        rows.extend(compared(
            &model,
            &case,
            &Path::new(out).join(&*name),
            seeds,
        )?);
        print!("{}", table::markdown(&rows));
    }
    Ok(())
}

/// The settings files beside this one, sorted by name.
fn cases() -> Outcome<Vec<PathBuf>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("sysid/examples/motions");
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e == "toml") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// Results of all methods for one machine.
fn compared(model: &Path, case: &Path, folder: &Path, seeds: u64) -> Outcome<Vec<Row>> {
    std::fs::create_dir_all(folder)?;
    let machine = Machine::open(model, case)?;
    let mut setup = machine.setup(THREADS)?;
    let name = machine.subject.name.clone();
    for note in &setup.notes {
        eprintln!("{name}: {note}");
    }
    let mut rows = Vec::new();
    for (label, method) in Method::ALL {
        let (mut motions, mut worlds) = (Vec::new(), Vec::new());
        for seed in 0..seeds {
            let drawn = matches!(method, Method::Random | Method::Fourier);
            let design = if drawn { seed } else { 0 };
            let motion = motion::designed(&machine, &mut setup, (label, method), design, folder)?;
            let world = world::met(&machine, &mut setup, (label, &motion), seed, folder)?;
            eprintln!(
                "{name} {label} {seed}: expected {:.4}, error {:.4}, {:.0} s{}",
                motion.figure(),
                world.figure(),
                world.wall_s,
                world
                    .broken
                    .as_ref()
                    .map_or(String::new(), |b| format!(", BROKEN {b}"))
            );
            if usize::try_from(design).is_ok_and(|d| d == motions.len()) {
                motions.push(motion);
            }
            worlds.push(world);
        }
        rows.push(Row {
            machine: name.clone(),
            method: label.to_owned(),
            unknowns: setup.parameters.len(),
            motions,
            worlds,
        });
    }
    Ok(rows)
}
