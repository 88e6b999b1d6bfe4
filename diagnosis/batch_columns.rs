//! What a batch of simulations is set to: the values of parameters, and the episode of each
//! simulation.

use asid_core::{Model, Parameter, Target};
use asid_effects::refined::counts_episodes;

/// Columns of a batch: targets of parameters, and the episode's number if the model counts
/// episodes.
#[derive(Clone, Debug)]
pub struct BatchColumns {
    parameters: Vec<Parameter>,
    episode: Option<Target>,
}

impl BatchColumns {
    /// Makes the columns of a model with some parameters.
    #[must_use]
    pub fn new(model: &dyn Model, parameters: &[Parameter]) -> Self {
        Self {
            parameters: parameters.to_vec(),
            episode: counts_episodes(model),
        }
    }

    /// Returns the targets, in the order of the columns.
    #[must_use]
    pub fn targets(&self) -> Vec<Target> {
        let of_parameters = self.parameters.iter().flat_map(|p| &p.targets);
        of_parameters.chain(&self.episode).cloned().collect()
    }

    /// Appends the row of a simulation: values of the parameters, and the episode's number.
    pub fn push(&self, theta: &[f64], episode: usize, row: &mut Vec<f64>) {
        for (p, &value) in self.parameters.iter().zip(theta) {
            row.extend(std::iter::repeat_n(p.setting(value), p.targets.len()));
        }
        row.extend(self.episode.iter().map(|_| episode as f64));
    }

    /// Returns that row alone.
    #[must_use]
    pub fn row(&self, theta: &[f64], episode: usize) -> Vec<f64> {
        let mut row = Vec::new();
        self.push(theta, episode, &mut row);
        row
    }
}
