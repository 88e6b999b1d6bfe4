//! What a batch of simulations is set to: the values of parameters, and which episode each simulation is of.

use asid_core::{Model, Parameter, Target};
use asid_effects::refined::counts_episodes;

/// The columns of a batch: targets of parameters, and the number of the episode where the model counts episodes.
#[derive(Clone, Debug)]
pub struct BatchColumns {
    parameters: Vec<Parameter>,
    episode: Option<Target>,
}

impl BatchColumns {
    /// Of a model with some parameters.
    #[must_use]
    pub fn new(model: &dyn Model, parameters: &[Parameter]) -> Self {
        Self {
            parameters: parameters.to_vec(),
            episode: counts_episodes(model),
        }
    }

    /// The targets, in their order.
    #[must_use]
    pub fn targets(&self) -> Vec<Target> {
        let of_parameters = self.parameters.iter().flat_map(|p| &p.targets);
        of_parameters.chain(&self.episode).cloned().collect()
    }

    /// Appends the row of a simulation at some values of the parameters, of an episode by its number.
    pub fn push(&self, theta: &[f64], episode: usize, row: &mut Vec<f64>) {
        for (p, &value) in self.parameters.iter().zip(theta) {
            row.extend(std::iter::repeat_n(p.setting(value), p.targets.len()));
        }
        row.extend(self.episode.iter().map(|_| episode as f64));
    }

    /// That row alone.
    #[must_use]
    pub fn row(&self, theta: &[f64], episode: usize) -> Vec<f64> {
        let mut row = Vec::new();
        self.push(theta, episode, &mut row);
        row
    }
}
