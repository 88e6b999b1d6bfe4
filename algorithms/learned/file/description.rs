//! Description of a trained file: its training, and the problems that it fits.

use std::collections::BTreeMap;

use asid_core::task::Coordinate;
use asid_core::{Parameter, Problem};
use serde::{Deserialize, Serialize};

/// A group of observation entries that belong together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObservationEntry {
    /// What the entries are.
    pub name: String,
    /// Number of entries.
    pub len: usize,
}

/// An entry of an action.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActionEntry {
    /// What the entry is.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Values for the network's outputs -1 and 1, in the unit.
    pub range: [f64; 2],
}

impl ActionEntry {
    /// The entry for a coordinate.
    #[must_use]
    pub fn of(coordinate: &Coordinate) -> Self {
        Self {
            name: coordinate.name.clone(),
            unit: coordinate.unit.clone(),
            range: coordinate.range,
        }
    }

    /// Action in its unit for an output of the network in -1 to 1.
    #[must_use]
    pub fn span(&self, output: f64) -> f64 {
        let [low, high] = self.range;
        low + (output + 1.0) / 2.0 * (high - low)
    }
}

/// Description of a trained file: its training, and what it is for.
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
    /// Version of the program that trained it.
    pub asid: String,
    /// Commit of that program.
    pub git: String,
    /// Seed of the training.
    pub seed: u64,
    /// All settings of the algorithm.
    pub settings: serde_json::Value,
    /// Inputs of the network, in order.
    pub observation: Vec<ObservationEntry>,
    /// Outputs of the network.
    pub action: Vec<ActionEntry>,
    /// The unknowns, with the priors of the training.
    pub parameters: Vec<Parameter>,
    /// Number of simulated control steps in training.
    pub training_steps: u64,
    /// Wall-clock time of the training, s.
    pub seconds: f64,
    /// Figures of the training by name, such as the last mean return.
    pub figures: BTreeMap<String, f64>,
}

/// Layout version of [`Description`].
pub(super) const SCHEMA: u32 = 1;

impl Description {
    /// Description of a training on `problem` that has just ended: names, versions, actions and
    /// unknowns.
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

    /// Why the file cannot be used for `algorithm` on `problem` with these observations, if it
    /// cannot.
    #[must_use]
    pub fn misfit(
        &self,
        algorithm: &str,
        problem: &Problem<'_>,
        observation: &[ObservationEntry],
    ) -> Option<String> {
        if self.algorithm != algorithm {
            return Some(format!(
                "was trained by `{}`, not `{algorithm}`",
                self.algorithm
            ));
        }
        let task = problem.task.name();
        if self.task != task {
            return Some(format!(
                "was trained for the task `{}`, not `{task}`",
                self.task
            ));
        }
        let names =
            |all: &[Parameter]| -> Vec<String> { all.iter().map(|p| p.name.clone()).collect() };
        let (theirs, ours) = (names(&self.parameters), names(problem.parameters));
        if theirs != ours {
            return Some(format!(
                "was trained for the unknowns {}, not {}",
                theirs.join(", "),
                ours.join(", ")
            ));
        }
        if self.observation != observation {
            let len = |all: &[ObservationEntry]| all.iter().map(|e| e.len).sum::<usize>();
            return Some(format!(
                "takes other observations ({} entries) than this task gives ({})",
                len(&self.observation),
                len(observation)
            ));
        }
        let actions = &problem.task.exploration().action;
        let same = self.action.len() == actions.len()
            && self
                .action
                .iter()
                .zip(actions)
                .all(|(a, c)| a.name == c.name);
        if !same {
            return Some(format!("gives other actions than `{task}` takes"));
        }
        None
    }
}
