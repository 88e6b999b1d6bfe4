//! Beside Python: the same exploration with Stable-Baselines3 and MuJoCo's bindings, and the
//! same identification with MuJoCo's own toolbox.
//!
//! This folder holds both sides. The Rust side describes each problem in a file ([`problem`]),
//! so that the Python side cannot differ in what an environment step is, has it play reference
//! episodes, and then measures both in turns, in one run. The Python process ([`process`]) stays
//! alive: imports and compilation of the scene are not measured on either side.

mod explore;
mod identify;
mod problem;
mod process;
mod spread;

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, bail};
// Algorithms that are linked in register themselves.
use asid_algorithms as _;
use asid_core::registry::{BackendEntry, find};
use asid_nn as _;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::machine::Circumstances;
use crate::page;
use problem::Described;
use process::Python;

/// Layout version of the JSON file.
const SCHEMA: u32 = 1;

/// Tasks that are compared: one whose unknown is a mass, one whose unknown is a friction.
const TASKS: [&str; 2] = ["rod-balancing", "sphere-striking"];

/// Threads of either side.
const THREADS: usize = 2;

/// How the Python side steps its simulations: MuJoCo's two interfaces to many simulations under an environment
/// vectorised by hand, and an environment of Gymnasium with `mj_step` in a process of its own for each episode.
const INTERFACES: [&str; 3] = ["mujoco.rollout", "mujoco.batch", "mj_step"];

/// How much is measured.
struct Effort {
    /// Trainings of each side and task.
    rounds: usize,
    /// Environment steps of a training.
    steps: usize,
    /// Logs of each task.
    logs: usize,
}

/// What the Python side's reference episodes were off by.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Deviations {
    /// Commands, rad.
    commands: f64,
    /// Positions of the object after each control step, m.
    positions: f64,
    /// Returns, nat.
    returns: f64,
}

/// A commander that differs by more, rad, is another commander. Rounding makes 1e-12.
const SAME_COMMANDS: f64 = 1e-9;
/// A path that differs by more, m, is another path. Each control step of a rollout starts the solver anew, and what
/// that leaves, some 1e-10 of a force, grows with contacts; the tracker's noise is 2 mm.
const SAME_POSITIONS: f64 = 1e-4;

/// One interface's reference episodes.
#[derive(Clone, Debug, Serialize)]
struct CheckRow {
    task: &'static str,
    interface: &'static str,
    deviations: Deviations,
}

/// Everything measured.
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
    /// The page.
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

/// Measures both sides with the Python of this path.
///
/// # Errors
/// When the Python process fails, plays other reference episodes, or an algorithm fails.
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
    // Both sides have a MuJoCo, and they must be one version.
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

/// Has the peer play the reference episodes.
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
