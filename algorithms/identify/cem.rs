//! Identification by the cross-entropy method.

use asid_core::identify::{Assumptions, Identified, Identifier};
use asid_core::registry;
use asid_core::tracker::TrackerPrior;
use asid_core::{Episode, Problem, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::sampling::SamplingSettings;
use super::search::{self, Budget};
use crate::optimise::CemSettings;

/// Settings of identification by CEM.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CemIdentifier {
    /// Refits of the search.
    pub iterations: usize,
    /// Simulations a refit.
    pub population: usize,
    /// Searches anew at most, each of twice the population of the one before, while readings are missed by more than
    /// noise and a model's usual errors explain.
    pub restarts: usize,
    /// Search distribution.
    pub cem: CemSettings,
    /// Deviations of the trackers' systematic errors, which are integrated out.
    pub tracker: TrackerPrior,
    /// Posterior after the search.
    pub sampling: SamplingSettings,
}

impl Default for CemIdentifier {
    fn default() -> Self {
        Self {
            iterations: 5,
            population: 64,
            restarts: 1,
            cem: CemSettings {
                elite_fraction: 0.15,
                ..CemSettings::default()
            },
            tracker: TrackerPrior::default(),
            sampling: SamplingSettings::default(),
        }
    }
}

asid_core::register!(IdentifierEntry {
    name: "cem",
    about: "cross-entropy method, then the posterior by emulation of the likelihood",
    defaults: registry::defaults::<CemIdentifier>,
    meanings: registry::meanings::<CemIdentifier>,
    make: |s| {
        let identifier: CemIdentifier = registry::settings("identifier", s)?;
        identifier.budget().check()?;
        identifier.cem.check("identifier.cem")?;
        identifier.tracker.check("identifier.tracker")?;
        identifier.sampling.check()?;
        Ok(Box::new(identifier))
    },
});

impl CemIdentifier {
    fn budget(&self) -> Budget {
        Budget {
            iterations: self.iterations,
            population: self.population,
            restarts: self.restarts,
        }
    }
}

impl Identifier for CemIdentifier {
    fn identify(&self, problem: &Problem<'_>, episodes: &[Episode]) -> Result<Identified> {
        search::identify(
            problem,
            episodes,
            self.budget(),
            self.tracker,
            &self.sampling,
            &self.cem,
        )
    }
    fn assumes(&self) -> Assumptions {
        Assumptions {
            correlated: self.sampling.correlated,
            tracker: self.tracker,
        }
    }
}
