//! Identification by covariance matrix adaptation.

use asid_core::identify::{Assumptions, Identified, Identifier};
use asid_core::registry;
use asid_core::tracker::TrackerPrior;
use asid_core::{Episode, Problem, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::sampling::SamplingSettings;
use super::search::{Budget, Course};
use crate::optimise::CmaEsSettings;

/// Settings of identification by CMA-ES.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CmaEsIdentifier {
    /// Refits of the search distribution.
    pub iterations: usize,
    /// Simulations per refit.
    pub population: usize,
    /// Maximum number of restarts, each with twice the population of the one before. The search
    /// restarts while the residuals exceed what noise and a model's usual errors explain.
    pub restarts: usize,
    /// Search distribution.
    pub cma_es: CmaEsSettings,
    /// Standard deviations of the trackers' systematic errors, which are integrated out.
    pub tracker: TrackerPrior,
    /// How the posterior is sampled after the search.
    pub sampling: SamplingSettings,
}

impl Default for CmaEsIdentifier {
    fn default() -> Self {
        Self {
            // As many simulations as the other searches, in more and smaller refits: CMA-ES learns
            // its covariance over many refits, the others from one.
            iterations: 16,
            population: 20,
            restarts: 1,
            cma_es: CmaEsSettings::default(),
            tracker: TrackerPrior::default(),
            sampling: SamplingSettings::default(),
        }
    }
}

asid_core::register!(IdentifierEntry {
    name: "cma-es",
    about: "covariance matrix adaptation, then the posterior by emulation of the likelihood",
    defaults: registry::defaults::<CmaEsIdentifier>,
    meanings: registry::meanings::<CmaEsIdentifier>,
    make: |s| {
        let identifier: CmaEsIdentifier = registry::settings("identifier", s)?;
        identifier.course().check()?;
        identifier.cma_es.check("identifier.cma_es")?;
        Ok(Box::new(identifier))
    },
});

impl CmaEsIdentifier {
    fn course(&self) -> Course<'_, CmaEsSettings> {
        let budget = Budget {
            iterations: self.iterations,
            population: self.population,
            restarts: self.restarts,
        };
        Course {
            budget,
            tracker: self.tracker,
            sampling: &self.sampling,
            rule: &self.cma_es,
        }
    }
}

impl Identifier for CmaEsIdentifier {
    fn identify(&self, problem: &Problem<'_>, episodes: &[Episode]) -> Result<Identified> {
        self.course().identify(problem, episodes)
    }
    fn assumes(&self) -> Assumptions {
        self.course().assumes()
    }
}
