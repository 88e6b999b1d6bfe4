//! Comparison with Python: the same exploration with Stable-Baselines3 and MuJoCo's bindings, and
//! the same identification with MuJoCo's own toolbox.
//!
//! This folder holds both sides. The Rust side describes each problem in a file ([`problem`]), so
//! that both sides have the same environment steps. It makes the Python side play reference
//! episodes, then measures both in turns in one run. The Python process ([`process`]) stays alive,
//! so neither side measures imports or the compilation of the scene.

mod explore;
mod identify;
mod problem;
mod process;
mod spread;

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, bail};
// Linked algorithms register themselves.
use asid_algorithms as _;
use asid_core::registry::{BackendEntry, find};
use asid_nn as _;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::machine::Circumstances;
use crate::page;
use problem::Described;
use process::Python;

/// Version of the JSON file's layout.
const SCHEMA: u32 = 1;

/// Compared tasks: one with an unknown mass, one with an unknown friction.
const TASKS: [&str; 2] = ["rod-balancing", "sphere-striking"];

/// Threads of each side.
const THREADS: usize = 2;

/// Ways in which the Python side steps its simulations.
///
/// Two are MuJoCo's interfaces to many simulations, under an environment vectorised by hand. The
/// third is an environment of Gymnasium that calls `mj_step`, with one process per episode.
const INTERFACES: [&str; 3] = ["mujoco.rollout", "mujoco.batch", "mj_step"];

/// Extent of the measurements.
struct Effort {
    /// Trainings per side and task.
    rounds: usize,
    /// Environment steps per training.
    steps: usize,
    /// Logs per task.
    logs: usize,
}

/// Deviations of the Python side's reference episodes.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Deviations {
    /// Commands, rad.
    commands: f64,
    /// Positions of the object after each control step, m.
    positions: f64,
    /// Returns, nat.
    returns: f64,
}

/// Largest deviation, rad, between equal commanders. Rounding makes 1e-12.
const SAME_COMMANDS: f64 = 1e-9;
/// Largest deviation, m, between equal paths.
///
/// Each control step of a rollout restarts the solver. This leaves about 1e-10 of a force, which
/// grows with contacts. The tracker's noise is 2 mm.
const SAME_POSITIONS: f64 = 1e-4;

/// Reference episodes of one interface.
#[derive(Clone, Debug, Serialize)]
struct CheckRow {
    task: &'static str,
    interface: &'static str,
    deviations: Deviations,
}

/// All results.
#[derive(Serialize)]
pub struct Results {
    schema: u32,
    circumstances: Circumstances,
    threads: usize,
    checks: Vec<CheckRow>,
    exploration: Vec<explore::Row>,
    identification: Vec<identify::Row>,
}

impl Results {
    /// The page in Markdown.
    pub fn markdown(&self) -> String {
        let head = format!(
            "`{}`, {}\n\n",
            self.circumstances.command,
            self.circumstances.sentence()
        );
        let exploration = page::table(
            "Training a Fisher policy by PPO, two threads",
            &explore::HEADER,
            &explore::table(&self.exploration),
        );
        let identification = page::table(
            "Identification from one episode, two threads",
            &identify::HEADER,
            &identify::table(&self.identification),
        );
        head + &exploration + &identification
    }
}

/// Measures both sides with the Python at this path.
///
/// # Errors
/// If the Python process fails, plays other reference episodes, or an algorithm fails.
pub fn measure(python: &Path, quick: bool) -> Result<Results> {
    let effort = if quick {
        Effort {
            rounds: 1,
            steps: 1280,
            logs: 1,
        }
    } else {
        Effort {
            rounds: 5,
            steps: 5120,
            logs: 8,
        }
    };
    let folder = tempfile::tempdir().context("cannot make a temporary folder")?;
    let backend = (find::<BackendEntry>("mujoco")?.make)()?;
    let mut peer = Python::start(python, folder.path())?;
    let versions: BTreeMap<String, String> = peer.ask(&json!({"do": "start"}))?;
    let mut named: Vec<(String, String)> = versions.into_iter().collect();
    // Both sides have a MuJoCo, and the versions must agree.
    for (name, version) in &mut named {
        if name == "mujoco" && *version != backend.version() {
            bail!(
                "the Python side has MuJoCo {version}, this one {}",
                backend.version()
            );
        }
    }
    let mut results = Results {
        schema: SCHEMA,
        circumstances: Circumstances::now(crate::command(), &named),
        threads: THREADS,
        checks: Vec::new(),
        exploration: Vec::new(),
        identification: Vec::new(),
    };
    for task in TASKS {
        let described = Described::new(task, &*backend, &folder.path().join(task))?;
        for interface in INTERFACES {
            let row = check(&mut peer, &described, interface)?;
            results.checks.push(row);
        }
        let rows = explore::rows(&mut peer, &described, &effort)?;
        results.exploration.extend(rows);
        let rows = identify::rows(&mut peer, &described, &effort)?;
        results.identification.extend(rows);
    }
    Ok(results)
}

/// Makes the peer play the reference episodes and returns its deviations.
fn check(peer: &mut Python, described: &Described, interface: &'static str) -> Result<CheckRow> {
    let request = json!({"do": "check", "problem": described.file, "interface": interface});
    let deviations: Deviations = peer.ask(&request)?;
    if deviations.commands > SAME_COMMANDS || deviations.positions > SAME_POSITIONS {
        bail!(
            "the Python side does other work on {} ({interface}): commands differ by {:e} rad, positions by {:e} m; \
             bench/peers/commander.py has to follow asid-core and the task",
            described.name,
            deviations.commands,
            deviations.positions
        );
    }
    Ok(CheckRow {
        task: described.name,
        interface,
        deviations,
    })
}
