//! Identification by the cross-entropy method.

use asid_core::identify::{Identified, Identifier};
use asid_core::registry::{self, IdentifierEntry};
use asid_core::{Episode, Error, Problem, Result};
use serde::{Deserialize, Serialize};

use super::Likelihood;
use super::sampling::{self, Samples, SamplingSettings};
use crate::optimise::{Cem, CemSettings};

/// Settings of identification by CEM.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CemIdentifier {
    /// Refits of the search.
    pub iterations: usize,
    /// Simulations a refit.
    pub population: usize,
    /// Search distribution.
    pub cem: CemSettings,
    /// Posterior after the search.
    pub sampling: SamplingSettings,
}

impl Default for CemIdentifier {
    fn default() -> Self {
        Self {
            iterations: 5,
            population: 64,
            cem: CemSettings {
                elite_fraction: 0.15,
                ..CemSettings::default()
            },
            sampling: SamplingSettings::default(),
        }
    }
}

inventory::submit! {
    IdentifierEntry {
        name: "cem",
        about: "cross-entropy method, then the posterior by emulation of the likelihood",
        defaults: registry::defaults::<CemIdentifier>,
        make: |s| {
            let identifier: CemIdentifier = registry::settings("identifier", s)?;
            check(identifier.iterations, identifier.population)?;
            identifier.cem.check("identifier.cem")?;
            identifier.sampling.check()?;
            Ok(Box::new(identifier))
        },
    }
}

/// Checks that there is something to search with.
pub(super) fn check(iterations: usize, population: usize) -> Result<()> {
    if iterations == 0 || population < 4 {
        return Err(Error::Config {
            key: "identifier".into(),
            message: format!(
                "needs at least 1 iteration of at least 4 simulations, not {iterations} of {population}"
            ),
        });
    }
    Ok(())
}

impl Identifier for CemIdentifier {
    fn identify(&self, problem: &Problem<'_>, episodes: &[Episode]) -> Result<Identified> {
        let mut likelihood =
            Likelihood::new(problem, episodes, self.population.max(self.sampling.draws))?;
        let (low, high) = likelihood.bounds();
        let n = likelihood.dimension();
        let mut cem = Cem::new(self.cem.clone(), &vec![0.0; n], &vec![1.0; n], &low, &high);
        let mut rng = problem.streams.stream("identify");
        let mut samples = Samples::default();
        let mut iterations = Vec::new();
        let total = self.iterations + self.sampling.rounds;
        problem.progress.begin("identify", total as u64);
        for _ in 0..self.iterations {
            let points = cem.ask(self.population, &mut rng);
            let residuals = likelihood.residuals(&points)?;
            let losses = samples.add(&points, residuals);
            cem.tell(&points, &losses);
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
