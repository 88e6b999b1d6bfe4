//! Identification by the cross-entropy method.

use asid_core::identify::{Assumptions, Identified, Identifier};
use asid_core::registry;
use asid_core::tracker::TrackerPrior;
use asid_core::{Episode, Problem, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::sampling::SamplingSettings;
use super::search::{Budget, Course};
use crate::optimise::CemSettings;

/// Settings of identification by CEM.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CemIdentifier {
    /// Refits of the search distribution.
    pub iterations: usize,
    /// Simulations per refit.
    pub population: usize,
    /// Maximum number of restarts, each with twice the population of the one before. The search
    /// restarts while the residuals exceed what noise and a model's usual errors explain.
    pub restarts: usize,
    /// Search distribution.
    pub cem: CemSettings,
    /// Standard deviations of the trackers' systematic errors, which are integrated out.
    pub tracker: TrackerPrior,
    /// How the posterior is sampled after the search.
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
        identifier.course().check()?;
        identifier.cem.check("identifier.cem")?;
        Ok(Box::new(identifier))
    },
});

impl CemIdentifier {
    fn course(&self) -> Course<'_, CemSettings> {
        let budget = Budget {
            iterations: self.iterations,
            population: self.population,
            restarts: self.restarts,
        };
        Course {
            budget,
            tracker: self.tracker,
            sampling: &self.sampling,
            rule: &self.cem,
        }
    }
}

impl Identifier for CemIdentifier {
    fn identify(&self, problem: &Problem<'_>, episodes: &[Episode]) -> Result<Identified> {
        self.course().identify(problem, episodes)
    }
    fn assumes(&self) -> Assumptions {
        self.course().assumes()
    }
}
