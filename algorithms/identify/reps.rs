//! Identification by relative entropy policy search over the simulator's parameters.

use asid_core::identify::{Identified, Identifier};
use asid_core::registry::{self, IdentifierEntry};
use asid_core::{Episode, Problem, Result};
use serde::{Deserialize, Serialize};

use super::Likelihood;
use super::sampling::{self, Samples, SamplingSettings};
use crate::optimise::{Reps, RepsSettings};

/// Settings of identification by REPS.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RepsIdentifier {
    /// Refits of the search.
    pub iterations: usize,
    /// Simulations a refit.
    pub population: usize,
    /// Step of the search; the reward is the log-likelihood.
    pub reps: RepsSettings,
    /// Posterior after the search.
    pub sampling: SamplingSettings,
}

impl Default for RepsIdentifier {
    fn default() -> Self {
        Self {
            iterations: 5,
            population: 64,
            reps: RepsSettings {
                epsilon: 1.5,
                min_eta: 1.0,
            },
            sampling: SamplingSettings::default(),
        }
    }
}

inventory::submit! {
    IdentifierEntry {
        name: "reps",
        about: "relative entropy policy search, then the posterior by emulation of the likelihood",
        defaults: registry::defaults::<RepsIdentifier>,
        make: |s| {
            let identifier: RepsIdentifier = registry::settings("identifier", s)?;
            super::cem::check(identifier.iterations, identifier.population)?;
            identifier.reps.check("identifier.reps")?;
            identifier.sampling.check()?;
            Ok(Box::new(identifier))
        },
    }
}

impl Identifier for RepsIdentifier {
    fn identify(&self, problem: &Problem<'_>, episodes: &[Episode]) -> Result<Identified> {
        let mut likelihood =
            Likelihood::new(problem, episodes, self.population.max(self.sampling.draws))?;
        let (low, high) = likelihood.bounds();
        let n = likelihood.dimension();
        let mut reps = Reps::new(self.reps.clone(), &vec![0.0; n], &vec![1.0; n], &low, &high);
        let mut rng = problem.streams.stream("identify");
        let mut samples = Samples::default();
        let mut iterations = Vec::new();
        problem
            .progress
            .begin("identify", (self.iterations + self.sampling.rounds) as u64);
        for _ in 0..self.iterations {
            let points = reps.ask(self.population, &mut rng);
            let residuals = likelihood.residuals(&points)?;
            let losses = samples.add(&points, residuals);
            let rewards: Vec<f64> = losses.iter().map(|l| -l).collect();
            reps.tell(&points, &rewards);
            iterations.push(sampling::summary(&likelihood, &points, samples.best_loss()));
            problem.progress.advance(1);
        }
        let found = sampling::posterior(
            problem,
            &mut likelihood,
            &self.sampling,
            samples,
            iterations,
            &mut rng,
        );
        problem.progress.end();
        found
    }
}
