//! Plays a trained policy in the real world.

use std::sync::Arc;

use asid_core::explore::{Explored, Policy as Plays};
use asid_core::{Error, Problem, Result};
use serde_json::json;

use crate::file::{ActionEntry, Saved};
use crate::learning;
use crate::policy::Policy;

/// Name of the policy's tensors in a file.
pub const POLICY: &str = "policy";

/// Turns tracker readings into a policy's observations.
pub trait Observe: Send {
    /// Writes the observation for a reading's row before control step `step`.
    ///
    /// # Errors
    /// When a simulation that runs along fails.
    fn observe(&mut self, step: usize, reading: &[f64], observation: &mut [f64]) -> Result<()>;

    /// Receives the action that was taken, in the task's units.
    ///
    /// # Errors
    /// When a simulation that runs along fails.
    fn acted(&mut self, _action: &[f64]) -> Result<()> {
        Ok(())
    }
}

/// A network that acts on the observations of an [`Observe`].
pub struct Playing<'a> {
    saved: Arc<Saved>,
    network: Policy,
    actions: Vec<ActionEntry>,
    observe: Box<dyn Observe + 'a>,
    observation: Vec<f64>,
}

impl<'a> Playing<'a> {
    /// Policy of a file that fits its problem.
    ///
    /// # Errors
    /// [`Error::Failed`] where the file's numbers do not fit its own description.
    pub fn new(saved: Arc<Saved>, observe: Box<dyn Observe + 'a>) -> Result<Self> {
        let d = &saved.description;
        let network = network(&saved)?;
        let inputs = d.observation.iter().map(|e| e.len).sum();
        if network.observation_len() != inputs || network.action_len() != d.action.len() {
            return Err(Error::Failed(format!(
                "the policy of `{}` takes {} entries and gives {}, its description says {inputs} and {}",
                d.algorithm,
                network.observation_len(),
                network.action_len(),
                d.action.len()
            )));
        }
        Ok(Self {
            observation: vec![0.0; inputs],
            actions: d.action.clone(),
            network,
            observe,
            saved,
        })
    }

    /// The same policy as the result of an explorer.
    ///
    /// # Errors
    /// As [`Playing::new`].
    pub fn explored(
        saved: Arc<Saved>,
        observe: Box<dyn Observe + 'a>,
        objective: String,
    ) -> Result<Explored<'a>> {
        Ok(Explored {
            curve: learning::curve(&saved),
            curve_label: "environment steps",
            objective,
            policy: Box::new(Self::new(saved, observe)?),
        })
    }
}

/// The policy stored in a file.
///
/// # Errors
/// [`Error::Failed`] where the file holds none.
pub fn network(saved: &Saved) -> Result<Policy> {
    Policy::from_tensors(POLICY, &saved.tensors)
        .map_err(|why| Error::Failed(format!("the file {why}")))
}

/// A problem's action entries with their ranges, to which a training maps the network's outputs.
#[must_use]
pub fn actions(problem: &Problem<'_>) -> Vec<ActionEntry> {
    let coordinates = problem.task.exploration().action.iter();
    coordinates.map(ActionEntry::of).collect()
}

impl Plays for Playing<'_> {
    fn reset(&mut self) {}

    fn act(&mut self, step: usize, reading: &[f64], action: &mut [f64]) -> Result<()> {
        self.observe.observe(step, reading, &mut self.observation)?;
        self.network.act(&self.observation, action)?;
        for (a, entry) in action.iter_mut().zip(&self.actions) {
            *a = entry.span(*a);
        }
        self.observe.acted(action)
    }

    /// `{"kind": "network", "observation": [{"name", "len"}], "action": [{"name", "unit",
    /// "range"}], "network": …, "trained": …}`.
    ///
    /// The network is in the format of [`Policy`]: a normaliser `(x - mean) / sqrt(variance +
    /// 1e-8)`, clipped at plus and minus 10 (none where `count` is 0), then layers `y = x W + b`
    /// (`weight` is inputs x outputs, row by row) with tanh between them. The outputs, clipped to
    /// -1 to 1, span each action's range. `trained` describes the training.
    fn export(&self) -> serde_json::Value {
        let d = &self.saved.description;
        json!({
            "kind": "network",
            "observation": d.observation,
            "action": d.action,
            "network": self.network,
            "trained": {
                "algorithm": d.algorithm,
                "engine": d.engine,
                "asid": d.asid,
                "git": d.git,
                "seed": d.seed,
                "settings": d.settings,
                "steps": d.training_steps,
                "seconds": d.seconds,
                "figures": d.figures,
            },
        })
    }
}
